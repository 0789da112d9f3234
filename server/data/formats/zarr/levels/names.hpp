// The attribute `windsplat` of a store's root: coarser levels, and statistics beside them
// (docs/design/bricks.md, "The store"). Json -> names of arrays.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/json.hpp"

namespace windsplat::data::zarr {

// All paths are plain, from the root of the store, and without a final '/'.
struct LevelNames {
  struct Level {
    std::string path;  // of a group
    std::array<int, 3> halvings{};
    std::optional<std::uint64_t> bytes;  // of its files
  };
  struct Field {
    enum class As { nothing, two_values, drawn };
    std::vector<std::string> components;
    As as = As::nothing;
    int strided = 0;     // levels with middles of kernels, from level 1 on
    std::string ranges;  // path of the arrays NAME_range and NAME_masked without their ends
  };
  std::string contents;  // changes with the files of the store; empty: not given
  std::vector<Level> levels;
  std::vector<Field> fields;
  std::array<std::string, 3> widths;  // paths of arrays; empty: even
};

// nullopt: there is no such attribute. Errors: bad_data, which says what of the attribute is wrong.
Result<std::optional<LevelNames>> level_names(const Json& attributes);

// Paths of the arrays of a field at a level from 1 on: of each component of the volume.
std::vector<std::string> level_paths(const LevelNames& names, const LevelNames::Field& field,
                                     std::size_t level, bool strided);
std::string range_path(const LevelNames::Field& field);
std::string masked_path(const LevelNames::Field& field);

}  // namespace windsplat::data::zarr
