#include "server/data/formats/zarr/scan.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/formats/zarr/chunks.hpp"
#include "server/data/formats/zarr/nodes.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t text_max = 4096;
constexpr std::size_t dimensions_max = 4096;
constexpr const char* group_reason = "group: to see it, open its folder";
constexpr std::uint64_t stamped_files_max = 4096;

std::string type_name(const Dtype& type) {
  const char* const base = type.kind == 'f' ? "float" : type.kind == 'i' ? "int" : "uint";
  // Half floats are converted to float32 on reading.
  const std::size_t bytes = type.kind == 'f' ? std::max<std::size_t>(4, type.bytes) : type.bytes;
  return base + std::to_string(bytes * 8);
}

std::string nameless(const std::vector<std::size_t>& shape, std::size_t d) {
  return "dim" + std::to_string(shape.size() - d) + "_" + std::to_string(shape[d]);
}

// The names that the file gives to the dimensions, empty where there is none; nullopt if no names
// are given at all.
std::optional<std::vector<std::string>> given_names(const Node& node) {
  const Json* names = node.metadata.find("dimension_names");
  const bool may_be_null = names != nullptr && names->kind == Json::Kind::list;
  if (!may_be_null) names = node.attributes.find("_ARRAY_DIMENSIONS");
  if (names == nullptr) return {};
  std::vector<std::string> out;
  for (const Json& entry : names->list) {
    const bool named = entry.kind == Json::Kind::text && is_plain_name(entry.text);
    const bool absent = may_be_null && (entry.kind == Json::Kind::null || entry.text.empty());
    if (named || absent) out.push_back(named ? entry.text : "");
  }
  if (out.size() != names->list.size()) out.clear();
  return out;
}

// Without names, arrays share dimensions of equal length at equal positions.
void name_dimensions(const std::optional<std::vector<std::string>>& given, Array& array) {
  const auto& shape = array.metadata.shape;
  if (given) {
    std::set<std::string> distinct;
    for (std::size_t d = 0; d < given->size() && d < shape.size(); ++d) {
      const std::string& name = (*given)[d];
      array.dimensions.push_back(name.empty() ? nameless(shape, d) : name);
      distinct.insert(array.dimensions.back());
      array.named_dimensions = array.named_dimensions || !name.empty();
    }
    if (given->size() == shape.size() && distinct.size() == shape.size()) return;
    array.named_dimensions = false;
    array.metadata.problem = "its dimension names are not names, one for each dimension";
  }
  array.dimensions.clear();
  for (std::size_t d = 0; d < shape.size(); ++d) array.dimensions.push_back(nameless(shape, d));
}

// If no field can be read, returns the reason instead of a missing field.
Result<void> check_any_field(const StoreContents& store) {
  const FileVariable* unread = nullptr;
  for (const FileVariable& variable : store.file.variables) {
    if (variable.dims.size() < 2) continue;
    if (variable.unread.empty()) return {};
    unread = &variable;
  }
  if (unread == nullptr) return {};
  return broken_store(store.name,
                      "no field can be read; " + in_quotes(unread->name) + ": " + unread->unread);
}

class StoreScan {
 public:
  explicit StoreScan(Files& files) : files_(files) {}

  Result<StoreContents> run() {
    out_.name = std::filesystem::path(files_.location().folder).filename().native();
    if (out_.name.empty()) out_.name = files_.location().stem;
    if (auto done = find_arrays(); !done) return broken_store(out_.name, done.error().message);
    describe_all();
    if (auto fine = check_dimensions(); !fine) return fine.error();
    if (auto fine = check_any_field(out_); !fine) return fine.error();
    identify();
    return std::move(out_);
  }

