// Maps steps to files, and components to byte offsets within a step.
#include "server/data/formats/raw/file.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/plain/placed_file.hpp"
#include "server/data/formats/raw/document.hpp"

namespace windsplat::data::raw {

namespace {

using bytes::ByteStore;
using bytes::PlacedFile;

constexpr std::size_t pieces_max = 100'000;

class Opener {
 public:
  Opener(std::shared_ptr<Files> files, std::shared_ptr<const InputFile> input)
      : files_(std::move(files)), input_(std::move(input)) {}

  Result<std::unique_ptr<cf::ArrayFile>> open() {
    auto parsed = parse_document(*input_);
    if (!parsed) return parsed.error();
    doc_ = std::move(*parsed);
    file_ = std::make_unique<PlacedFile>(input_->name(), "raw");
    file_->set_title(doc_.title);
    file_->add_identity(input_->identity());
    for (const char letter : doc_.order) {
      lengths_.push_back(doc_.dims.at(static_cast<std::size_t>(letter - 'x')));
    }
    if (auto fine = open_groups(); !fine) return fine.error();
    if (auto fine = account_for_rests(); !fine) return fine.error();
    add_axes();
    for (const Group& group : groups_) add_fields(group);
    return std::unique_ptr<cf::ArrayFile>(std::move(file_));
  }

 private:
  // Consecutive fields within a step, and the bytes of a step.
  struct Group {
    std::vector<const Field*> fields;
    std::shared_ptr<ByteStore> store;
    std::uint64_t step_bytes;
  };

  // Layout of a file, from the description of all its fields.
  struct Extent {
    std::uint64_t size = 0;
    std::uint64_t described = 0;                 // end of the last step, bytes
    std::vector<std::uint64_t> step_bytes = {};  // per group of fields in the file
  };

  // Undescribed bytes indicate wrong dimensions, unless they are further steps.
  Result<void> account_for_rests() {
    std::size_t longer = 0;
    std::string first;
    for (const auto& [name, extent] : extents_) {
      const std::uint64_t rest = extent.size - extent.described;
      if (rest == 0) continue;
      const auto step = std::find_if(extent.step_bytes.begin(), extent.step_bytes.end(),
                                     [&](std::uint64_t bytes) { return rest % bytes == 0; });
      if (step == extent.step_bytes.end()) {
        return make_error(
            ErrorKind::bad_data,
            in_quotes(name) + " has " + std::to_string(extent.size) + " bytes, " +
                in_quotes(input_->name()) + " describes " + std::to_string(extent.described) +
                ": the rest is not a whole step of " + std::to_string(extent.step_bytes.front()) +
                " bytes, so that dims, type or offset cannot be right");
      }
      if (++longer > 1) continue;
      const std::uint64_t steps = rest / *step;
      first = in_quotes(name) + " has " + std::to_string(steps) + " more step" +
              (steps == 1 ? "" : "s") + " than described";
    }
    if (longer > 1) first += ", and " + std::to_string(longer - 1) + " more files are too long";
    if (longer > 0) file_->add_note(std::move(first));
    return {};
  }

  void add_axes() {
    constexpr std::array<const char*, 3> names{"x", "y", "z"};
    constexpr std::array<const char*, 3> axes{"X", "Y", "Z"};
    if (doc_.times.count > 1 || !doc_.time_units.empty()) {
      time_ = file_->add_dimension("time", doc_.times.count);
      file_->add_axis(time_, {doc_.time_units, "T", "", doc_.calendar}, doc_.times.coordinates());
    }
    for (const char letter : doc_.order) {
      const auto a = static_cast<std::size_t>(letter - 'x');
      const int id = file_->add_dimension(names.at(a), doc_.dims.at(a));
      const AxisText& axis = doc_.axes.at(a);
      if (axis.places.count > 0) {
        file_->add_axis(id, {axis.units, axes.at(a), axis.positive, ""}, axis.places.coordinates());
      }
      space_.push_back(id);
    }
  }

  // Fields that share the file of the document are consecutive within a step.
  Result<void> open_groups() {
    std::vector<const Field*> together;
    for (const Field& field : doc_.fields) {
      if (field.files.names.empty()) together.push_back(&field);
    }
    if (!together.empty()) {
      if (auto fine = open_group(together, doc_.files, doc_.offset); !fine) return fine;
    }
    for (const Field& field : doc_.fields) {
      if (field.files.names.empty()) continue;
      if (auto fine = open_group({&field}, field.files, field.offset); !fine) return fine;
    }
    return {};
  }

  [[nodiscard]] Result<std::uint64_t> bytes_of(const Field& field) const {
    std::vector<std::uint64_t> factors{std::max<std::size_t>(1, field.components.size()),
                                       bytes::size_of(field.type), doc_.times.count};
    factors.insert(factors.end(), lengths_.begin(), lengths_.end());
    const auto total = bytes::product(factors);
    if (!total || *total > (std::uint64_t{1} << 60) / doc_.fields.size()) {
      return input_->fault("is invalid: /dims: more than 2^60 bytes in total");
    }
    return *total / doc_.times.count;
  }

