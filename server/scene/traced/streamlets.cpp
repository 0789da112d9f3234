#include "server/scene/traced/streamlets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>

#include "server/scene/refusal.hpp"
#include "server/scene/region/crop.hpp"
#include "server/trace/streamlets.hpp"

namespace windsplat::scene {

namespace {

using trace::Motion;

// The smallest magnitude that the kernels draw, whatever the least of the view.
constexpr double drawn_least = 0x1p-124;

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

// The value of a place that determines its colour; see trace::Segments::colors.
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

trace::Streamlets description_of(const protocol::View& view, const VectorLayer& layer,
                                 const Lattice& lattice) {
  trace::Streamlets of;
  of.flow = flow_of(layer, lattice);
  of.limits.tolerance = view.vector.trace->step_error;
  of.segments_max = view.vector.trace->segments;
  of.stride = layer.stride;
  for (int a = 0; a < 3; ++a) of.drawn[static_cast<std::size_t>(a)] = lattice.drawn(a);
  of.length = layer.length;
  of.full_magnitude = layer.magnitude_range[1];
  of.least_magnitude = layer.min_magnitude;
  of.magnitude_scale = trace::Segments::scale_of(layer.magnitude_range[1]);
  of.magnitude_least = drawn_least;
  of.jitter_center = layer.jitter_center;
  of.jitter_stride = layer.jitter_stride;
  of.first_sample = layer.first_sample;
  of.seed = layer.seed;
  of.epoch = layer.epoch;
  of.color = [&layer, &lattice, flow = of.flow](const glm::dvec3& index, const Motion& motion) {
    return color_value(layer, lattice, flow, index, motion);
  };
  return of;
}

// Everything that determines the segments, exactly.
std::string segments_key(const protocol::View& view, const Placed& placed,
                         const VectorLayer& layer) {
  const protocol::GeometryView& geometry = view.geometry;
  const protocol::VectorView& vector = view.vector;
  std::ostringstream key;
  key << "streamlets " << view.step << ' ' << static_cast<int>(geometry.mapping) << ' '
      << static_cast<int>(geometry.vertical) << ' ' << static_cast<int>(vector.space) << ' '
      << layer.stride << ' ' << layer.seed << ' ' << layer.epoch << ' ' << vector.trace->segments
      << ' ' << static_cast<int>(layer.color_by) << std::hexfloat;
  for (const double scale : geometry.scale) key << ' ' << scale;
  for (const double scale : vector.scale) key << ' ' << scale;
  for (const double number : {vector.trace->step_error, layer.length, layer.magnitude_range[1],
                              layer.min_magnitude, layer.jitter_center, layer.jitter_stride}) {
    key << ' ' << number;
  }
  if (layer.color_by == LineColor::rise) {
    key << ' ' << layer.color.range[0] << ' ' << layer.color.range[1] << ' ' << layer.rise_weight;
  }
  // Names last, each with its length, since they may hold any character.
  const auto add = [&key](const std::string& name) { key << ' ' << name.size() << ' ' << name; };
  add(vector.field.name);
  add(geometry.height_field.value_or(""));
  if (layer.color_by == LineColor::scalar) add(*vector.color.field);
  const auto components = static_cast<std::size_t>(layer.field->components);
  add(kept_part(placed, components, filters_of(view.region, protocol::FilterOf::lines)).variant);
  return key.str();
}

}  // namespace

Result<std::shared_ptr<const trace::Segments>> streamlets_of(const protocol::View& view,
                                                             const Placed& placed,
                                                             const VectorLayer& layer,
                                                             data::Dataset& dataset) {
  const trace::Streamlets of = description_of(view, layer, placed.lattice);
  const std::int64_t vertices = trace::vertices_at_most(of);
  const std::uint64_t bytes = static_cast<std::uint64_t>(vertices) * trace::Segments::vertex_bytes;
  if (!dataset.is_within_limit(bytes) || vertices > std::numeric_limits<std::int32_t>::max()) {
    return invalid_at("/vector/trace",
                      "its segments take up to " + std::to_string(bytes >> 20U) +
                          " MiB, more than the memory limit permits: choose a larger "
                          "/vector/stride or fewer /vector/trace/segments");
  }
  auto kept =
      dataset.auxiliary(segments_key(view, placed, layer), bytes, [&of]() -> data::Resident {
        return std::make_shared<const trace::Segments>(trace::make_segments(of));
      });
  if (!kept) return kept.error();
  return std::static_pointer_cast<const trace::Segments>(*kept);
}

}  // namespace windsplat::scene
