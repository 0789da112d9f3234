// Questions about loaded fields: how values are distributed, what is at a place, between which
// values they lie. A volume and its grid in, plain numbers out.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

// A field's value is a scalar's own, or a vector's magnitude.

struct HistogramRequest {
  int bins = 64;  // at least 1
  std::optional<std::array<double, 2>> range = std::nullopt;
  // Without a range: it leaves out at most this share of the values at either end, below 0.5.
  double clip = 0;
  bool logarithmic = false;  // bins of equal ratio, for positive values only
};

struct Histogram {
  std::optional<std::array<double, 2>> range;  // none where no value is left to take it from
  std::vector<double> edges;                   // one more than bins; empty without a range
  // Bin i holds edges[i] <= value < edges[i + 1], the last one its upper edge too. All zero where
  // there is no range. One value wide: everything is in the first bin.
  std::vector<std::int64_t> counts;
  std::int64_t below = 0;
  std::int64_t above = 0;
  std::int64_t masked = 0;  // with below, above and the counts: every sample
};

// Memory beyond the answer's: under 2 MiB. Errors: invalid (a range that is empty, or one of
// logarithmic bins that does not begin above zero), cancelled.
Result<Histogram> histogram(const Volume& volume, const HistogramRequest& request,
                            const CancelToken& cancel);

// Which sample a place is nearest to.
struct Place {
  std::array<int, 3> index{};
  std::array<double, 3> coordinates{};  // of the sample, as the axes or columns say
};

// `at` is in the axes' own units, of a grid with columns longitude and latitude in degrees. A
// coordinate may be absent where the grid has one sample, and then it does not matter. Nearest by
// the coordinates' difference, longitudes modulo 360, columns by great-circle distance. Errors:
// invalid for what is absent, or more than half a cell beyond the first or last sample, with the
// box.
Result<Place> nearest_sample(const Grid& grid, const std::array<std::optional<double>, 3>& at);

// The components there; none where the sample is masked.
std::optional<std::vector<double>> value_at(const Volume& volume, const std::array<int, 3>& index);

// Least and greatest value and masked samples of as many steps as were added.
struct FieldRange {
  std::optional<std::array<double, 2>> range;  // none while every sample is masked
  std::int64_t masked = 0;

  void add(const Volume& volume);
};

}  // namespace windsplat::data
