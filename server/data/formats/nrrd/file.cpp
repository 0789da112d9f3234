// Locates the samples (after the header, in one data file or in several); one variable per
// component.
#include "server/data/formats/nrrd/file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/data/bytes/unrolled.hpp"
#include "server/data/formats/nrrd/axes.hpp"
#include "server/data/formats/nrrd/header.hpp"
#include "server/data/formats/plain/placed_file.hpp"

namespace windsplat::data::nrrd {

namespace {

using bytes::ByteStore;
using bytes::PlacedFile;

// Offset after the next `lines` lines.
Result<std::uint64_t> skip_lines(const InputFile& file, std::uint64_t at, std::int64_t lines) {
  std::vector<char> block(std::size_t{1} << 16);
  while (lines > 0) {
    const std::uint64_t some =
        std::min<std::uint64_t>(block.size(), file.size() - std::min(at, file.size()));
    if (some == 0) return file.fault("is truncated: it has fewer lines than 'line skip'");
    if (auto done = file.read(at, block.data(), some); !done) return done.error();
    std::uint64_t used = 0;
    while (used < some && lines > 0) lines -= block[used++] == '\n' ? 1 : 0;
    at += used;
  }
  return at;
}

// The part of the samples in one file.
class Part {
 public:
  Part(const Header& header, std::uint64_t begin, std::uint64_t bytes)
      : header_(header), begin_(begin), bytes_(bytes) {}

  // Adds the bytes after the samples to `rest`, if the encoding permits counting them.
  [[nodiscard]] Result<std::shared_ptr<ByteStore>> in(const std::shared_ptr<const InputFile>& file,
                                                      std::uint64_t& rest) const {
    const auto from = skip_lines(*file, begin_, header_.line_skip);
    if (!from) return from.error();
    if (header_.encoding == "raw") return raw(file, *from, rest);
    if (header_.byte_skip < 0) {
      return file->fault("has 'byte skip: -1', which only raw data can have");
    }
    const auto encoding = header_.encoding == "gzip"  ? bytes::Encoding::gzip
                          : header_.encoding == "hex" ? bytes::Encoding::hex
                                                      : bytes::Encoding::text;
    auto skip = static_cast<std::uint64_t>(header_.byte_skip);
    std::uint64_t start = *from;
    if (encoding != bytes::Encoding::gzip) {  // applies to the bytes of the file
      start += std::min(skip, file->size());
      skip = 0;
    }
    const std::uint64_t there = file->size() - std::min(start, file->size());
    if (skip > (std::uint64_t{1} << 62) || !bytes::can_hold(encoding, there, bytes_ + skip)) {
      return file->fault("is truncated: its " + std::to_string(there) + " bytes of " +
                         header_.encoding + " data cannot hold " + std::to_string(bytes_) +
                         " bytes of samples");
    }
    return bytes::unrolled_store(file, encoding, start, bytes_, skip);
  }

 private:
  [[nodiscard]] Result<std::shared_ptr<ByteStore>> raw(const std::shared_ptr<const InputFile>& file,
                                                       std::uint64_t from,
                                                       std::uint64_t& rest) const {
    const std::uint64_t size = file->size();
    std::uint64_t start = 0;
    if (header_.byte_skip < 0) {
      start = size - std::min(size, bytes_);
    } else {
      start = from + std::min(size, static_cast<std::uint64_t>(header_.byte_skip));
    }
    if (start < from || start > size || size - start < bytes_) {
      return file->fault("is truncated: it has " + std::to_string(size - std::min(from, size)) +
                         " bytes of data; its header requires " + std::to_string(bytes_) +
                         (header_.byte_skip > 0
                              ? " after " + std::to_string(header_.byte_skip) + " skipped ones"
                              : ""));
    }
    rest += size - start - bytes_;
    return bytes::file_store(file, start);
  }

  Header header_;
  std::uint64_t begin_;
  std::uint64_t bytes_;
};

class Opener {
 public:
  Opener(std::shared_ptr<Files> files, std::shared_ptr<const InputFile> input)
      : files_(std::move(files)), input_(std::move(input)) {}

  Result<std::unique_ptr<cf::ArrayFile>> open() {
    auto header = parse_header(*input_);
    if (!header) return header.error();
    header_ = std::move(*header);
    file_ = std::make_unique<PlacedFile>(input_->name(), "NRRD");
    file_->set_title(header_.content);
    file_->add_identity(input_->identity());
    auto store = find_store();
    if (!store) return store.error();
    if (rest_ > 0) {
      file_->add_note(std::to_string(rest_) + " bytes after the last step are not described");
    }
    auto placing = place_axes(header_);
    if (!placing) return input_->fault(placing.error().message);
    placing_ = std::move(*placing);
    for (const auto& note : header_.notes) file_->add_note(note);
    for (const auto& note : placing_.notes) file_->add_note(note);
    add_variables(*store);
    return std::unique_ptr<cf::ArrayFile>(std::move(file_));
  }

 private:
  // Text is converted to float64.
  [[nodiscard]] bool is_text() const { return header_.encoding == "text"; }
  [[nodiscard]] bytes::Scalar stored() const {
    return is_text() ? bytes::Scalar::float64 : header_.type;
  }

