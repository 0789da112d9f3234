// Arrays and groups of a Zarr store that is written -> the text of its metadata files.
// https://zarr-specs.readthedocs.io/en/latest/v3/core/index.html
// https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

using OrderedJson = nlohmann::ordered_json;  // members in the order in which they are added

// Of a chunk. The bytes do not depend on threads.
struct Compression {
  enum class Kind : std::uint8_t { lz4, zstd, none };  // lz4 and zstd: by blosc, shuffled
  Kind kind = Kind::lz4;
  int level = 5;  // of blosc, 1 to 9
  bool operator==(const Compression&) const = default;
};

// Version 2 of the format has no shards: the chunks of one are files.
enum class StoreFormat : std::uint8_t { v2 = 2, v3 = 3 };

// Absent items are NaN, integers 0.
struct WrittenArray {
  std::string path;                // in the store: "0/cloud"
  std::vector<std::size_t> shape;  // slowest first; each length at least 1
  std::vector<std::size_t> shard;  // a multiple of the chunk; empty: chunks are files
  std::vector<std::size_t> chunk;
  Dtype dtype;  // float32, float64 or uint32
  std::vector<std::string> dimensions;
  OrderedJson attributes = OrderedJson::object();
  Compression compression;
  StoreFormat format = StoreFormat::v3;  // the same of all arrays of a store

  // The region that a ShardWriter writes: a shard, or a chunk if there are none.
  [[nodiscard]] const std::vector<std::size_t>& region() const {
    return shard.empty() ? chunk : shard;
  }
};

// Errors: invalid, naming the array: a path that a store or its reader does not take, lengths that
// do not fit together, chunks or shards beyond what the reader accepts, another type.
Result<void> check_array(const WrittenArray& array);
// Of each array, and that no two have one path.
Result<void> check_arrays(const std::vector<WrittenArray>& arrays);

// A group besides those that the paths of arrays imply, or with attributes. Path "": the root.
struct WrittenGroup {
  std::string path;
  OrderedJson attributes = OrderedJson::object();
};

// The metadata files of a store: their paths in it and their text, that of the root last. The
// root's has those of all arrays and groups besides (consolidated metadata), and so has each other
// group's in version 3, as it can be opened alone. Equal input gives equal bytes. `arrays`: at
// least one, fit for check_arrays().
std::vector<std::pair<std::string, std::string>> metadata_files(
    const std::vector<WrittenArray>& arrays, const std::vector<WrittenGroup>& groups);

// Writes and syncs these files. Errors: those of write_whole_file().
Result<void> write_metadata(const std::filesystem::path& store,
                            const std::vector<WrittenArray>& arrays,
                            const std::vector<WrittenGroup>& groups);

}  // namespace windsplat::data::zarr
