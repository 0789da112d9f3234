// View and layer -> the flow that lines follow, and their colours.
#include "server/scene/traced/traced_flow.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace windsplat::scene {

namespace {

using trace::Motion;

// The height of a place on the uncurved lattice.
double height_at(const Lattice& lattice, double index) {
  const std::vector<double>& z = lattice.positions[2];
  if (z.size() < 2) return z[0] + index * lattice.spacing[2][0];
  const double low = std::clamp(std::floor(index), 0.0, static_cast<double>(z.size() - 2));
  const auto k = static_cast<std::size_t>(low);
  return z[k] + (index - low) * (z[k + 1] - z[k]);
}

// The compass bearing in [0, 360).
double compass_bearing(const glm::dvec3& v) {
  const double degrees = std::atan2(v.x, v.y) * 180 / std::numbers::pi;
  const double turned = degrees < 0 ? degrees + 360 : degrees;
  return turned < 360 ? turned : 0;
}

}  // namespace

trace::Flow flow_of(const VectorLayer& layer, const Lattice& lattice) {
  trace::Flow flow;
  flow.dims = lattice.dims;
  flow.around = lattice.around;
  for (int c = 0; c < layer.field->components && c < 3; ++c) {
    flow.components[static_cast<std::size_t>(c)] = layer.field->component(c);
  }
  flow.scale = layer.scale;
  flow.rate_x = layer.rate_x;
  flow.rate_y = layer.rate_y;
  flow.rate_z = layer.rate_z;
  for (std::size_t a = 0; a < 3; ++a) {
    flow.positions[a] = lattice.positions[a];
    flow.spacing[a] = lattice.spacing[a];
  }
  if (lattice.places) flow.places = lattice.places->data();
  return flow;
}

double color_value(const VectorLayer& layer, const Lattice& lattice, const trace::Flow& flow,
                   const glm::dvec3& index, const Motion& motion) {
  switch (layer.color_by) {
    case LineColor::world_z:
      return height_at(lattice, index.z);
    case LineColor::rise: {
      const auto [low, high] = layer.color.range;
      const auto [bottom, top] = height_range(lattice);
      const double full = layer.magnitude_range[1];
      const double part = full > 0 ? std::min(motion.magnitude / full, 1.0) : 1.0;
      const double rise = motion.drawn.z * part * layer.length;
      return (1 - layer.rise_weight) * (height_at(lattice, index.z) - bottom) / (top - bottom) +
             layer.rise_weight * (rise - low) / (high - low);
    }
    case LineColor::magnitude:
      return motion.magnitude * trace::Segments::scale_of(layer.magnitude_range[1]);
    case LineColor::direction:
      return compass_bearing(motion.drawn);
    case LineColor::scalar:
      return trace::value_at(flow, layer.color_field->values.data(), index);
    case LineColor::screen_z:
    case LineColor::constant:
      break;
  }
  return 0;
}

}  // namespace windsplat::scene
