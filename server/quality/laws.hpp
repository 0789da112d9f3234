// Fitted laws of the error and time of settings as functions of scene and viewpoint; the priors of
// all forecasts.
#pragma once

#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

// Standard deviations of the logarithm of measured over expected values.
struct Scatter {
  double signature = 0;  // standard deviation between scene signatures, the same at every viewpoint
  double viewpoint = 0;  // standard deviation between viewpoints of one signature
  double noise = 0;      // standard deviation of one measurement
};

struct Expected {
  double value = 0;
  Scatter scatter;
};

// Resolution of measured errors: pictures and references are of single precision. Smaller errors
// are reported as this value.
inline constexpr double error_least = 1e-5;

// Whether the setting draws the view at its own size and level, but that level already merges
// samples.
bool is_merged(const Setting& setting, const Viewpoint& viewpoint);

// Linear RMSE, and milliseconds of rendering on the machine on which the laws were fitted.
Expected expected_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);
Expected expected_ms(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

}  // namespace windsplat::quality
