#include "server/data/formats/zarr/scan.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/formats/zarr/chunks.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::uint64_t json_bytes_max = std::uint64_t{8} << 20;
constexpr std::size_t arrays_max = 8192;
constexpr std::size_t text_max = 4096;
constexpr const char* group_reason = "group: to see it, open its folder";
constexpr std::uint64_t stamped_chunks_max = 4096;

Error broken_store(const std::string& place, const std::string& what) {
  std::string message = in_quotes(place);
  message += ": ";
  message += what;
  return make_error(ErrorKind::bad_data, std::move(message));
}

bool is_plain_name(std::string_view name) {
  return !name.empty() && name != "." && name != ".." && name.size() <= 255 &&
         name.find('/') == std::string_view::npos && name.find('\0') == std::string_view::npos;
}

std::string type_name(const Dtype& type) {
  const char* const base = type.kind == 'f' ? "float" : type.kind == 'i' ? "int" : "uint";
  // Half floats are converted to float32 on reading.
  const std::size_t bytes = type.kind == 'f' ? std::max<std::size_t>(4, type.bytes) : type.bytes;
  return base + std::to_string(bytes * 8);
}

// Without names, arrays share dimensions of equal length at equal positions.
void name_dimensions(Array& array) {
  const auto& shape = array.metadata.shape;
  const Json* names = array.attributes.find("_ARRAY_DIMENSIONS");
  if (names != nullptr) {
    for (const Json& entry : names->list) {
      if (entry.kind == Json::Kind::text && is_plain_name(entry.text)) {
        array.dimensions.push_back(entry.text);
      }
    }
    const std::set<std::string> distinct(array.dimensions.begin(), array.dimensions.end());
    array.named_dimensions = names->list.size() == shape.size() && distinct.size() == shape.size();
    if (array.named_dimensions) return;
    array.metadata.problem = "its _ARRAY_DIMENSIONS are not names, one for each dimension";
  }
  array.dimensions.clear();
  for (std::size_t d = 0; d < shape.size(); ++d) {
    array.dimensions.push_back("dim" + std::to_string(shape.size() - d) + "_" +
                               std::to_string(shape[d]));
  }
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
    if (auto fine = check_any_field(out_); !fine) return fine.error();
    identify();
    return std::move(out_);
  }

 private:
  Result<Json> read_json(const std::string& path) {
    auto input = files_.open(path);
    if (!input) return input.error();
    const std::uint64_t size = (*input)->size();
    if (size > json_bytes_max) {
      return broken_store(path, "it has more than " + std::to_string(json_bytes_max) + " bytes");
    }
    std::string text(size, ' ');
    if (auto done = (*input)->read(0, text.data(), text.size()); !done) return done.error();
    out_.identity += path + ' ' + (*input)->identity() + '\n';
    auto json = parse_json(text);
    if (!json) return broken_store(path, json.error().message);
    if (json->kind != Json::Kind::object) return broken_store(path, "it is not a JSON object");
    return json;
  }

  Result<Json> read_attributes(const std::string& path) {
    return files_.exists(path + ".zattrs") ? read_json(path + ".zattrs") : Result<Json>(Json{});
  }

  Result<void> find_arrays() {
    out_.identity = out_.name + '\n';
    if (files_.exists(".zmetadata")) return find_consolidated();
    if (files_.exists(".zarray")) {
      const auto json = read_json(".zarray");
      if (!json) return json.error();
      auto attributes = read_attributes("");
      if (!attributes) return attributes.error();
      return add_array(files_.location().stem, "", *json, std::move(*attributes));
    }
    if (!files_.exists(".zgroup")) {
      return make_error(ErrorKind::bad_data,
                        "is a Zarr store of version 3; only version 2 is supported");
    }
    return find_below_root();
  }

  Result<void> find_consolidated() {
    const auto json = read_json(".zmetadata");
    if (!json) return json.error();
    const Json* metadata = json->find("metadata");
    if (metadata == nullptr || metadata->kind != Json::Kind::object) {
      return broken_store(".zmetadata", "it has no 'metadata'");
    }
    std::set<std::string> groups;
    for (const auto& [key, value] : metadata->object) {
      const std::size_t slash = key.find('/');
      if (slash == std::string::npos) {
        if (key == ".zattrs") attributes_ = value;
        continue;
      }
      const std::string name = key.substr(0, slash);
      const std::string rest = key.substr(slash + 1);
      if (rest == ".zarray") {
        const Json* attributes = metadata->find(name + "/.zattrs");
        auto added =
            add_array(name, name + "/", value, attributes == nullptr ? Json{} : *attributes);
        if (!added) return added;
      } else if (rest != ".zattrs") {
        groups.insert(name);
      }
    }
    for (const std::string& name : groups) out_.file.left_out.push_back({name, group_reason});
    return {};
  }

  Result<void> find_below_root() {
    auto attributes = read_attributes("");
    if (!attributes) return attributes.error();
    attributes_ = std::move(*attributes);
    const auto names = files_.list("");
    if (!names) return names.error();
    for (const std::string& entry : *names) {
      if (entry.back() != '/') continue;
      if (files_.exists(entry + ".zarray")) {
        const auto json = read_json(entry + ".zarray");
        if (!json) return json.error();
        auto own = read_attributes(entry);
        if (!own) return own.error();
        auto added = add_array(entry.substr(0, entry.size() - 1), entry, *json, std::move(*own));
        if (!added) return added;
      } else if (files_.exists(entry + ".zgroup")) {
        out_.file.left_out.push_back({entry.substr(0, entry.size() - 1), group_reason});
      }
    }
    return {};
  }

  Result<void> add_array(const std::string& name, const std::string& path, const Json& json,
                         Json attributes) {
    if (!is_plain_name(name)) return broken_store(name, "is not a valid array name");
    if (out_.arrays.size() >= arrays_max) {
      return make_error(ErrorKind::bad_data,
                        "it has more than " + std::to_string(arrays_max) + " arrays");
    }
    auto metadata = parse_array(json);
    if (!metadata) return broken_store(name, metadata.error().message);
    Array array;
    array.path = path;
    array.name = name;
    array.attributes = std::move(attributes);
    array.metadata = std::move(*metadata);
    if (array.metadata.problem.empty() && !path.empty() && !files_.exists(path)) {
      array.metadata.problem = "its folder is missing in the store";
    }
    name_dimensions(array);
    out_.arrays.push_back(std::move(array));
    return {};
  }

  // Coordinates first: their lengths have precedence over those of other arrays.
  void describe_all() {
    out_.file.title = text_in(attributes_, "title");
    std::stable_partition(out_.arrays.begin(), out_.arrays.end(),
                          std::mem_fn(&Array::is_coordinate));
    for (const Array& array : out_.arrays) describe(array);
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
        out_.file.dimensions.push_back({name, length, false});
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
    if (!array.is_coordinate() && array.metadata.problem.empty() && array.is_fill_a_number()) {
      out_.file.notes.push_back(in_quotes(array.name) +
                                " has fill_value 0 and no dimension names: zeros are shown as "
                                "values, even in absent chunks");
    }
  }

  void identify() {
    std::uint64_t chunks = 0;
    for (const Array& array : out_.arrays) {
      if (array.metadata.problem.empty()) chunks += chunk_count(array.metadata);
    }
    const std::uint64_t step = std::max<std::uint64_t>(1, chunks / stamped_chunks_max);
    std::uint64_t next = 0;  // numbered from the current array
    for (const Array& array : out_.arrays) {
      if (!array.metadata.problem.empty()) continue;
      const std::uint64_t here = chunk_count(array.metadata);
      for (; next < here; next += step) {
        const std::string path = array.path + chunk_key(array.metadata, next);
        const auto input = files_.open(path);
        out_.identity += path + ' ' + (input ? (*input)->identity() : std::string("-")) + '\n';
      }
      next -= here;
    }
  }

  Files& files_;
  StoreContents out_;
  Json attributes_;
};

}  // namespace

std::string text_in(const Json& attributes, std::string_view key) {
  const Json* found = attributes.find(key);
  if (found == nullptr || found->kind != Json::Kind::text) return {};
  return std::string(trim(found->text)).substr(0, text_max);
}

Result<StoreContents> scan_store(Files& files) { return StoreScan(files).run(); }

}  // namespace windsplat::data::zarr
