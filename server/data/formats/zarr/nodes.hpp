// The arrays of a store and their metadata, of either version, consolidated or not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/json.hpp"
#include "server/data/formats/zarr/levels/names.hpp"
#include "server/data/formats/zarr/multiscale.hpp"

namespace windsplat::data::zarr {

struct Node {
  std::string path;  // below the store, empty or ending in '/'
  std::string name;
  Json metadata;  // .zarray or zarr.json
  Json attributes;
};

struct Nodes {
  int version = 2;
  std::vector<Node> arrays;         // of the root or of the finest level
  std::vector<std::string> groups;  // not searched
  Json attributes;                  // of the root
  std::optional<Multiscale> multiscale;
  std::optional<LevelNames> levels;  // in place of multiscale
  std::vector<Node> level_arrays;    // of all that `levels` names beside level 0
  std::string identity;              // of the files read
};

// Of a metadata file, and of a store, whatever its version.
inline constexpr std::uint64_t metadata_bytes_max = std::uint64_t{8} << 20;
inline constexpr std::size_t arrays_max = 8192;

// Errors: bad_data.
Result<Nodes> find_nodes(Files& files);

Error broken_store(const std::string& place, const std::string& what);

// Whether a name of a store may be the name of a file.
bool is_plain_name(std::string_view name);
// The same of names with '/' between them.
bool is_plain_path(std::string_view path);

}  // namespace windsplat::data::zarr
