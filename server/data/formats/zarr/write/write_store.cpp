#include "server/data/formats/zarr/write/write_store.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string_view>
#include <system_error>

#include "server/base/check.hpp"
#include "server/base/disk_error.hpp"
#include "server/base/whole_file.hpp"
#include "server/data/bytes/decode_limits.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t written_dimensions_max = 8;
constexpr std::size_t written_shard_chunks_max = std::size_t{1} << 20;

using WrittenNodes = std::map<std::string, OrderedJson>;  // by path
using Texts = std::vector<std::pair<std::string, std::string>>;

std::string text_of(const OrderedJson& json) {
  // Attributes come from files, which may have any bytes.
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + '\n';
}

std::string joined(const std::string& folder, const std::string& name) {
  return folder.empty() ? name : folder + '/' + name;
}

std::string parent_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "" : path.substr(0, slash);
}

const char* blosc_name(const Compression& how) {
  return how.kind == Compression::Kind::zstd ? "zstd" : "lz4";
}

OrderedJson fill_value_of(const WrittenArray& array) {
  if (array.dtype.kind == 'f') return "NaN";
  return array.format == StoreFormat::v2 ? OrderedJson() : OrderedJson(0);
}

OrderedJson codec(const char* name, OrderedJson configuration) {
  return {{"name", name}, {"configuration", std::move(configuration)}};
}

OrderedJson codecs_v3(const WrittenArray& array) {
  const OrderedJson bytes = codec("bytes", {{"endian", "little"}});
  const OrderedJson checksum = {{"name", "crc32c"}};
  OrderedJson chunk = OrderedJson::array({bytes});
  if (array.compression.kind != Compression::Kind::none) {
    chunk.push_back(codec("blosc", {{"typesize", array.dtype.bytes},
                                    {"cname", blosc_name(array.compression)},
                                    {"clevel", array.compression.level},
                                    {"shuffle", "shuffle"},
                                    {"blocksize", 0}}));
  }
  chunk.push_back(checksum);
  if (array.shard.empty()) return chunk;
  return OrderedJson::array(
      {codec("sharding_indexed", {{"chunk_shape", array.chunk},
                                  {"codecs", std::move(chunk)},
                                  {"index_codecs", OrderedJson::array({bytes, checksum})},
                                  {"index_location", "end"}})});
}

