#include "server/data/formats/zarr/nodes.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

namespace {

class Search {
 public:
  explicit Search(Files& files) : files_(files) {}

  Result<Nodes> run() {
    out_.version = files_.exists("zarr.json") ? 3 : 2;
    if (auto done = consolidate(); !done) return done.error();
    const auto root = kind_of("");
    if (!root) return root.error();
    if (*root == Kind::array) {
      if (auto done = add(files_.location().stem, ""); !done) return done.error();
      return std::move(out_);
    }
    if (*root == Kind::none && !consolidated_) return broken_store("", "it has no metadata");
    auto attributes = attributes_of("");
    if (!attributes) return attributes.error();
    out_.attributes = std::move(*attributes);
    auto levels = level_names(out_.attributes);
    if (!levels) return levels.error();
    out_.levels = std::move(*levels);
    if (!out_.levels) out_.multiscale = multiscale_of(out_.attributes);
    auto done = out_.levels       ? search_stored_levels()
                : out_.multiscale ? search_levels()
                                  : search("", {});
    if (!done) return done.error();
    return std::move(out_);
  }

 private:
  enum class Kind { none, group, array };

  Result<Json> read(const std::string& path) {
    if (consolidated_) {
      const auto at = consolidated_->find(path);
      return at == consolidated_->end() ? Json{} : at->second;
    }
    return read_file(path);
  }

  Result<Json> read_file(const std::string& path) {
    auto input = files_.open(path);
    if (!input) return input.error();
    const std::uint64_t size = (*input)->size();
    if (size > metadata_bytes_max) {
      return broken_store(path,
                          "it has more than " + std::to_string(metadata_bytes_max) + " bytes");
    }
    std::string text(size, ' ');
    if (auto done = (*input)->read(0, text.data(), text.size()); !done) return done.error();
    out_.identity += path + ' ' + (*input)->identity() + '\n';
    auto json = parse_json(text);
    if (!json) return broken_store(path, json.error().message);
    if (json->kind != Json::Kind::object) return broken_store(path, "it is not a JSON object");
    return json;
  }

  // Metadata of the whole store in one file: .zmetadata, or within the zarr.json of the root.
  Result<void> consolidate() {
    const bool v3 = out_.version == 3;
    const std::string name = v3 ? "zarr.json" : ".zmetadata";
    if (!files_.exists(name)) return {};
    auto root = read_file(name);
    if (!root) return root.error();
    std::map<std::string, Json> found;
    const Json* holder = v3 ? root->find("consolidated_metadata") : &*root;
    const bool present = holder != nullptr && holder->kind != Json::Kind::null;
    if (present) {
      const Json* metadata = holder->find("metadata");
      if (metadata == nullptr || metadata->kind != Json::Kind::object) {
        return broken_store(name, "it has no 'metadata'");
      }
      for (const auto& [key, value] : metadata->object) {
        found.emplace(v3 ? key + "/zarr.json" : key, value);
      }
    }
    if (!present) {
      last_ = {name, std::move(*root)};
      return {};
    }
    if (v3) found.emplace(name, std::move(*root));
    consolidated_ = std::move(found);
    return {};
  }

  bool exists(const std::string& path) {
    return consolidated_ ? consolidated_->contains(path) : files_.exists(path);
  }

  Result<Json> zarr_json(const std::string& path) {
    const std::string name = path + "zarr.json";
    if (consolidated_) return read(name);
    if (last_.first != name) {
      auto json = read_file(name);
      if (!json) return json;
      last_ = {name, std::move(*json)};
    }
    return last_.second;
  }

  Result<Kind> kind_of(const std::string& path) {
    if (out_.version == 2) {
      return exists(path + ".zarray")   ? Kind::array
             : exists(path + ".zgroup") ? Kind::group
                                        : Kind::none;
    }
    if (!exists(path + "zarr.json")) return Kind::none;
    const auto json = zarr_json(path);
    if (!json) return json.error();
    const std::string place = path + "zarr.json";
    const Json* version = json->find("zarr_format");
    if (version == nullptr || !version->is_integer || version->integer != 3) {
      return broken_store(place, "'zarr_format' is not 3");
    }
    const Json* type = json->find("node_type");
    if (type != nullptr && type->text == "array") return Kind::array;
    if (type == nullptr || type->text != "group") {
      return broken_store(place, "'node_type' is neither array nor group");
    }
    const std::string extension =
        unknown_member(*json, {"zarr_format", "node_type", "attributes", "consolidated_metadata"});
    if (!extension.empty()) {
      return broken_store(place, "the extension " + in_quotes(extension) + " is not supported");
    }
    return Kind::group;
  }

