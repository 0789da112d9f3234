// Descriptor -> axes, order of records within a time, files of a template.
#include "server/data/formats/grads/file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/grads/descriptor.hpp"
#include "server/data/formats/plain/placed_file.hpp"

namespace windsplat::data::grads {

namespace {

using bytes::ByteStore;
using bytes::PlacedFile;

constexpr std::size_t pieces_max = 100'000;
constexpr std::uint64_t marker = 4;  // bytes of the Fortran record marker before and after a record

class Opener {
 public:
  Opener(std::shared_ptr<Files> files, std::shared_ptr<const InputFile> input)
      : files_(std::move(files)), input_(std::move(input)) {}

  Result<std::unique_ptr<cf::ArrayFile>> open() {
    auto parsed = parse_descriptor(*input_);
    if (!parsed) return parsed.error();
    ctl_ = std::move(*parsed);
    file_ = std::make_unique<PlacedFile>(input_->name(), "GrADS");
    file_->set_title(ctl_.title);
    file_->add_identity(input_->identity());
    for (const auto& note : ctl_.notes) file_->add_note(note);
    if (auto fine = measure(); !fine) return fine.error();
    auto store = ctl_.is_template ? open_template() : open_single();
    if (!store) return store.error();
    store_ = std::move(*store);
    if (auto fine = add_axes(); !fine) return fine.error();
    add_variables();
    return std::unique_ptr<cf::ArrayFile>(std::move(file_));
  }

 private:
  static std::uint64_t grids_of(const Variable& variable) {
    return std::max<std::uint64_t>(1, variable.levels);
  }

  [[nodiscard]] std::uint64_t record_of(const Variable& variable) const {
    return ctl_.x.count * ctl_.y.count * bytes::size_of(variable.type) + ctl_.grid_header +
           ctl_.grid_trailer + (ctl_.sequential ? 2 * marker : 0);
  }

  // Computes the bytes of a time; all products below are smaller than the size of a whole file.
  Result<void> measure() {
    // With Fortran records, the header of a time is a separate record.
    if (ctl_.sequential && ctl_.time_header > 0) ctl_.time_header += 2 * marker;
    time_bytes_ = ctl_.time_header + ctl_.time_trailer;
    bool times_inside = false;
    bool times_outside = false;
    for (const Variable& variable : ctl_.variables) {
      const auto size = bytes::product({grids_of(variable), record_of(variable), ctl_.times});
      if (!size || *size > (std::uint64_t{1} << 60) / ctl_.variables.size()) {
        return input_->fault("declares more than 2^60 bytes");
      }
      time_bytes_ += grids_of(variable) * record_of(variable);
      times_inside = times_inside || variable.times_inside;
      times_outside = times_outside || !variable.times_inside;
    }
    if (!bytes::product({time_bytes_, ctl_.times})) {
      return input_->fault("declares more than 2^62 bytes");
    }
    const bool headed = ctl_.time_header + ctl_.time_trailer > 0;
    if (times_inside && (times_outside || headed || ctl_.is_template)) {
      return input_->fault(
          "is not supported: the order -1,20 must apply to all variables, in one file, without "
          "headers of times");
    }
    return {};
  }

  // Opens a file with `times` times.
  [[nodiscard]] Result<std::shared_ptr<ByteStore>> part_of(
      const std::shared_ptr<const InputFile>& file, std::size_t times) const {
    const std::uint64_t needed = ctl_.file_header + times * time_bytes_;
    if (file->size() < needed) {
      return file->fault("is truncated: it has " + std::to_string(file->size()) + " bytes, but " +
                         in_quotes(input_->name()) + " requires " + std::to_string(needed));
    }
    if (ctl_.sequential) {
      std::array<unsigned char, marker> raw{};
      const std::uint64_t at = ctl_.file_header + ctl_.time_header;
      if (auto done = file->read(at, raw.data(), raw.size()); !done) return done.error();
      double found = 0;
      bytes::decode(bytes::Scalar::uint32, ctl_.big_endian, raw.data(), marker, 1, &found);
      const Variable& first = ctl_.variables.front();
      const std::uint64_t grid = record_of(first) - 2 * marker;
      if (found != static_cast<double>(grid)) {
        return file->fault(
            "is not sequential as stated by its descriptor: its first record does not "
            "have " +
            std::to_string(grid) + " bytes in this byte order");
      }
    }
    return bytes::file_store(file, ctl_.file_header);
  }

  Result<std::shared_ptr<ByteStore>> open_single() {
    auto file = bytes::open_named(*files_, ctl_.dset, input_->name());
    if (!file) return file.error();
    file_->add_identity((*file)->identity());
    auto part = part_of(*file, ctl_.times);
    if (!part) return part;
    if (auto fine = account_for_rest(**file); !fine) return fine.error();
    return part;
  }