  Result<std::shared_ptr<ByteStore>> find_store() {
    std::vector<std::uint64_t> factors{bytes::size_of(stored())};
    for (const HeaderAxis& axis : header_.axes) factors.push_back(axis.size);
    const auto total = bytes::product(factors);
    if (!total) return input_->fault("declares more than 2^62 bytes of samples");
    if (header_.data_files.empty()) return Part(header_, header_.end, *total).in(input_, rest_);
    return find_parts(*total);
  }

  // All data files have equal size, which follows from their number.
  Result<std::shared_ptr<ByteStore>> find_parts(std::uint64_t total) {
    const std::size_t count = header_.data_files.size();
    if (total % count != 0 || (count > 1 && !count_fits(count))) {
      return input_->fault("names " + std::to_string(count) +
                           " data files, among which its samples cannot be divided");
    }
    const Part part(header_, 0, total / count);
    std::vector<bytes::Piece> pieces;
    for (const std::string& name : header_.data_files) {
      auto file = bytes::open_named(*files_, name, input_->name());
      if (!file) return file.error();
      auto store = part.in(*file, rest_);
      if (!store) return store.error();
      const std::string identity = (*file)->identity();
      file_->add_identity(identity);
      if (count == 1) return store;
      pieces.push_back(
          {total / count,
           [part, name, identity, files = files_]() -> Result<std::shared_ptr<ByteStore>> {
             auto again = bytes::open_again(*files, name, identity);
             if (!again) return again.error();
             std::uint64_t rest = 0;
             return part.in(*again, rest);
           }});
    }
    return bytes::joined_store(std::move(pieces));
  }

  // With `file_dimension` dimensions per file, the number of files is the product of the sizes of
  // the slower axes.
  [[nodiscard]] bool count_fits(std::size_t count) const {
    const std::size_t rank = header_.axes.size();
    const std::size_t dimension = header_.file_dimension == 0 ? rank - 1 : header_.file_dimension;
    if (dimension > rank) return false;
    if (dimension == rank) return header_.axes.back().size % count == 0;
    std::uint64_t slabs = 1;
    for (std::size_t a = dimension; a < rank && slabs <= count; ++a) slabs *= header_.axes[a].size;
    return slabs == count;
  }

  void add_variables(const std::shared_ptr<ByteStore>& store) {
    FileVariable variable;
    bytes::Placement placement;
    placement.store = store;
    placement.type = stored();
    placement.big_endian = is_text() ? std::endian::native == std::endian::big : header_.big_endian;
    std::uint64_t stride = bytes::size_of(stored());
    std::uint64_t component_stride = 0;
    std::uint64_t components = 1;
    constexpr std::array<const char*, 3> letters{"X", "Y", "Z"};
    for (std::size_t a = 0; a < header_.axes.size(); ++a) {
      const PlacedAxis& axis = placing_.axes[a];
      const std::uint64_t size = header_.axes[a].size;
      if (axis.use == Use::components) {
        component_stride = stride;
        components = size;
      } else if (axis.use != Use::single) {
        const int dimension = file_->add_dimension(axis.name, size);
        const bool known = axis.use == Use::space && axis.world >= 0;
        if (!axis.coordinates.empty()) {
          file_->add_axis(dimension,
                          {axis.units,
                           axis.use == Use::steps ? "T"
                           : known                ? letters.at(static_cast<std::size_t>(axis.world))
                                                  : "",
                           "", ""},
                          axis.coordinates);
        }
        variable.dims.insert(variable.dims.begin(), dimension);
        placement.strides.insert(placement.strides.begin(), stride);
        placement.present.insert(placement.present.begin(), {0, size});
      }
      stride *= size;
    }
    variable.type = bytes::name_of(header_.type);
    variable.units = header_.sample_units;
    add_components(variable, placement, components, component_stride);
  }

  // The file's name; in a series without its number, as files must agree on the names of fields.
  [[nodiscard]] std::string field_name() const {
    std::string name = std::filesystem::path(input_->name()).stem().native();
    if (files_->location().kind != Location::Kind::series) return name;
    const std::size_t end = name.find_last_not_of("0123456789-_.");
    name.resize(end == std::string::npos ? 0 : end + 1);
    return name.empty() ? "values" : name;
  }

  void add_components(FileVariable variable, const bytes::Placement& placement,
                      std::uint64_t components, std::uint64_t stride) {
    const std::string name = field_name();
    if (components == 1) {
      variable.name = name;
      file_->add_array(std::move(variable), placement, {});
      return;
    }
    if (header_.measurement_frame) {
      file_->add_note("the measurement frame is not applied: components count along the axes");
    }
    constexpr std::array<const char*, 3> suffixes{"_x", "_y", "_z"};
    for (std::size_t c = 0; c < components; ++c) {
      FileVariable component = variable;
      component.name = name + suffixes.at(c);
      component.vector_mark = name + ' ' + std::to_string(c);
      bytes::Placement where = placement;
      where.offset = c * stride;
      where.negated = placing_.turned.at(c);
      file_->add_array(std::move(component), std::move(where), {});
    }
  }

  std::shared_ptr<Files> files_;
  std::shared_ptr<const InputFile> input_;
  Header header_;
  Placing placing_;
  std::unique_ptr<PlacedFile> file_;
  std::uint64_t rest_ = 0;  // bytes after the samples
};

}  // namespace

bool looks_like(std::string_view head) {
  return head.size() >= 8 && head.starts_with("NRRD000") && head[7] >= '1' && head[7] <= '5';
}

Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> header_file) {
  return Opener(files, std::move(header_file)).open();
}

}  // namespace windsplat::data::nrrd
