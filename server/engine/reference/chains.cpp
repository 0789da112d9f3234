// Segments of curved lines -> lines on the screen.
#include "server/engine/reference/chains.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/light/shade.hpp"

namespace windsplat::engine::reference {

namespace {

using scene::LineColor;
using scene::Scene;
using scene::VectorLayer;
using trace::Segments;

struct Joint {
  Vec at{};                     // right, down, forward of the eye
  double x = 0, y = 0;          // pixels, if it lies beyond the near plane
  double way_x = 0, way_y = 0;  // the direction of its tangent on the screen
  bool beyond = true;
};

void to_screen(const View& view, const Vec& p, double& x, double& y) {
  const double z = view.perspective ? p[2] : 1;
  x = view.half_width + p[0] / (z * view.pixel);
  y = view.half_height + p[1] / (z * view.pixel);
}

Joint joint_at(const View& view, const Segments& from, std::size_t vertex) {
  Joint joint;
  Vec world{};
  Vec along{};
  for (std::size_t c = 0; c < 3; ++c) {
    world[c] = static_cast<double>(from.places[vertex][c]) - view.eye[c];
    along[c] = static_cast<double>(from.tangents[c][vertex]);
  }
  joint.at = to_camera(view, world);
  joint.beyond = !view.perspective || joint.at[2] >= view.near;
  if (joint.beyond) to_screen(view, joint.at, joint.x, joint.y);
  const Vec way = to_camera(view, along);
  joint.way_x = view.perspective ? way[0] * joint.at[2] - joint.at[0] * way[2] : way[0];
  joint.way_y = view.perspective ? way[1] * joint.at[2] - joint.at[1] * way[2] : way[1];
  return joint;
}

double fraction_of(double v, double low, double high) {
  if (high > low) return std::clamp((v - low) / (high - low), 0.0, 1.0);
  return v > low ? 1 : 0;
}

// The value of a vertex as the colours of the layer count it; rise, on [0, 1].
Vec color_at(const VectorLayer& layer, double value, double depth) {
  if (layer.color_by == LineColor::screen_z) return table_color(layer.color, depth);
  if (layer.color_by == LineColor::constant) return table_color(layer.color, 0);
  if (std::isnan(value)) return {0.5, 0.5, 0.5};
  if (layer.color_by == LineColor::rise) {
    const auto [low, high] = layer.color.range;
    return table_color(layer.color, low + value * (high - low));
  }
  return table_color(layer.color, value);
}

// Clips a segment to the near plane. Returns false if nothing remains.
bool place_ends(const View& view, const Joint& from, const Joint& to, Ribbon& line) {
  if (!from.beyond && !to.beyond) return false;
  const Vec way = plus(to.at, -1, from.at);
  const double part = from.beyond && to.beyond ? 0 : (view.near - from.at[2]) / way[2];
  line.a = from.beyond ? from.at : plus(from.at, part, way);
  line.b = to.beyond ? to.at : plus(from.at, part, way);
  if (view.perspective) {
    line.a[2] = std::max(line.a[2], view.near);
    line.b[2] = std::max(line.b[2], view.near);
  }
  const double rise = line.q1 - line.q0;
  if (!to.beyond) line.q1 = line.q0 + part * rise;
  if (!from.beyond) line.q0 += part * rise;
  to_screen(view, line.a, line.x0, line.y0);
  to_screen(view, line.b, line.x1, line.y1);
  const double ux = line.x1 - line.x0;
  const double uy = line.y1 - line.y0;
  if (from.beyond && from.way_x * ux + from.way_y * uy > 0) line.cut = {from.way_x, from.way_y};
  if (to.beyond && to.way_x * ux + to.way_y * uy > 0) {
    line.end = {to.way_x, to.way_y};
    line.end_most = 0;
  }
  return true;
}

// Of the part of a segment that is drawn.
void set_dashes(const Segments& from, std::size_t v, double cycles, Ribbon& line) {
  const auto low = static_cast<double>(from.q[v]);
  const double rise = static_cast<double>(from.q[v + 1]) - low;
  const auto part = [&](double q) { return rise > 0 ? (q - low) / rise : 0; };
  const auto turns = static_cast<double>(from.turns[v]);
  const double first = static_cast<double>(from.phases[v]) - cycles;
  line.dashed = true;
  line.turn0 = first + part(line.q0) * turns;
  line.turn1 = first + (rise > 0 ? part(line.q1) : 1) * turns;
}

}  // namespace

std::optional<Ribbon> make_segment(const Scene& scene, const View& view, const VectorLayer& layer,
                                   std::size_t vertex) {
  const Segments& from = *layer.streamlets;
  const float scaled_magnitude = from.magnitudes[vertex];
  if (vertex + 1 >= from.vertices() || scaled_magnitude < 0 ||
      scaled_magnitude == Segments::not_drawn) {
    return std::nullopt;
  }
  const Joint a = joint_at(view, from, vertex);
  const Joint b = joint_at(view, from, vertex + 1);
  Ribbon line;
  line.q0 = static_cast<double>(from.q[vertex]);
  line.q1 = static_cast<double>(from.q[vertex + 1]);
  if (!place_ends(view, a, b, line)) return std::nullopt;
  line.chained = true;
  line.r1 = layer.r1;
  line.r2 = layer.r2;
  line.opacity = layer.opacity;
  line.desaturation = layer.head_desaturation;
  line.perspective = view.perspective;
  line.mark = layer.mark;
  line.whole = line.q0 + 0.5;
  line.whole_rise = line.q1 - line.q0;
  line.moving = layer.moving;
  const double full = layer.magnitude_range[1];
  const double depth = 0.5 * (a.at[2] + b.at[2]);
  // The scale of the magnitudes of the segments is a power of two.
  const double scale = from.magnitude_scale;
  const double magnitude = static_cast<double>(scaled_magnitude) / scale;
  const double strong = fraction_of(magnitude, layer.magnitude_range[0], full);
  const double far = fraction_of(depth, scene.depth_cue.near, scene.depth_cue.far);
  const double lit = scene.light ? light::line_light(*scene.light, from.samples[vertex]) : 1;
  const double dim =
      lit * (1 - layer.magnitude_intensity * (1 - strong)) * (1 - scene.depth_cue.strength * far);
  double value = static_cast<double>(from.colors[vertex]);
  if (layer.color_by == LineColor::magnitude) value /= scale;
  line.color = scaled(color_at(layer, value, depth), dim);
  if (layer.moving && !from.turns.empty()) {
    set_dashes(from, vertex, layer.motion_cycles, line);
  } else if (layer.moving) {
    const double part = full > 0 ? std::min(magnitude / full, 1.0) : 1.0;
    line.phase = static_cast<double>(from.phases[vertex]) + layer.motion_cycles * part;
  }
  return line;
}

void list_chains(const Scene& scene, const View& view, const VectorLayer& layer, Kernels& kernels) {
  for (std::size_t v = 0; v + 1 < layer.streamlets->vertices(); ++v) {
    if (const auto line = make_segment(scene, view, layer, v)) kernels.ribbons.push_back(*line);
  }
}

}  // namespace windsplat::engine::reference
