// What a conversion writes: levels, arrays and units. Description + options -> plan; no I/O.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/convert/convert.hpp"
#include "server/data/formats/zarr/write/write_store.hpp"
#include "server/data/model/box.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::convert {

using Three = std::array<int, 3>;  // along x, y and z

inline Three plus(const Three& a, const Three& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
// Rounded up; of positive numbers.
inline int over(int a, int b) { return (a + b - 1) / b; }
inline Three over(const Three& a, const Three& b) {
  return {over(a[0], b[0]), over(a[1], b[1]), over(a[2], b[2])};
}
inline std::size_t product(const Three& a) {
  return static_cast<std::size_t>(a[0]) * static_cast<std::size_t>(a[1]) *
         static_cast<std::size_t>(a[2]);
}
// Of an index among `dims` numbers, x fastest.
inline std::size_t flat(const Three& at, const Three& dims) {
  return (static_cast<std::size_t>(at[2]) * static_cast<std::size_t>(dims[1]) +
          static_cast<std::size_t>(at[1])) *
             static_cast<std::size_t>(dims[0]) +
         static_cast<std::size_t>(at[0]);
}

struct Level {
  data::Coarsening how;  // halvings, and widths of the cells of level 0
  Three dims{1, 1, 1};
  Three brick{1, 1, 1};   // chunk of an array
  Three region{1, 1, 1};  // of a shard
  bool by_unit = true;    // a unit has whole regions; otherwise they are made when all units are
};

// How the arrays are made that one reduction of a field gives.
enum class Reduced : std::uint8_t { samples, mean, two_values, drawn, strided, mean_magnitude };
struct Product {
  Reduced as = Reduced::samples;
  std::size_t level = 0;
  std::vector<std::size_t> arrays;  // of Plan::arrays, one for each component of the reduction
};

struct PlannedField {
  std::size_t index = 0;  // in DatasetInfo::fields
  std::string name;
  int components = 1;
  std::vector<Product> products;  // by level; the first are the samples
  std::string mean;               // name of the mean magnitude; empty: of a scalar
  int strided = 0;                // levels with middles of kernels, from level 1 on
  // Of bricks of level 0 and of steps, in Plan::arrays.
  std::size_t low = 0, high = 0, masked = 0, histogram = 0, range = 0, masked_of_step = 0;
};

struct Unit {
  std::size_t field = 0;  // of Plan::fields
  std::size_t step = 0;   // of Plan::steps
  Three place{0, 0, 0};
};

inline constexpr int histogram_bins = 32;

// NOLINTNEXTLINE(bugprone-exception-escape): moving JSON checks itself in debug builds alone
struct Plan {
  Three dims{1, 1, 1};
  std::vector<std::size_t> steps;  // of the input
  std::vector<Level> levels;
  std::vector<Level> middles;  // of kernels of stride 2^n along all axes, beside level n; from 1 on
  std::vector<PlannedField> fields;
  std::vector<data::zarr::WrittenArray> arrays;  // of fields and statistics
  std::array<std::vector<double>, 3> widths;     // that weight two values and means; empty: equal
  Three unit{1, 1, 1};                           // samples of a unit
  Three units_along{1, 1, 1};
  Three pencil{1, 1, 1};  // samples of a pencil, the unit's along x
  std::vector<Unit> units;
  data::zarr::Compression compression;
  std::string compression_text;  // of the options
  data::zarr::StoreFormat format = data::zarr::StoreFormat::v3;
  std::vector<std::string> notes;

  // What equal stores have in common, by name: of a journal.
  data::zarr::OrderedJson identity;

  // That of the samples of a product.
  [[nodiscard]] const Level& level_of(const Product& made) const {
    return made.as == Reduced::strided ? middles[made.level] : levels[made.level];
  }
  [[nodiscard]] data::Box box_of(const Unit& unit) const;
  // The same box at a level.
  [[nodiscard]] data::Box box_at(const data::Box& box, const Level& level) const;
};

// Names of the dimensions of arrays: time, z, y, x.
std::vector<std::string> dimension_names(const data::DatasetInfo& info);

// Errors: invalid.
Result<Plan> make_plan(const data::DatasetInfo& info, const std::vector<data::Coarsening>& chain,
                       const Options& options);

// Bits of two numbers in turn, that of `y` first.
std::uint64_t morton(std::uint32_t y, std::uint32_t z);

// The pencils of a unit in the order in which they are converted, grouped by the boxes that are
// read: 2^across[0] pencils along y and 2^across[1] along z, of which the first is the second or
// one more.
struct Reading {
  data::Box box;
  std::vector<data::Box> pencils;
};
std::vector<Reading> readings(const Plan& plan, const data::Box& unit,
                              const std::array<int, 2>& across);

}  // namespace windsplat::convert