OrderedJson array_v3(const WrittenArray& array) {
  const char* const type = array.dtype.kind == 'u'  ? "uint32"
                           : array.dtype.bytes == 4 ? "float32"
                                                    : "float64";
  return {
      {"zarr_format", 3},
      {"node_type", "array"},
      {"shape", array.shape},
      {"data_type", type},
      {"chunk_grid", {{"name", "regular"}, {"configuration", {{"chunk_shape", array.region()}}}}},
      {"chunk_key_encoding", {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
      {"fill_value", fill_value_of(array)},
      {"codecs", codecs_v3(array)},
      {"attributes", array.attributes},
      {"dimension_names", array.dimensions}};
}

OrderedJson array_v2(const WrittenArray& array) {
  OrderedJson compressor;
  if (array.compression.kind != Compression::Kind::none) {
    compressor = {{"id", "blosc"},
                  {"cname", blosc_name(array.compression)},
                  {"clevel", array.compression.level},
                  {"shuffle", 1},
                  {"blocksize", 0}};
  }
  return {{"zarr_format", 2},
          {"shape", array.shape},
          {"chunks", array.chunk},
          {"dtype", std::string("<") + array.dtype.kind + std::to_string(array.dtype.bytes)},
          {"compressor", std::move(compressor)},
          {"fill_value", fill_value_of(array)},
          {"order", "C"},
          {"filters", OrderedJson()},
          {"dimension_separator", "."}};
}

// The attributes of every group: those that paths imply have none.
WrittenNodes groups_of(const std::vector<WrittenArray>& arrays,
                       const std::vector<WrittenGroup>& groups) {
  WrittenNodes out;
  const auto add_parents = [&](std::string path) {
    while (!path.empty()) out.emplace(path = parent_of(path), OrderedJson::object());
  };
  for (const WrittenGroup& group : groups) {
    out[group.path] = group.attributes;
    add_parents(group.path);
  }
  for (const WrittenArray& array : arrays) add_parents(array.path);
  return out;
}

OrderedJson group_v3(const std::string& path, const OrderedJson& attributes,
                     const WrittenNodes& nodes) {
  OrderedJson below = OrderedJson::object();
  const std::size_t skipped = path.empty() ? 0 : path.size() + 1;
  for (const auto& [place, node] : nodes) {
    if (path.empty() || place.starts_with(path + '/')) below[place.substr(skipped)] = node;
  }
  return {{"zarr_format", 3},
          {"node_type", "group"},
          {"attributes", attributes},
          {"consolidated_metadata",
           {{"kind", "inline"}, {"must_understand", false}, {"metadata", std::move(below)}}}};
}

Texts files_v3(const std::vector<WrittenArray>& arrays, const WrittenNodes& groups) {
  WrittenNodes nodes;
  for (const WrittenArray& array : arrays) nodes[array.path] = array_v3(array);
  for (const auto& [path, attributes] : groups) {
    if (path.empty()) continue;
    nodes[path] = {{"zarr_format", 3}, {"node_type", "group"}, {"attributes", attributes}};
  }
  Texts out;
  for (const auto& [path, node] : nodes) {
    const auto group = groups.find(path);
    const bool is_group = group != groups.end();
    out.emplace_back(joined(path, "zarr.json"),
                     text_of(is_group ? group_v3(path, group->second, nodes) : node));
  }
  out.emplace_back("zarr.json", text_of(group_v3("", groups.at(""), nodes)));
  return out;
}

Texts files_v2(const std::vector<WrittenArray>& arrays, const WrittenNodes& groups) {
  WrittenNodes files;
  for (const auto& [path, attributes] : groups) {
    files[joined(path, ".zgroup")] = {{"zarr_format", 2}};
    files[joined(path, ".zattrs")] = attributes;
  }
  for (const WrittenArray& array : arrays) {
    files[joined(array.path, ".zarray")] = array_v2(array);
    OrderedJson& attributes = files[joined(array.path, ".zattrs")];
    attributes = array.attributes;
    attributes["_ARRAY_DIMENSIONS"] = array.dimensions;
  }
  Texts out;
  OrderedJson all = OrderedJson::object();
  for (const auto& [path, json] : files) {
    if (parent_of(path).empty()) continue;
    out.emplace_back(path, text_of(json));
  }
  for (const auto& [path, json] : files) {
    if (parent_of(path).empty()) out.emplace_back(path, text_of(json));
    all[path] = json;
  }
  out.emplace_back(".zmetadata",
                   text_of({{"metadata", std::move(all)}, {"zarr_consolidated_format", 1}}));
  return out;
}

// Whether the path is made of names that both versions take and no metadata file has.
bool is_path_of_array(std::string_view path) {
  for (;;) {
    const std::size_t slash = path.find('/');
    const std::string_view name = path.substr(0, slash);
    if (name.empty() || name.size() > 255 || name.front() == '.' || name.starts_with("__") ||
        name == "zarr.json" || name.find('\0') != std::string_view::npos) {
      return false;
    }
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
}

// The product of lengths; one more than `most` where it exceeds that.
std::size_t product(const std::vector<std::size_t>& lengths, std::size_t most) {
  std::size_t out = 1;
  for (const std::size_t length : lengths) out = length > most / out ? most + 1 : out * length;
  return out;
}

std::string fault_of(const WrittenArray& array) {
  const std::size_t rank = array.shape.size();
  if (!is_path_of_array(array.path)) return "its path is not of names that a Zarr store takes";
  const auto is_type = [&](const Dtype& type) { return array.dtype == type; };
  if (!is_type({'f', 4}) && !is_type({'f', 8}) && !is_type({'u', 4})) {
    return "only float32, float64 and uint32 are written";
  }
  const bool same_rank = array.chunk.size() == rank && array.dimensions.size() == rank &&
                         array.region().size() == rank;
  if (rank < 1 || rank > written_dimensions_max || !same_rank) {
    return "shape, chunk, shard and dimensions have to be of one rank from 1 to " +
           std::to_string(written_dimensions_max);
  }
  for (const auto* lengths : {&array.shape, &array.chunk, &array.region()}) {
    if (std::find(lengths->begin(), lengths->end(), 0U) != lengths->end()) return "a length is 0";
  }
  const std::size_t items_max = chunk_bytes_max / array.dtype.bytes;
  if (product(array.chunk, items_max) > items_max) {
    return "a chunk has more than " + std::to_string(chunk_bytes_max >> 20) + " MiB";
  }
  std::vector<std::size_t> chunks;
  for (std::size_t d = 0; d < rank; ++d) {
    if (array.region()[d] % array.chunk[d] != 0) return "a shard is not of whole chunks";
    chunks.push_back(array.region()[d] / array.chunk[d]);
  }
  if (product(chunks, written_shard_chunks_max) > written_shard_chunks_max) {
    return "a shard has more than " + std::to_string(written_shard_chunks_max) + " chunks";
  }
  return array.compression.level < 1 || array.compression.level > 9
             ? "the level of compression is not 1 to 9"
             : "";
}

}  // namespace

Result<void> check_array(const WrittenArray& array) {
  const std::string fault = fault_of(array);
  if (fault.empty()) return {};
  return make_error(ErrorKind::invalid,
                    "the array " + in_quotes(array.path) + " cannot be written: " + fault);
}

Result<void> check_arrays(const std::vector<WrittenArray>& arrays) {
  std::set<std::string_view> paths;
  for (const WrittenArray& array : arrays) {
    if (auto fine = check_array(array); !fine) return fine;
    if (!paths.insert(array.path).second) {
      return make_error(ErrorKind::invalid,
                        "two arrays cannot be written as " + in_quotes(array.path));
    }
  }
  return {};
}

Texts metadata_files(const std::vector<WrittenArray>& arrays,
                     const std::vector<WrittenGroup>& groups) {
  WINDSPLAT_CHECK(!arrays.empty());
  const StoreFormat format = arrays.front().format;
  for (const WrittenArray& array : arrays) WINDSPLAT_CHECK(array.format == format);
  const WrittenNodes all_groups = groups_of(arrays, groups);
  return format == StoreFormat::v2 ? files_v2(arrays, all_groups) : files_v3(arrays, all_groups);
}

Result<void> write_metadata(const std::filesystem::path& store,
                            const std::vector<WrittenArray>& arrays,
                            const std::vector<WrittenGroup>& groups) {
  for (const auto& [path, text] : metadata_files(arrays, groups)) {
    const std::filesystem::path file = store / path;
    std::error_code fault;
    std::filesystem::create_directories(file.parent_path(), fault);
    if (fault) {
      return disk_error(fault.value(), "cannot create " + in_quotes(file.parent_path().native()));
    }
    if (auto done = write_whole_file(file, text, Sync::now); !done) return done;
  }
  return {};
}

}  // namespace windsplat::data::zarr