  Result<void> open_group(const std::vector<const Field*>& fields, const FileNames& files,
                          std::uint64_t skip) {
    std::uint64_t step_bytes = 0;
    for (const Field* field : fields) {
      const auto some = bytes_of(*field);
      if (!some) return some.error();
      step_bytes += *some;
    }
    auto store = open_files(files, skip, step_bytes);
    if (!store) return store.error();
    groups_.push_back({fields, std::move(*store), step_bytes});
    return {};
  }

  void add_fields(const Group& group) {
    std::uint64_t before = 0;
    for (const Field* field : group.fields) {
      add_field(*field, group.store, before, group.step_bytes);
      before += *bytes_of(*field);
    }
  }

  Result<std::shared_ptr<ByteStore>> open_files(const FileNames& files, std::uint64_t skip,
                                                std::uint64_t step_bytes) {
    const std::size_t steps = doc_.times.count;
    std::size_t per_file = doc_.steps_per_file;
    if (per_file == 0) per_file = files.pattern ? 1 : steps / files.names.size();
    const std::size_t count = files.pattern && per_file > 0 ? steps / per_file : files.names.size();
    if (per_file == 0 || count * per_file != steps || count > pieces_max) {
      return input_->fault("is invalid: /file: " + std::to_string(steps) +
                           " steps cannot be divided among " + std::to_string(count) +
                           " files of " + std::to_string(per_file));
    }
    std::vector<bytes::Piece> pieces;
    for (std::size_t i = 0; i < count; ++i) {
      const auto name = name_of(files, i);
      if (!name) return name.error();
      auto file = bytes::open_named(*files_, *name, input_->name());
      if (!file) return file.error();
      const std::uint64_t needed = skip + per_file * step_bytes;
      if ((*file)->size() < needed) {
        return (*file)->fault("is truncated: it has " + std::to_string((*file)->size()) +
                              " bytes; " + in_quotes(input_->name()) + " requires " +
                              std::to_string(needed));
      }
      Extent& extent = extents_[*name];
      extent.size = (*file)->size();
      extent.described = std::max(extent.described, needed);
      extent.step_bytes.push_back(step_bytes);
      const std::string identity = (*file)->identity();
      file_->add_identity(identity);
      if (count == 1) return bytes::file_store(*file, skip);
      pieces.push_back(
          {per_file * step_bytes,
           [files = files_, own = *name, identity, skip]() -> Result<std::shared_ptr<ByteStore>> {
             auto again = bytes::open_again(*files, own, identity);
             if (!again) return again.error();
             return bytes::file_store(*again, skip);
           }});
    }
    return bytes::joined_store(std::move(pieces));
  }

  [[nodiscard]] Result<std::string> name_of(const FileNames& files, std::size_t index) const {
    if (!files.pattern) return files.names[index];
    const auto number = doc_.first_number + static_cast<std::int64_t>(index) * doc_.number_step;
    auto name = bytes::numbered_name(files.names.front(), number);
    if (!name) {
      return input_->fault("is invalid: /file: a pattern has one %d, %4d or %04d");
    }
    return *name;
  }

  void add_field(const Field& field, const std::shared_ptr<ByteStore>& store, std::uint64_t before,
                 std::uint64_t step_bytes) {
    const std::size_t components = std::max<std::size_t>(1, field.components.size());
    const std::size_t size = bytes::size_of(field.type);
    std::uint64_t stride = field.planar ? size : size * components;
    bytes::Placement place;
    place.store = store;
    place.type = field.type;
    place.big_endian = field.big_endian;
    FileVariable variable;
    variable.units = field.units;
    variable.dims = space_;
    for (std::size_t d = lengths_.size(); d-- > 0;) {
      place.strides.insert(place.strides.begin(), stride);
      place.present.insert(place.present.begin(), {0, lengths_[d]});
      stride *= lengths_[d];
    }
    if (time_ >= 0) {
      variable.dims.insert(variable.dims.begin(), time_);
      place.strides.insert(place.strides.begin(), step_bytes);
      place.present.insert(place.present.begin(), {0, doc_.times.count});
    }
    for (std::size_t c = 0; c < components; ++c) {
      FileVariable component = variable;
      component.name = field.components.empty() ? field.name : field.components[c];
      if (components > 1) component.vector_mark = field.name + ' ' + std::to_string(c);
      bytes::Placement where = place;
      where.offset = before + c * (field.planar ? stride : size);
      file_->add_array(std::move(component), std::move(where), field.missing);
    }
  }

  std::shared_ptr<Files> files_;
  std::shared_ptr<const InputFile> input_;
  Document doc_;
  std::unique_ptr<PlacedFile> file_;
  int time_ = -1;
  std::vector<int> space_;
  std::vector<std::uint64_t> lengths_;
  std::vector<Group> groups_;
  std::map<std::string, Extent> extents_;  // keyed by file name
};

}  // namespace

bool looks_like(std::string_view head) {
  return trim(head).starts_with('{') && head.find("\"windsplat\"") != std::string_view::npos;
}

bool is_json(std::string_view head) {
  const std::string_view text = trim(head);
  if (!text.starts_with('{')) return false;
  const std::string_view rest = trim(text.substr(1));
  return rest.starts_with('"') || rest.starts_with('}');
}

Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files,
                                            std::shared_ptr<const InputFile> description) {
  return Opener(files, std::move(description)).open();
}

}  // namespace windsplat::data::raw
