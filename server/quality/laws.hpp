// How errors and times of settings go with what a view shows and where it is seen from: the laws
// behind priors and forecasts.
#pragma once

#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

// Standard deviations of the logarithm of what is measured over what is expected.
struct Scatter {
  double signature = 0;  // between scene signatures, the same at every viewpoint
  double viewpoint = 0;  // between viewpoints of one signature
  double noise = 0;      // of one measurement
};

struct Expected {
  double value = 0;
  Scatter scatter;
};

// Below it neither a picture's error nor its truth is known, for both are of single precision: what
// is less is told as this.
inline constexpr double error_least = 1e-5;

// Whether the setting's picture is of the view's own size and data, but the view itself averages.
bool is_averaged(const Setting& setting, const Viewpoint& viewpoint);

// Linear RMSE, and milliseconds of drawing on the machine that the laws were fitted on.
Expected expected_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);
Expected expected_ms(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

}  // namespace windsplat::quality
