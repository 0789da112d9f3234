// Appearance of lines and colours -> the numbers of the kernels.
#include "server/engine/layers/line_style.hpp"

#include <cmath>
#include <cstddef>

#include "server/base/check.hpp"
#include "server/scene/lines/reach.hpp"

namespace windsplat::engine {

namespace {

using scene::Scene;

// 2^-e for a value of the order of 2^e outside this range, otherwise 1.
double toward_one(double value, double low, double high) {
  const bool moderate = !(value > 0) || (value >= low && value <= high);
  return moderate ? 1 : std::exp2(-std::ilogb(value));
}

double magnitude_scale(const scene::VectorLayer& from) {
  return trace::Segments::scale_of(from.magnitude_range[1]);
}

void set_detail(const scene::VectorLayer& from, kernels::LineStyle& to) {
  to.merged = from.halvings == std::array{0, 0, 0} ? 0 : 1;
  to.data_stride = from.data_stride;
  to.inverse_data_stride = 1.0F / static_cast<float>(from.data_stride);
  for (std::size_t a = 0; a < 3; ++a) {
    const int halvings = from.halvings[a];
    to.halvings[a] = halvings;
    to.data_dims[a] = from.data_dims[a];
    WINDSPLAT_CHECK(halvings >= 0 && halvings <= 15);  // products of indices fit in 32 bits
    to.drawn_places[a] = from.drawn_places[a];
    const bool uneven = !from.group_box[a].empty();
    to.group_place[a] = uneven ? from.group_place[a].data() : nullptr;
    to.group_box[a] = uneven ? from.group_box[a].data() : nullptr;
    const double box = to.merged != 0 ? scene::widest_box(from, a) : 1;
    to.half_box[a] = static_cast<float>(box) * to.half_span;
    const double jitter = 0.5 * (from.jitter_center + from.jitter_stride) * box;
    to.shift[a] =
        static_cast<float>(to.merged != 0 ? scene::farthest_place(from, a) + jitter : jitter);
  }
}

void set_mark(const scene::VectorLayer& from, kernels::LineStyle& to) {
  const scene::LineMark& mark = from.mark;
  const double half = 0.5 * (from.r1 + from.r2);
  to.tail_light = static_cast<float>(mark.tail_light);
  to.marked = mark.plain() ? 0 : 1;
  to.half_width = static_cast<float>(half);
  to.narrowing = static_cast<float>(scene::narrowing(mark, half));
  const bool arrow = mark.shape == scene::LineShape::arrow && mark.head_length > 0;
  const double slope = arrow ? 0.5 * mark.head_width / mark.head_length : 0;
  to.head_length = arrow ? static_cast<float>(mark.head_length) : 0.0F;
  to.head_slope = static_cast<float>(slope);
  to.head_steep = static_cast<float>(static_cast<double>(to.steep) / std::hypot(1.0, slope));
  to.halo = static_cast<float>(static_cast<double>(to.steep) * mark.halo);
  to.outer = mark.plain() ? to.r2 : static_cast<float>(scene::outer_radius(mark, from.r1, from.r2));
}

}  // namespace

void to_floats(const std::vector<double>& from, std::vector<float>& to) {
  to.clear();
  for (const double v : from) to.push_back(bounded(v));
}

void flatten(const scene::ColorTable& table, std::vector<float>& rgb) {
  const std::size_t entries = table.entries.size();
  WINDSPLAT_CHECK(entries > 0);
  rgb.resize(kernels::color_floats * (entries + 1));
  float* to = rgb.data();
  for (std::size_t n = 0; n <= entries; ++n, to += kernels::color_floats) {
    const std::array<float, 3>& entry = table.entries[std::min(n, entries - 1)];
    std::copy(entry.begin(), entry.end(), to);
    to[3] = 0;
  }
}

kernels::ColorTable make_table(const scene::ColorTable& table, const std::vector<float>& rgb,
                               double scale, double origin) {
  kernels::ColorTable to{};
  to.rgb = rgb.data();
  to.entries = static_cast<int>(table.entries.size());
  to.low = bounded(scale * table.range[0] - origin);
  const double last = to.entries - 1;
  to.scale =
      bounded(std::min(last * ramp_scale(scale * table.range[0], scale * table.range[1]), 1e30));
  return to;
}

void set_rates(const scene::VectorLayer& from, std::vector<float>& rate_x,
               std::vector<float>& rate_z, kernels::LineStyle& to) {
  constexpr double least = 0x1p-100;  // relative to the largest: it shows only alone
  double largest = 0;
  for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(from.scale[c]));
  const double factor = toward_one(largest, 1e-12, 1e12);
  for (int c = 0; c < 3; ++c) {
    const double scale = from.scale[c];
    const double kept = std::max(std::abs(scale), least * largest);
    to.scale[c] = scale == 0 ? 0.0F : bounded(std::copysign(factor * kept, scale));
  }
  to_floats(from.rate_x, rate_x);
  to_floats(from.rate_z, rate_z);
  to.rate_x = rate_x.empty() ? nullptr : rate_x.data();
  to.rate_y = rate_x.empty() ? 1.0F : bounded(from.rate_y);
  to.rate_z = rate_z.empty() ? nullptr : rate_z.data();
}

