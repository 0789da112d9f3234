// Appearance of lines and colours -> the numbers of the kernels.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "server/engine/kernels/frame_data.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

inline float bounded(double v) {
  constexpr double largest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(v, -largest, largest));
}

// 1 / (high - low) for clamp((v - low) * scale); a step where both are equal.
inline float ramp_scale(double low, double high) {
  constexpr double steepest = 1e30;
  return high > low ? bounded(std::min(1.0 / (high - low), steepest)) : bounded(steepest);
}

void to_floats(const std::vector<double>& from, std::vector<float>& to);

// Converts to the layout of kernels::ColorTable.
void flatten(const scene::ColorTable& table, std::vector<float>& rgb);

// The table over `scale` times its range, and less `origin`.
kernels::ColorTable make_table(const scene::ColorTable& table, const std::vector<float>& rgb,
                               double scale = 1, double origin = 0);

// Factors from components of the field to directions, of which only the ratios matter. `rate_x` and
// `rate_z` are their storage.
void set_rates(const scene::VectorLayer& from, std::vector<float>& rate_x,
               std::vector<float>& rate_z, kernels::LineStyle& to);

// Sets magnitudes, jitter, kernel box and appearance of lines. The depth cue is measured from the
// camera's depth origin.
void style_lines(const scene::Scene& scene, const scene::VectorLayer& from, double depth_origin,
                 kernels::LineStyle& to);

// Colour by rise looks up a position from 0 to 1: w (rise - low) / (high - low) + (1 - w) (z - z0)
// / (z1 - z0). Replaces the range of to.color.
void color_by_rise(const scene::Scene& scene, const scene::VectorLayer& from,
                   kernels::LineStyle& to);

}  // namespace windsplat::engine
