// Pictures of sizes between those of the measured settings: their forecasts, and where they may be
// used.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "protocol/view.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/table.hpp"

namespace windsplat::quality {

// How often the axes of the data are halved in sum, for pictures at each half level.
inline constexpr std::size_t half_levels_count = 9;
using Halvings = std::array<std::int8_t, half_levels_count>;

// The forecast of a setting that has neighbours; `at` has the forecasts of the list. The time
// is interpolated in logarithms. So is the error, but next to the full size, which has no error of
// being enlarged, that of the two next smaller settings is extrapolated.
Forecast forecast_between(const Setting& setting,
                          const std::function<Forecast(std::size_t setting)>& at);
Forecast forecast_between(const Setting& setting, const Forecasts& forecasts);

// Twice the setting itself, if it is in the list, or the two between which it is. nullopt: neither.
std::optional<std::array<std::size_t, 2>> neighbours_of(const Setting& setting);

// Distance of the sizes of two settings in sixteenths of a halving.
int sizes_apart(const Setting& a, const Setting& b);

// The sizes of the pictures of a view, each determined once.
class Sizes {
 public:
  // Of a setting for a view of this size.
  PictureSize at(const PictureSize& view, const Setting& setting);

 private:
  PictureSize view_{0, 0};
  std::array<std::optional<PictureSize>, sixteenths_per_half_level * half_levels_count> sizes_;
};

struct Option {
  Setting setting;
  Forecast forecast;
  PictureSize size;
};

// Those allowed for the view: the settings of the list, then the sizes between neighbours whose
// times are known and which show the same level of the data, so that time and error change evenly
// between them: none if the halvings are unknown. `always` is included.
std::vector<Option> options_of(const protocol::View& view, const Forecasts& forecasts,
                               const std::optional<Halvings>& halvings, Sizes& sizes,
                               const std::optional<Setting>& always = std::nullopt);

}  // namespace windsplat::quality
