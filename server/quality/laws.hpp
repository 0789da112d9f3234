// Fitted laws of the error and time of settings as functions of what a view shows; the priors of
// all forecasts.
#pragma once

#include <array>
#include <cstddef>

#include "protocol/limits.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

// Standard deviations of the logarithm of measured over expected values.
struct Scatter {
  double signature = 0;  // standard deviation between scene signatures, the same at every viewpoint
  double viewpoint = 0;  // standard deviation between viewpoints of one signature
  double noise = 0;      // standard deviation of one measurement
  double content = 0;    // added where the content of a view is unknown
};

// Quantities on which errors depend (laws.cpp), as logarithms unless they are shares or counts.
inline constexpr std::size_t features_count = 23;
using Features = std::array<double, features_count>;

// The features, then squares and products of some (laws.cpp).
inline constexpr std::size_t terms_count = features_count + 7;
using Terms = std::array<double, terms_count>;

// error = exp(base + sum of slopes times terms). The features are clamped to the range that was
// fitted, so that the law is constant beyond it. For kernels and slabs exp(base) is the factor of
// the error of tried pixels.
struct Law {
  double base = 0;
  Terms slope{};
  Features least{};
  Features most{};
  Scatter scatter;
};

struct Expected {
  double value = 0;
  Scatter scatter;
};

// The error of single precision: pictures and references have it, and no smaller error is reported.
inline constexpr double error_least = protocol::limits::max_error_min;

// Settings whose errors have the same main cause: the order of kernels, fewer pixels, merged
// samples, the thickness of slabs. `merged` also if the view itself merges samples.
enum class Cause { kernel, smaller, merged, slab };
Cause cause_of(const Setting& setting, const Viewpoint& viewpoint);

// The scatter of the errors of one cause.
const Scatter& error_scatter(const Kind& kind, Cause cause);

// The error of the tried pixels with the method of a setting at full size and of every sample;
// where the content of a view is unknown, that of a typical one.
double tried_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

// What is lost where rays end (protocol: stopTransmittance): of the tried pixels, or a typical
// error.
double stop_error(const Kind& kind, const Viewpoint& viewpoint);

Features features_of(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

// Linear RMSE, and milliseconds of rendering on the machine on which the laws were fitted.
Expected expected_error(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);
Expected expected_ms(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

}  // namespace windsplat::quality