  // Undescribed bytes indicate wrong counts, unless they are further times. Fortran records have
  // been checked by their markers.
  Result<void> account_for_rest(const InputFile& file) {
    const std::uint64_t described = ctl_.file_header + ctl_.times * time_bytes_;
    const std::uint64_t rest = file.size() - described;
    if (rest == 0) return {};
    const std::uint64_t times = rest / time_bytes_;
    if (rest % time_bytes_ == 0) {
      file_->add_note(in_quotes(file.name()) + " has " + std::to_string(times) + " more step" +
                      (times == 1 ? "" : "s") + " than described");
    } else if (ctl_.sequential) {
      file_->add_note(std::to_string(rest) + " bytes after the last step of " +
                      in_quotes(file.name()) + " are not described");
    } else {
      return file.fault("has " + std::to_string(file.size()) + " bytes, " +
                        in_quotes(input_->name()) + " describes " + std::to_string(described) +
                        ": the rest is not a whole step of " + std::to_string(time_bytes_) +
                        " bytes, so that xdef, ydef, vars or headers cannot be right");
    }
    return {};
  }

  // Consecutive steps with the same name are in one file.
  Result<std::shared_ptr<ByteStore>> open_template() {
    std::vector<std::pair<std::string, std::size_t>> parts;  // name, times
    std::string problem;
    for (std::size_t step = 0; step < ctl_.times; ++step) {
      auto name = expand(ctl_.dset, ctl_.clock, static_cast<std::int64_t>(step), problem);
      if (!name) return input_->fault("is invalid: " + problem);
      if (!parts.empty() && parts.back().first == *name) {
        ++parts.back().second;
      } else {
        parts.emplace_back(std::move(*name), 1);
      }
      if (parts.size() > pieces_max) {
        return input_->fault("names more than " + std::to_string(pieces_max) + " files");
      }
    }
    std::vector<bytes::Piece> pieces;
    std::size_t absent = 0;
    for (const auto& [name, times] : parts) {
      auto piece = piece_of(name, times);
      if (!piece) return piece.error();
      absent += piece->open ? 0U : 1U;
      pieces.push_back(std::move(*piece));
    }
    if (absent == pieces.size()) {
      return bytes::absent_companion(parts.front().first, input_->name());
    }
    if (absent > 0) {
      const bool whole = std::any_of(
          ctl_.variables.begin(), ctl_.variables.end(),
          [](const Variable& variable) { return variable.type != bytes::Scalar::float32; });
      if (whole) {
        return input_->fault(
            "names missing files, which cannot be masked because its variables are integers");
      }
      file_->add_note(std::to_string(absent) + " of " + std::to_string(pieces.size()) +
                      " files of the template are missing: their steps are masked");
    }
    if (not_described_ > 0) {
      file_->add_note(std::to_string(not_described_) +
                      " bytes after the last steps of the template's files are not described");
    }
    return bytes::joined_store(std::move(pieces));
  }

  Result<bytes::Piece> piece_of(const std::string& name, std::size_t times) {
    bytes::Piece piece;
    piece.bytes = times * time_bytes_;
    auto file = files_->open(name);
    if (!file && file.error().kind == ErrorKind::not_found) return piece;
    if (!file) return file.error();
    if (auto part = part_of(*file, times); !part) return part.error();
    not_described_ += (*file)->size() - ctl_.file_header - piece.bytes;
    const std::string identity = (*file)->identity();
    file_->add_identity(identity);
    piece.open = [files = files_, name, identity,
                  skip = ctl_.file_header]() -> Result<std::shared_ptr<ByteStore>> {
      auto again = bytes::open_again(*files, name, identity);
      if (!again) return again.error();
      return bytes::file_store(*again, skip);
    };
    return piece;
  }

  // The axes of GrADS are longitude and latitude; impossible values are treated as distances.
  void add_horizontal() {
    std::vector<double> x = ctl_.x.coordinates();
    std::vector<double> y = ctl_.y.coordinates();
    const auto [west, east] = std::minmax_element(x.begin(), x.end());
    const auto [south, north] = std::minmax_element(y.begin(), y.end());
    const bool globe = *south >= -90.001 && *north <= 90.001 && *west >= -720 && *east <= 720 &&
                       *east - *west <= 360.001;
    if (!globe) file_->add_note("xdef and ydef are not longitudes and latitudes: plain distances");
    if (ctl_.yrev) std::reverse(y.begin(), y.end());
    y_ = file_->add_dimension(globe ? "lat" : "y", ctl_.y.count);
    file_->add_axis(y_, {globe ? "degrees_north" : "", "Y", "", ""}, std::move(y));
    x_ = file_->add_dimension(globe ? "lon" : "x", ctl_.x.count);
    file_->add_axis(x_, {globe ? "degrees_east" : "", "X", "", ""}, std::move(x));
  }