 private:
  Result<void> find_arrays() {
    auto nodes = find_nodes(files_);
    if (!nodes) return nodes.error();
    out_.version = nodes->version;
    out_.identity = out_.name + '\n' + nodes->identity;
    out_.file.title = text_in(nodes->attributes, "title");
    for (const std::string& group : nodes->groups) {
      out_.file.left_out.push_back({group, group_reason});
    }
    for (Node& node : nodes->arrays) {
      auto metadata = nodes->version == 2 ? parse_v2(node.metadata) : parse_v3(node.metadata);
      if (!metadata) return broken_store(node.name, metadata.error().message);
      Array array;
      array.path = node.path;
      array.name = node.name;
      array.metadata = std::move(*metadata);
      if (array.metadata.problem.empty() && !node.path.empty() && !files_.exists(node.path)) {
        array.metadata.problem = "its folder is missing in the store";
      }
      const bool is_image = nodes->multiscale && node.path == nodes->multiscale->finest + '/';
      if (is_image && nodes->multiscale->axes.size() == array.metadata.shape.size()) {
        place_image(*nodes->multiscale, array);
      } else {
        name_dimensions(given_names(node), array);
      }
      array.attributes = std::move(node.attributes);
      out_.arrays.push_back(std::move(array));
    }
    if (nodes->multiscale) tell_level(*nodes->multiscale);
    out_.levels = std::move(nodes->levels);
    for (Node& node : nodes->level_arrays) {
      auto metadata = nodes->version == 2 ? parse_v2(node.metadata) : parse_v3(node.metadata);
      if (!metadata) return broken_store(node.name, metadata.error().message);
      Array array;
      array.path = std::move(node.path);
      array.name = std::move(node.name);
      array.metadata = std::move(*metadata);
      out_.level_arrays.push_back(std::move(array));
    }
    return {};
  }

  void tell_level(const Multiscale& multiscale) {
    const std::size_t levels = multiscale.levels.size();
    std::string note = "of the " + std::to_string(levels) + " levels of detail ('multiscales') " +
                       in_quotes(multiscale.finest) + ", the finest, is read";
    if (levels == 1) note = "'multiscales' names one level, " + in_quotes(multiscale.finest);
    out_.file.notes.push_back(std::move(note));
  }

  // Names the dimensions of an image, and adds their positions as coordinates.
  void place_image(const Multiscale& multiscale, Array& image) {
    std::vector<std::string> names;
    for (const ImageAxis& axis : multiscale.axes) {
      names.push_back(is_plain_name(axis.name) ? axis.name : "");
    }
    name_dimensions(names, image);
    image.named_dimensions = false;  // these names say nothing about missing values
    for (std::size_t d = 0; d < multiscale.axes.size(); ++d) {
      const ImageAxis& axis = multiscale.axes[d];
      const std::size_t length = image.metadata.shape[d];
      if (!axis.is_space && !axis.is_time) {
        out_.file.dimensions.push_back(
            {.name = image.dimensions[d], .length = length, .other = true});
        continue;
      }
      if (!multiscale.placed) continue;
      Array coordinate;
      coordinate.name = image.dimensions[d];
      coordinate.dimensions = {coordinate.name};
      coordinate.metadata.shape = {length};
      coordinate.metadata.chunks = {1};
      coordinate.metadata.order = {0};
      coordinate.metadata.dtype = {'f', 8};
      coordinate.line = Line{axis.first, axis.spacing};
      Json& attributes = coordinate.attributes;
      attributes.kind = Json::Kind::object;
      attributes.object["units"] = {.kind = Json::Kind::text, .text = axis.unit};
      if (axis.is_time) attributes.object["axis"] = {.kind = Json::Kind::text, .text = "T"};
      out_.arrays.push_back(std::move(coordinate));
    }
  }

  // Coordinates first: their lengths have precedence over those of other arrays.
  void describe_all() {
    std::stable_partition(out_.arrays.begin(), out_.arrays.end(),
                          std::mem_fn(&Array::is_coordinate));
    for (const Array& array : out_.arrays) {
      if (out_.file.dimensions.size() <= dimensions_max) describe(array);
    }
  }

  [[nodiscard]] Result<void> check_dimensions() const {
    if (out_.file.dimensions.size() <= dimensions_max) return {};
    return broken_store(out_.name,
                        "it has more than " + std::to_string(dimensions_max) + " dimensions");
  }

