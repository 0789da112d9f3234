// Queries of loaded fields: distribution of values, values at a position, range. A volume and its
// grid in, plain numbers out.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

// The value of a field is its scalar, or the magnitude of its vector.

struct HistogramRequest {
  int bins = 64;  // at least 1
  std::optional<std::array<double, 2>> range = std::nullopt;
  // If no range is given: at most this fraction of the values is excluded at either end; below 0.5.
  double clip = 0;
  bool logarithmic = false;  // bins of equal ratio, for positive values only
};

struct Histogram {
  std::optional<std::array<double, 2>> range;  // nullopt if there are no values
  std::vector<double> edges;                   // one more than bins; empty without a range
  // Bin i contains edges[i] <= value < edges[i + 1]; the last one includes its upper edge. All zero
  // without a range. If the range has zero width, all values are in the first bin.
  std::vector<std::int64_t> counts;
  std::int64_t below = 0;
  std::int64_t above = 0;
  std::int64_t masked = 0;  // below + above + masked + counts = number of samples
};

// Uses less than 2 MiB of memory besides the result. Errors: invalid (an empty range, or
// logarithmic bins whose range does not begin above zero), cancelled.
Result<Histogram> histogram(const Volume& volume, const HistogramRequest& request,
                            const CancelToken& cancel);

// The sample nearest to a position.
struct Place {
  std::array<int, 3> index{};
  std::array<double, 3> coordinates{};  // coordinates of the sample, from the axes or columns
};

// The heights of a lattice that follows the terrain: a scalar of the same samples.
struct SampleHeights {
  std::shared_ptr<const Volume> values;
  std::string units;
};

// `at` is in the units of the axes; for a grid with columns, longitude and latitude in degrees. A
// coordinate may be absent if the grid has one sample along it; it is then ignored. Nearest by
// coordinate difference (longitudes modulo 360), for columns by great-circle distance. Errors:
// invalid if a coordinate is missing, or more than half a cell beyond the first or last sample; the
// message contains the box. heights: replace the vertical axis, in its own units, by the heights in
// the nearest column; invalid if one of them is masked. Null: the axis counts.
Result<Place> nearest_sample(const Grid& grid, const std::array<std::optional<double>, 3>& at,
                             const SampleHeights* heights = nullptr);

// The components at a sample; empty if it is masked.
std::optional<std::vector<double>> value_at(const Volume& volume, const std::array<int, 3>& index);

// Least and greatest value and number of masked samples of all volumes added.
struct FieldRange {
  std::optional<std::array<double, 2>> range;  // nullopt while all samples are masked
  std::int64_t masked = 0;

  void add(const Volume& volume);
  // What a source has stored of a volume of so many samples.
  void add(const StoredRange& stored, std::size_t samples);
};

// The samples with the least and the greatest value, the first of equal ones in the order of the
// samples; empty if all are masked.
struct Extremes {
  std::array<int, 3> least{};
  std::array<int, 3> greatest{};
};
std::optional<Extremes> extremes(const Volume& volume);

}  // namespace windsplat::data