void style_lines(const Scene& scene, const scene::VectorLayer& from, double depth_origin,
                 kernels::LineStyle& to) {
  to.length = static_cast<float>(from.length);
  const double scale = magnitude_scale(from);
  const double full = scale * from.magnitude_range[1];
  to.magnitude_scale = scale;
  to.scaled = scale != 1 ? 1 : 0;
  to.unscaled_min_magnitude = from.min_magnitude;
  to.inverse_full_magnitude = full > 0 ? bounded(1.0 / full) : std::numeric_limits<float>::max();
  to.min_magnitude = bounded(scale * from.min_magnitude);
  to.half_span = static_cast<float>(0.5 * (from.overlap ? from.span : 1.0));
  set_detail(from, to);
  to.r1 = static_cast<float>(from.r1);
  to.r2 = static_cast<float>(from.r2);
  to.inverse_ramp = static_cast<float>(1.0 / std::max(from.r2 - from.r1, 1e-6));
  to.opacity = static_cast<float>(from.opacity);
  to.steep = to.inverse_ramp * to.opacity;
  to.reach = to.r2 * to.steep;
  to.head_desaturation = static_cast<float>(from.head_desaturation);
  set_mark(from, to);
  to.intensity_low = bounded(scale * from.magnitude_range[0]);
  to.intensity_scale = ramp_scale(scale * from.magnitude_range[0], scale * from.magnitude_range[1]);
  to.intensity = static_cast<float>(from.magnitude_intensity);
  to.cue_near = bounded(scene.depth_cue.near - depth_origin);
  to.cue_scale = ramp_scale(scene.depth_cue.near, scene.depth_cue.far);
  to.cue_strength = static_cast<float>(scene.depth_cue.strength);
  to.color_by = static_cast<int>(from.color_by);
  to.jitter_center = static_cast<float>(from.jitter_center);
  to.jitter_stride = static_cast<float>(from.jitter_stride);
  to.seed = from.seed;
  to.epoch = from.epoch;
  for (std::size_t a = 0; a < 3; ++a) {
    to.first[a] = static_cast<std::uint32_t>(from.first_sample[a]);
  }
  for (int a = 0; a < 3; ++a) to.keep[a] = scene.slice && scene.slice->axis == a ? 0.0F : 1.0F;
  to.moving = from.moving ? 1 : 0;
  to.motion_cycles = from.motion_cycles;
}

void color_by_rise(const Scene& scene, const scene::VectorLayer& from, kernels::LineStyle& to) {
  const auto [low, high] = from.color.range;
  const auto [bottom, top] = scene::height_range(scene.lattice);
  const double by_rise = from.rise_weight / (high - low);
  const double by_height = (1 - from.rise_weight) / (top - bottom);
  to.rise_scale = bounded(by_rise * from.length);
  to.height_scale = bounded(by_height);
  to.rise_shift = bounded(-by_rise * low - by_height * bottom);
  to.color.low = 0;
  to.color.scale = static_cast<float>(to.color.entries - 1);
}

}  // namespace windsplat::engine
