// Coarser levels and statistics that a source has stored of its fields beside their samples, and
// the parts of them that are read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

// What a level holds of a field. samples: level 0. two_values: of a scalar. drawn: of a vector,
// with stride 1. strided: of a vector, at level n the middle sample of each kernel of stride 2^n
// (strided_sample()), whatever the halvings of the level.
enum class StoredAs : std::uint8_t { samples, two_values, drawn, strided };

// A box of what is stored of a field at a step, in samples of the level.
struct StoredPart {
  Box box;
  std::size_t level = 0;
  StoredAs as = StoredAs::samples;
  bool operator==(const StoredPart&) const = default;
};

inline constexpr int stored_halvings_max = 7;         // of an axis
inline constexpr std::size_t stored_levels_max = 22;  // three axes, halved one by one
inline constexpr int strided_levels_max = 4;

// Of the samples of a field at a step, as in Volume.
struct StoredRange {
  std::array<float, 2> range{0, 0};
  std::int64_t masked = 0;
};

struct StoredField {
  // Whether every level from 1 on is stored: two values of a scalar, draws of a vector.
  bool has_levels = false;
  int strided = 0;                  // middles of kernels, at levels 1 to this
  std::vector<StoredRange> ranges;  // by step; empty: not stored
};

struct StoredLevels {
  // Halvings of the axes by level, none less than at the level before; the first has none.
  std::vector<std::array<int, 3>> levels;
  std::array<std::vector<double>, 3> widths;  // of cells, weights of two values; empty: even
  // Of the files of each level, at all steps, as the store claims them; empty: not known.
  std::vector<std::uint64_t> bytes;
  std::vector<StoredField> fields;  // of the first fields of the dataset, the others have none
};

// What makes a description of stored levels wrong for the dataset; empty: nothing. Everything that
// the rest of the program relies on.
std::string fault_of(const StoredLevels& stored, const DatasetInfo& info);

// The samples of the field that are stored as that at a level, along each axis; nullopt: nothing
// is.
std::optional<std::array<int, 3>> stored_dims(const DatasetInfo& info, std::size_t field,
                                              std::size_t level, StoredAs as);
// Whether the field is read by boxes (level 0) or its level is stored as that, and has the box.
bool is_stored(const DatasetInfo& info, std::size_t field, const StoredPart& part);
// The number of the level with these halvings; nullopt: there is none.
std::optional<std::size_t> level_of(const DatasetInfo& info, const std::array<int, 3>& halvings);
// The bricks that a part has samples of: chunks of the store, counted once for all components. Zero
// of a dataset without stored levels, and of a field that is not read by boxes.
std::uint64_t bricks_of(const DatasetInfo& info, std::size_t field, const StoredPart& part);
// Components of the volume of a part.
int components_of(const FieldInfo& field, StoredAs as);

// The level that coarsen() would give; nullopt: it is not stored. `widths` of `how` count by their
// ratios.
std::optional<StoredPart> stored_level(const DatasetInfo& info, std::size_t field,
                                       const Coarsening& how);
// The middles of the kernels of that stride, from which draw() makes any level; nullopt: they are
// not stored.
std::optional<StoredPart> stored_middles(const DatasetInfo& info, std::size_t field, int stride);

// The range of a field at a step, as measured when the volume is read; null: not stored.
const StoredRange* stored_range(const DatasetInfo& info, std::size_t field, std::size_t step);

// Sets range and masked count of a part that was read; the range of two values is that of the
// field. False: numbers that are not masked as they should be, or shares beyond 0 to 1.
[[nodiscard]] bool measure_part(const DatasetInfo& info, std::size_t field, std::size_t step,
                                StoredAs as, Volume& volume);

}  // namespace windsplat::data