  void describe(const Array& array) {
    FileVariable variable;
    variable.name = array.name;
    variable.type = type_name(array.metadata.dtype);
    variable.unread = array.metadata.problem;
    for (std::size_t d = 0; d < array.dimensions.size(); ++d) {
      const std::string& name = array.dimensions[d];
      const std::size_t length = array.metadata.shape[d];
      auto at = std::find_if(out_.file.dimensions.begin(), out_.file.dimensions.end(),
                             [&](const FileDimension& known) { return known.name == name; });
      if (at == out_.file.dimensions.end()) {
        out_.file.dimensions.push_back({.name = name, .length = length});
        at = out_.file.dimensions.end() - 1;
      }
      if (at->length != length && variable.unread.empty()) {
        variable.unread = "its dimension " + in_quotes(name) + " has the length " +
                          std::to_string(length) + ", elsewhere " + std::to_string(at->length);
      }
      variable.dims.push_back(static_cast<int>(at - out_.file.dimensions.begin()));
    }
    variable.numeric = variable.unread.empty();
    const Json& attributes = array.attributes;
    variable.standard_name = text_in(attributes, "standard_name");
    variable.long_name = text_in(attributes, "long_name");
    variable.units = text_in(attributes, "units");
    variable.axis = text_in(attributes, "axis");
    variable.positive = text_in(attributes, "positive");
    variable.calendar = text_in(attributes, "calendar");
    variable.coordinates = text_in(attributes, "coordinates");
    variable.bounds = text_in(attributes, "bounds");
    if (variable.bounds.empty()) variable.bounds = text_in(attributes, "climatology");
    variable.grid_mapping = text_in(attributes, "grid_mapping");
    variable.cf_role = text_in(attributes, "cf_role");
    variable.mesh = text_in(attributes, "mesh");
    variable.vector_mark = text_in(attributes, "windsplat_vector");
    variable.is_unsigned = lower(text_in(attributes, "_Unsigned")) == "true";
    variable.packed =
        attributes.find("scale_factor") != nullptr || attributes.find("add_offset") != nullptr;
    out_.file.variables.push_back(std::move(variable));
    if (out_.version == 2 && !array.is_coordinate() && array.metadata.problem.empty() &&
        array.is_fill_a_number()) {
      out_.file.notes.push_back(in_quotes(array.name) +
                                " has fill_value 0 and no dimension names: zeros are shown as "
                                "values, even in absent chunks");
    }
  }

  // Looks at the files of chunks, and counts the absent ones; not of a store that is fetched, whose
  // chunks are fetched when they are read, or of one that says what it contains.
  void identify() {
    expect_small();
    if (out_.levels && !out_.levels->contents.empty()) return;
    if (files_.location().fetched) {
      out_.file.notes.emplace_back(
          "absent chunks are not counted, as chunks are fetched when they are read");
      return;
    }
    const auto is_stored = [](const Array& array) {
      return array.metadata.problem.empty() && !array.line;
    };
    std::uint64_t files = 0;
    for (const Array& array : out_.arrays) {
      if (is_stored(array)) files += file_count(array.metadata);
    }
    const std::uint64_t step = std::max<std::uint64_t>(1, files / stamped_files_max);
    std::uint64_t next = 0;  // numbered from the current array
    for (Array& array : out_.arrays) {
      if (!is_stored(array)) continue;
      const std::uint64_t here = file_count(array.metadata);
      for (; next < here; next += step) {
        const std::string path = array.path + file_key(array.metadata, next);
        const auto input = files_.open(path);
        out_.identity += path + ' ' + (input ? (*input)->identity() : std::string("-")) + '\n';
        if (step == 1 && !input && input.error().kind == ErrorKind::not_found) {
          ++array.absent_files;
        }
      }
      next -= here;
      tell_absent(array, here);
    }
  }

  // Coordinates and statistics, which are read next, one after the other.
  void expect_small() {
    constexpr std::size_t bytes_max = std::size_t{1} << 20;
    const auto expect = [this](const Array& array) {
      const bool is_small = array.metadata.shape.size() <= 2 && !array.line &&
                            array.metadata.problem.empty() && !array.metadata.shard;
      if (!is_small || file_count(array.metadata) != 1) return;
      if (array.metadata.chunk_items() * array.metadata.dtype.bytes > bytes_max) return;
      files_.expect({.name = array.path + file_key(array.metadata, 0)});
    };
    for (const Array& array : out_.arrays) expect(array);
    for (const Array& array : out_.level_arrays) expect(array);
  }

  // zarr-python 3 leaves out chunks of which all values are the fill value.
  void tell_absent(const Array& array, std::uint64_t files) {
    if (out_.version == 2 || array.is_coordinate() || array.absent_files == 0) return;
    if (!std::isfinite(array.metadata.fill_value.value_or(std::nan("")))) return;
    out_.file.notes.push_back(in_quotes(array.name) + ": " + std::to_string(array.absent_files) +
                              " of " + std::to_string(files) +
                              " files are absent; their values are fill_value");
  }

  Files& files_;
  StoreContents out_;
};

}  // namespace

std::string text_in(const Json& attributes, std::string_view key) {
  const Json* found = attributes.find(key);
  if (found == nullptr || found->kind != Json::Kind::text) return {};
  return std::string(trim(found->text)).substr(0, text_max);
}

Result<StoreContents> scan_store(Files& files) { return StoreScan(files).run(); }

}  // namespace windsplat::data::zarr