  Result<void> add_axes() {
    auto times = time_values();
    if (!times) return times.error();
    time_ = file_->add_dimension("time", ctl_.times);
    const bool days = ctl_.clock.unit == 'd' || ctl_.clock.unit == 'm' || ctl_.clock.unit == 'y';
    const char* unit = ctl_.clock.unit == 'n' ? "minutes" : days ? "days" : "hours";
    file_->add_axis(time_,
                    {std::string(unit) + " since " + text_of(ctl_.clock.first), "T", "",
                     ctl_.clock.no_leap ? "noleap" : ""},
                    std::move(*times));
    std::vector<double> z = ctl_.z.coordinates();
    const bool falls =
        z.size() > 1 && z.front() <= 1100 && z.back() > 0 && std::is_sorted(z.rbegin(), z.rend());
    const bool pressure = falls || ctl_.pascals;
    if (pressure) {
      file_->add_note(ctl_.pascals
                          ? "levels are pressures in Pa because of the option pascals"
                          : "levels descend from 1100 or less: interpreted as pressures in hPa, as "
                            "in GrADS");
    }
    if (ctl_.zrev) std::reverse(z.begin(), z.end());
    z_ = file_->add_dimension("lev", ctl_.z.count);
    file_->add_axis(z_, {pressure ? (ctl_.pascals ? "Pa" : "hPa") : "", "Z", "", ""}, std::move(z));
    add_horizontal();
    return {};
  }

  Result<std::vector<double>> time_values() const {
    std::vector<double> out(ctl_.times);
    const double scale = ctl_.clock.unit == 'n' ? 1 : ctl_.clock.unit == 'h' ? 60 : 1440;
    for (std::size_t step = 0; step < out.size(); ++step) {
      const auto date = date_of(ctl_.clock, static_cast<std::int64_t>(step));
      if (!date) return input_->fault("is invalid: its time extends beyond the year 9999");
      out[step] = static_cast<double>(minutes_since_first(ctl_.clock, *date)) / scale;
    }
    return out;
  }

  void add_variables() {
    std::uint64_t before = ctl_.time_header;  // bytes of the preceding variables
    for (const Variable& variable : ctl_.variables) {
      const std::uint64_t record = record_of(variable);
      const std::uint64_t all = grids_of(variable) * record;
      const std::size_t size = bytes::size_of(variable.type);
      FileVariable out;
      out.name = variable.name;
      out.long_name = variable.description;
      out.units = variable.units;
      bytes::Placement place;
      place.store = store_;
      place.type = variable.type;
      place.big_endian = ctl_.big_endian;
      place.offset = before + ctl_.grid_header + (ctl_.sequential ? marker : 0);
      out.dims = {time_};
      place.strides = {variable.times_inside ? all : time_bytes_};
      place.present = {{0, ctl_.times}};
      if (variable.levels > 0) {
        out.dims.push_back(z_);
        place.strides.push_back(record);
        const std::size_t missing = ctl_.z.count - variable.levels;
        place.present.push_back(ctl_.zrev ? bytes::Stored{missing, ctl_.z.count}
                                          : bytes::Stored{0, variable.levels});
        if (missing > 0) {
          file_->add_note(in_quotes(variable.name) + " has " + std::to_string(variable.levels) +
                          " of " + std::to_string(ctl_.z.count) + " levels: others are masked");
        }
      }
      const std::array<int, 2> dims{y_, x_};
      const std::array<std::size_t, 2> lengths{ctl_.y.count, ctl_.x.count};
      for (const std::size_t i : {0U, 1U}) {
        const std::size_t which = variable.transposed ? 1 - i : i;
        out.dims.push_back(dims.at(which));
        place.present.push_back({0, lengths.at(which)});
        place.strides.push_back(i == 1 ? size : size * lengths.at(1 - which));
      }
      before += variable.times_inside ? all * ctl_.times : all;
      if (ctl_.has_undef) {
        // Rounded values of undef are undefined too, as in GrADS.
        const double width = std::abs(ctl_.undef) / 1e5;
        place.masked = {ctl_.undef - width, ctl_.undef + width};
      }
      file_->add_array(std::move(out), std::move(place), {});
    }
  }

  std::shared_ptr<Files> files_;
  std::shared_ptr<const InputFile> input_;
  Descriptor ctl_;
  std::unique_ptr<PlacedFile> file_;
  std::shared_ptr<ByteStore> store_;
  std::uint64_t time_bytes_ = 0;
  std::uint64_t not_described_ = 0;  // bytes of files of a template after their last steps
  int time_ = 0;
  int z_ = 0;
  int y_ = 0;
  int x_ = 0;
};

}  // namespace

bool looks_like(std::string_view head) {
  if (head.find('\0') != std::string_view::npos) return false;
  bool dset = false;
  bool other = false;
  while (!head.empty()) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    const auto words = bytes::words_of(head.substr(0, end));
    head.remove_prefix(std::min(end + 1, head.size()));
    if (words.empty() || words.front().front() == '*') continue;
    const std::string key = lower(words.front());
    dset = dset || key == "dset";
    other = other || key == "xdef" || key == "undef" || key == "options" || key == "title" ||
            key == "dtype" || key == "tdef";
  }
  return dset && other;
}

Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> descriptor_file) {
  return Opener(files, std::move(descriptor_file)).open();
}

}  // namespace windsplat::data::grads
