#include "server/scene/traced/streamlets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "protocol/view/shown.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/region/crop.hpp"
#include "server/scene/traced/streamlines.hpp"
#include "server/scene/traced/traced_flow.hpp"
#include "server/trace/streamlets.hpp"

namespace windsplat::scene {

namespace {

using trace::Motion;

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

Result<std::shared_ptr<const trace::Segments>> traced_of(const protocol::View& view,
                                                         const Placed& placed,
                                                         const VectorLayer& layer,
                                                         const data::Derivation& how,
                                                         data::Dataset& dataset) {
  const std::string key = segments_key(view, placed, layer);
  if (has_seeds(view)) return streamlines_of(view, placed, layer, how, key, dataset);
  const trace::Streamlets of = description_of(view, layer, placed.lattice);
  const auto [vertices, bytes] = trace::room_of(of);
  if (!dataset.is_within_limit(bytes) || vertices > std::numeric_limits<std::int32_t>::max()) {
    return invalid_at("/vector/trace",
                      "its segments take up to " + std::to_string(bytes >> 20U) +
                          " MiB, more than the memory limit permits: choose a larger "
                          "/vector/stride or fewer /vector/trace/segments");
  }
  auto kept = dataset.auxiliary(key, bytes, [&]() -> Result<data::Resident> {
    const CancelToken cancel = dataset.cancellation();
    auto made = std::make_shared<const trace::Segments>(trace::make_segments(of, cancel));
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "tracing cancelled");
    return data::Resident(std::move(made));
  });
  if (!kept) return kept.error();
  return std::static_pointer_cast<const trace::Segments>(*kept);
}

}  // namespace windsplat::scene