  Result<Json> attributes_of(const std::string& path) {
    if (out_.version == 2) {
      return exists(path + ".zattrs") ? read(path + ".zattrs") : Result<Json>(Json{});
    }
    const auto json = zarr_json(path);
    if (!json) return json.error();
    const Json* attributes = json->find("attributes");
    return attributes == nullptr ? Json{} : *attributes;
  }

  // Names of folders below one, which is empty or ends in '/'.
  Result<std::set<std::string>> children(const std::string& path) {
    std::set<std::string> out;
    if (!consolidated_) {
      const auto names = files_.list(path.empty() ? "" : path.substr(0, path.size() - 1));
      if (!names) return names.error();
      for (const std::string& entry : *names) {
        if (entry.back() == '/') out.insert(entry.substr(0, entry.size() - 1));
      }
      return out;
    }
    for (auto at = consolidated_->lower_bound(path);
         at != consolidated_->end() && at->first.starts_with(path); ++at) {
      const std::size_t slash = at->first.find('/', path.size());
      if (slash != std::string::npos) {
        out.insert(at->first.substr(path.size(), slash - path.size()));
      }
    }
    return out;
  }

  Result<void> search(const std::string& path, const std::set<std::string>& skipped) {
    const auto names = children(path);
    if (!names) return names.error();
    for (const std::string& name : *names) {
      const std::string below = path + name + '/';
      if (skipped.contains(path + name)) continue;
      const auto kind = kind_of(below);
      if (!kind) return kind.error();
      if (*kind == Kind::group) out_.groups.push_back(name);
      if (*kind != Kind::array) continue;
      if (auto done = add(name, below); !done) return done;
    }
    return {};
  }

  // The finest level is an array, or a group of arrays.
  Result<void> search_levels() {
    const std::string& finest = out_.multiscale->finest;
    if (!is_plain_path(finest)) return broken_store(finest, "is not a valid path of a level");
    const std::string path = finest + '/';
    const auto kind = kind_of(path);
    if (!kind) return kind.error();
    if (*kind == Kind::none) return broken_store(finest, "the finest level is missing");
    if (*kind == Kind::group) return search(path, {});
    if (auto done = add(files_.location().stem, path); !done) return done;
    const auto& levels = out_.multiscale->levels;
    return search("", {levels.begin(), levels.end()});
  }

  Result<void> search_stored_levels() {
    const LevelNames& names = *out_.levels;
    const std::set<std::string> no_fields(names.widths.begin(), names.widths.end());
    if (auto done = search(names.levels[0].path + '/', no_fields); !done) return done;
    std::vector<std::string> paths;
    for (const LevelNames::Field& field : names.fields) {
      if (!field.ranges.empty()) {
        paths.push_back(range_path(field));
        paths.push_back(masked_path(field));
      }
      if (field.as == LevelNames::Field::As::nothing) continue;
      for (std::size_t n = 1; n < names.levels.size(); ++n) {
        for (const bool strided : {false, true}) {
          if (strided && static_cast<int>(n) > field.strided) continue;
          const auto more = level_paths(names, field, n, strided);
          paths.insert(paths.end(), more.begin(), more.end());
        }
      }
    }
    for (const std::string& path : names.widths) {
      if (!path.empty()) paths.push_back(path);
    }
    for (const std::string& path : paths) {
      const auto kind = kind_of(path + '/');
      if (!kind) return kind.error();
      if (*kind != Kind::array) return broken_store(path, "the array is missing");
      if (auto done = add(path, path + '/', out_.level_arrays); !done) return done;
    }
    return {};
  }

  Result<void> add(const std::string& name, const std::string& path) {
    if (!is_plain_name(name)) return broken_store(name, "is not a valid array name");
    return add(name, path, out_.arrays);
  }

  Result<void> add(const std::string& name, const std::string& path, std::vector<Node>& to) {
    if (out_.arrays.size() + out_.level_arrays.size() >= arrays_max) {
      return make_error(ErrorKind::bad_data,
                        "it has more than " + std::to_string(arrays_max) + " arrays");
    }
    auto metadata = out_.version == 2 ? read(path + ".zarray") : zarr_json(path);
    if (!metadata) return metadata.error();
    auto attributes = attributes_of(path);
    if (!attributes) return attributes.error();
    to.push_back({path, name, std::move(*metadata), std::move(*attributes)});
    return {};
  }

  Files& files_;
  Nodes out_;
  std::pair<std::string, Json> last_;  // the zarr.json read last, unless consolidated
  std::optional<std::map<std::string, Json>> consolidated_;  // by path
};

}  // namespace

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

bool is_plain_path(std::string_view path) {
  for (;;) {
    const std::size_t slash = path.find('/');
    if (!is_plain_name(path.substr(0, slash))) return false;
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
}

Result<Nodes> find_nodes(Files& files) { return Search(files).run(); }

}  // namespace windsplat::data::zarr
