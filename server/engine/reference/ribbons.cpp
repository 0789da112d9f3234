// The vector at a kernel position -> its line on the screen.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "server/base/pcg3d.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/light/shade.hpp"

namespace windsplat::engine::reference {

namespace {

using scene::LineColor;
using scene::Scene;
using scene::VectorLayer;

// ---- jitter ----

using Hash = std::array<std::uint32_t, 3>;

double unit_interval(std::uint32_t bits) { return static_cast<double>(bits >> 8U) / 16777216.0; }

struct Jitter {
  Vec stride{};      // each component in [-1/2, 1/2)
  Vec centre{};      // each component in [-1/2, 1/2)
  double phase = 0;  // in [0, 1)
};

Jitter jitter_of(const VectorLayer& layer, const std::array<int, 3>& sample) {
  const Hash key = pcg3d({layer.seed, layer.epoch, 0x9e3779b9U});
  Hash own = key;
  for (std::size_t a = 0; a < 3; ++a) {
    own[a] +=
        static_cast<std::uint32_t>(layer.first_sample[a]) + static_cast<std::uint32_t>(sample[a]);
  }
  const Hash first = pcg3d(own);
  const Hash second = pcg3d(first);
  Jitter jitter;
  for (int a = 0; a < 3; ++a) {
    jitter.stride[a] = unit_interval(first[a]) - 0.5;
    jitter.centre[a] = unit_interval(second[a]) - 0.5;
  }
  jitter.phase = unit_interval(pcg3d(second)[0]);
  return jitter;
}

// ---- lines ----

}  // namespace

std::optional<DrawnVector> read_vector(const Scene& scene, const VectorLayer& layer,
                                       const KernelPosition& position) {
  Vec data{};
  const std::size_t number = layer.field_stride == 1
                                 ? position.index
                                 : scene::vector_number(layer, scene.lattice, position.sample);
  for (int c = 0; c < layer.field->components; ++c) {
    data[c] = static_cast<double>(layer.field->component(c)[number]);
  }
  if (std::isnan(data[0])) return {};
  DrawnVector drawn;
  drawn.magnitude = length(data);
  if (drawn.magnitude < layer.min_magnitude || drawn.magnitude == 0) return {};
  Vec d{};
  for (int c = 0; c < 3; ++c) d[c] = data[c] / drawn.magnitude * layer.scale[c];
  if (!layer.rate_x.empty()) {
    d[0] *= layer.rate_x[position.sample[1]];
    d[1] *= layer.rate_y;
    d[2] *= layer.rate_z[position.sample[2]];
  }
  const double norm = length(d);
  if (norm == 0) return {};
  for (int c = 0; c < 3; ++c) drawn.unit[c] = d[c] / norm;
  const double full = layer.magnitude_range[1];
  const double part = full > 0 ? std::clamp(drawn.magnitude / full, 0.0, 1.0) : 1.0;
  drawn.rise = drawn.unit[2] * part * layer.length;
  if (scene.slice) drawn.unit[scene.slice->axis] = 0;
  if (!scene.lattice.places) {
    drawn.extent = scaled(drawn.unit, part * layer.length);
    return drawn;
  }
  Vec along{};
  for (int a = 0; a < 3; ++a) {
    along = plus(along, drawn.unit[a] / length(position.edge[a]), position.edge[a]);
  }
  // The edges of a curved cell need not be perpendicular; keep the length of `unit`.
  const double bent = length(along);
  if (bent > 0) along = scaled(along, length(drawn.unit) / bent);
  drawn.extent = scaled(along, part * layer.length);
  return drawn;
}

namespace {

// The part of a line within its kernel box, as q; empty if low > high. Liang-Barsky in cells.
struct Part {
  double low = -0.5;
  double high = 0.5;
};

Part clip_to_box(const VectorLayer& layer, const KernelPosition& position, const Vec& in_box,
                 const Vec& extent) {
  Part part;
  const double half = (layer.overlap ? layer.span : 1.0) / 2;
  const Vec slope = position.to_cells(extent);
  for (int a = 0; a < 3; ++a) {
    if (std::abs(slope[a]) > 1e-30) {
      const double p = (-half - in_box[a]) / slope[a];
      const double q = (half - in_box[a]) / slope[a];
      part.low = std::max(part.low, std::min(p, q));
      part.high = std::min(part.high, std::max(p, q));
    } else if (std::abs(in_box[a]) > half) {
      return {1, 0};
    }
  }
  return part;
}

// The bearing in [0, 360): 0 along +y, 90 along +x.
double bearing(const Vec& v) {
  const double degrees = std::atan2(v[0] + 0.0, v[1] + 0.0) * 180 / std::numbers::pi;
  const double turned = degrees < 0 ? degrees + 360 : degrees;
  return turned < 360 ? turned : 0;
}

struct Seen {
  double z = 0;         // height on the uncurved lattice
  double distance = 0;  // view depth of the middle of the line
};

Vec undimmed_color(const Scene& scene, const VectorLayer& layer, const KernelPosition& position,
                   const DrawnVector& drawn, const Seen& seen) {
  const auto [low, high] = scene::height_range(scene.lattice);
  switch (layer.color_by) {
    case LineColor::world_z:
      return table_color(layer.color, seen.z);
    case LineColor::screen_z:
      return table_color(layer.color, seen.distance);
    case LineColor::rise: {
      const auto [least, most] = layer.color.range;
      const double height = least + (seen.z - low) / (high - low) * (most - least);
      return table_color(layer.color,
                         (1 - layer.rise_weight) * height + layer.rise_weight * drawn.rise);
    }
    case LineColor::magnitude:
      return table_color(layer.color, drawn.magnitude);
    case LineColor::direction:
      return table_color(layer.color, bearing(drawn.unit));
    case LineColor::scalar: {
      const auto value = static_cast<double>(layer.color_field->values[position.index]);
      return std::isnan(value) ? Vec{0.5, 0.5, 0.5} : table_color(layer.color, value);
    }
    case LineColor::constant:
      break;
  }
  return table_color(layer.color, 0);
}

double ramp(double v, double low, double high) {
  if (high > low) return std::clamp((v - low) / (high - low), 0.0, 1.0);
  return v > low ? 1 : 0;
}

void project(const View& view, const Vec& p, double& x, double& y) {
  const double z = view.perspective ? p[2] : 1;
  x = view.half_width + p[0] / (z * view.pixel);
  y = view.half_height + p[1] / (z * view.pixel);
}

// Clips to the near plane. Returns false if nothing remains.
bool clip_to_near(const View& view, const Vec& p, const Vec& v, Part& part) {
  if (!view.perspective) return part.low <= part.high;
  if (v[2] > 0) part.low = std::max(part.low, (view.near - p[2]) / v[2]);
  if (v[2] < 0) part.high = std::min(part.high, (view.near - p[2]) / v[2]);
  return part.low <= part.high && (v[2] != 0 || p[2] >= view.near);
}

}  // namespace

std::optional<Ribbon> make_ribbon(const Scene& scene, const View& view, const VectorLayer& layer,
                                  const KernelPosition& position) {
  const auto drawn = read_vector(scene, layer, position);
  if (!drawn) return {};
  const Jitter jitter = jitter_of(layer, position.sample);
  Vec in_box{};  // centre of the line in its kernel box, cells
  Vec offset{};  // centre of the line from the kernel position, world units
  for (int a = 0; a < 3; ++a) {
    in_box[a] = layer.jitter_center * jitter.centre[a];
    offset = plus(offset, in_box[a] + layer.jitter_stride * jitter.stride[a], position.edge[a]);
  }
  Part part = clip_to_box(layer, position, in_box, drawn->extent);
  const Vec p = to_camera(view, plus(position.from_eye, 1, offset));
  const Vec v = to_camera(view, drawn->extent);
  if (!clip_to_near(view, p, v, part)) return {};
  Ribbon line;
  line.q0 = part.low;
  line.q1 = part.high;
  line.a = plus(p, part.low, v);
  line.b = plus(p, part.high, v);
  if (view.perspective) {
    line.a[2] = std::max(line.a[2], view.near);
    line.b[2] = std::max(line.b[2], view.near);
  }
  project(view, line.a, line.x0, line.y0);
  project(view, line.b, line.x1, line.y1);
  line.r1 = layer.r1;
  line.r2 = layer.r2;
  line.opacity = layer.opacity;
  line.desaturation = layer.head_desaturation;
  line.mark = layer.mark;
  line.perspective = view.perspective;
  line.moving = layer.moving;
  const double lift = in_box[2] + layer.jitter_stride * jitter.stride[2];
  const Seen seen{scene.lattice.positions[2][position.sample[2]] + lift * position.cell[2], p[2]};
  const double strong = ramp(drawn->magnitude, layer.magnitude_range[0], layer.magnitude_range[1]);
  const double far = ramp(p[2], scene.depth_cue.near, scene.depth_cue.far);
  const double dim =
      (1 - layer.magnitude_intensity * (1 - strong)) * (1 - scene.depth_cue.strength * far);
  const double lit = scene.light ? light::line_light(*scene.light, position.index) : 1;
  line.color = scaled(undimmed_color(scene, layer, position, *drawn, seen), dim * lit);
  if (layer.moving) {
    const double full = layer.magnitude_range[1];
    const double speed = full > 0 ? std::min(drawn->magnitude / full, 1.0) : 1.0;
    line.phase = jitter.phase + layer.motion_cycles * speed;
  }
  return line;
}

ScreenBox ribbon_box(const Ribbon& line) {
  const double outer = scene::outer_radius(line.mark, line.r1, line.r2);
  return {std::min(line.x0, line.x1) - outer, std::max(line.x0, line.x1) + outer,
          std::min(line.y0, line.y1) - outer, std::max(line.y0, line.y1) + outer};
}

}  // namespace windsplat::engine::reference
