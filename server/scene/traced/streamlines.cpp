#include "server/scene/traced/streamlines.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "server/data/cf/units.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/region/select.hpp"
#include "server/scene/traced/seeds.hpp"
#include "server/scene/traced/traced_flow.hpp"
#include "server/trace/streamlines.hpp"

namespace windsplat::scene {

namespace {

using protocol::SeedsView;
using trace::Motion;

constexpr const char* seeds_pointer = "/vector/trace/seeds";
constexpr const char* steps_pointer = "/vector/trace/seeds/pathSteps";

// Of the box: a quarter of a pixel, and eight pixels, where it fills a picture of 1000.
constexpr double departure_of_diagonal = 1.0 / 4000;
constexpr double longest_of_diagonal = 1.0 / 100;
constexpr int steps_most = 4000;  // of the integration, on each side

std::string seeds_key(const SeedsView& seeds) {
  std::ostringstream key;
  key << " seeds " << seeds.evenly.value_or(-1) << ' ' << seeds.path_steps << ' ' << seeds.pieces
      << std::hexfloat << ' ' << seeds.dash << ' ' << seeds.length.value_or(-1) << ' '
      << seeds.duration.value_or(-1) << ' ' << seeds.points.size();
  const auto add = [&key](const protocol::Vec3& at) {
    for (const double number : at) key << ' ' << number;
  };
  for (const protocol::Vec3& point : seeds.points) add(point);
  if (seeds.line) {
    key << " line " << seeds.line->count;
    add(seeds.line->from);
    add(seeds.line->to);
  }
  if (seeds.block) {
    key << " block";
    for (const int count : seeds.block->counts) key << ' ' << count;
    add(seeds.block->from);
    add(seeds.block->to);
  }
  return key.str();
}

// The vertical axis of the data at the samples of a lattice.
data::Axis vertical_of(const data::DatasetInfo& info, const Lattice& lattice) {
  data::Axis axis = info.grid.axes[2];
  const auto first = axis.coordinates.begin() + lattice.first[2];
  axis.coordinates = std::vector<double>(first, first + lattice.dims[2]);
  return axis;
}

// Seconds for each unit of the times of steps; nullopt: not a unit of time that is always as long.
std::optional<double> seconds_of(const data::DatasetInfo& info) {
  const std::string& units = info.time_units;
  const std::string unit = units.substr(0, units.find(" since"));
  if (unit.empty() || unit.starts_with("month") || unit.starts_with("year")) return std::nullopt;
  return data::unit_ratio(unit, "s");
}

// The vectors of some steps, and their times from that of the view, seconds.
struct Series {
  std::vector<std::shared_ptr<const data::Volume>> volumes;
  std::vector<trace::Frame> frames;
};

// `segments`: bytes of what is made from them, which must fit beside them.
Result<Series> series_of(const protocol::View& view, const data::Derivation& how,
                         const VectorLayer& layer, std::uint64_t segments, data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  if (view.vector.space != protocol::VectorSpace::world) {
    return invalid_at(steps_pointer,
                      "paths need speeds in the world: set /vector/space to \"world\"");
  }
  const auto seconds = seconds_of(info);
  // Of a difference at the same steps, those of both datasets.
  const data::DatasetInfo* shortest = &info;
  const auto other = dataset.subtrahend();
  if (other && !other->step && other->info->steps.size() < info.steps.size()) {
    shortest = other->info.get();
  }
  if (!seconds || shortest->steps.size() < 2) {
    return invalid_at(
        steps_pointer,
        shortest->steps.size() < 2
            ? "dataset " + in_double_quotes(shortest->id) + " has one step"
            : "the times of the steps have no known unit: " + in_double_quotes(info.time_units));
  }
  const int last_step = static_cast<int>(shortest->steps.size()) - 1;
  const int first = std::max(view.step - view.vector.trace->seeds->path_steps, 0);
  const int last = std::min(view.step + view.vector.trace->seeds->path_steps, last_step);
  const std::uint64_t each = layer.field->values.size() * sizeof(float);
  const auto count = static_cast<std::uint64_t>(last) - static_cast<std::uint64_t>(first) + 1;
  // What a step is computed from is let go before segments are made.
  const bool computed = !how.variant.empty();
  const std::uint64_t loading = dataset.loading_bytes(view.vector.field.name);
  const std::uint64_t operands = computed ? loading : loading - std::min(each, loading);
  const std::uint64_t all = count * each + std::max(segments, operands);
  if (!dataset.is_within_limit(all)) {
    return invalid_at(seeds_pointer, "the vectors of " + std::to_string(count) +
                                         " steps and the segments of the paths take up to " +
                                         std::to_string(all >> 20U) +
                                         " MiB, more than the memory limit permits: choose fewer "
                                         "/vector/trace/seeds/pathSteps, seeds or "
                                         "/vector/trace/seeds/pieces");
  }
  Series out;
  const double origin = info.steps[static_cast<std::size_t>(view.step)].value;
  for (int step = first; step <= last; ++step) {
    const auto s = static_cast<std::size_t>(step);
    auto volume = dataset.derived(view.vector.field.name, s, how);
    if (!volume) return volume.error();
    trace::Frame frame;
    frame.time = (info.steps[s].value - origin) * *seconds;
    for (int c = 0; c < (*volume)->components && c < 3; ++c) {
      frame.components[static_cast<std::size_t>(c)] = (*volume)->component(c);
    }
    if (!out.frames.empty() && !(frame.time > out.frames.back().time)) {
      return invalid_at(steps_pointer, "the times of steps " + std::to_string(step - 1) + " and " +
                                           std::to_string(step) + " do not ascend");
    }
    out.volumes.push_back(std::move(*volume));
    out.frames.push_back(frame);
  }
  return out;
}

trace::Streamlines description_of(const protocol::View& view, const VectorLayer& layer,
                                  const Placed& placed) {
  const Lattice& lattice = placed.lattice;
  const SeedsView& seeds = *view.vector.trace->seeds;
  trace::Streamlines of;
  of.flow = flow_of(layer, lattice);
  // A flat map that goes around the globe: lines leave it on one side and enter on the other.
  if (!lattice.places) of.flow.around = samples_around(placed.grid);
  of.limits.tolerance = view.vector.trace->step_error;
  of.limits.steps_max = steps_most;
  if (seeds.duration) of.limits.duration_max = *seeds.duration;
  const double diagonal = glm::length(lattice.box_max - lattice.box_min);
  of.length = seeds.length.value_or(diagonal);
  of.pieces_max = seeds.pieces;
  of.departure = departure_of_diagonal * diagonal;
  of.longest = longest_of_diagonal * diagonal;
  of.full_magnitude = layer.magnitude_range[1];
  of.magnitude_scale = trace::Segments::scale_of(layer.magnitude_range[1]);
  of.magnitude_least = drawn_least;
  of.dash = seeds.dash;
  of.seed = layer.seed;
  of.epoch = layer.epoch;
  of.color = [&layer, &lattice, flow = of.flow](const glm::dvec3& index, const Motion& motion) {
    return color_value(layer, lattice, flow, index, motion);
  };
  return of;
}

}  // namespace

Result<std::shared_ptr<const trace::Segments>> streamlines_of(
    const protocol::View& view, const Placed& placed, const VectorLayer& layer,
    const data::Derivation& how, const std::string& key, data::Dataset& dataset) {
  const SeedsView& seeds = *view.vector.trace->seeds;
  const std::string name = key + seeds_key(seeds);
  const auto none = []() -> Result<data::Resident> { return data::Resident(); };
  if (seeds.path_steps > 0) {  // kept lines do not need the vectors of their steps
    if (auto there = dataset.resident_only().auxiliary(name, 0, none)) {
      return std::static_pointer_cast<const trace::Segments>(*there);
    }
  }
  trace::Streamlines of = description_of(view, layer, placed);
  const auto [vertices, bytes] = trace::room_of(of, seeds_in(seeds));
  if (!dataset.is_within_limit(bytes) || vertices > std::numeric_limits<std::int32_t>::max()) {
    return invalid_at(seeds_pointer, "the segments of " + std::to_string(seeds_in(seeds)) +
                                         " lines take up to " + std::to_string(bytes >> 20U) +
                                         " MiB, more than the memory limit permits: choose fewer "
                                         "seeds or /vector/trace/seeds/pieces");
  }
  Series series;
  if (seeds.path_steps > 0) {
    auto loaded = series_of(view, how, layer, bytes, dataset);
    if (!loaded) return loaded.error();
    series = std::move(*loaded);
    of.flow.frames = series.frames;
    const double most = seeds.duration.value_or(std::numeric_limits<double>::max());
    of.back = std::min(most, -series.frames.front().time);
    of.ahead = std::min(most, series.frames.back().time);
  }
  auto kept = dataset.auxiliary(name, bytes, [&]() -> Result<data::Resident> {
    const CancelToken cancel = dataset.cancellation();
    trace::Flow steady = of.flow;
    steady.frames = {};
    auto places =
        seeds_of(seeds, placed, vertical_of(dataset.info(), placed.lattice), steady, cancel);
    if (!places) return places.error();
    of.seeds = std::move(*places);
    auto made = std::make_shared<const trace::Segments>(trace::make_streamlines(of, cancel));
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "tracing cancelled");
    return data::Resident(std::move(made));
  });
  if (!kept) return kept.error();
  return std::static_pointer_cast<const trace::Segments>(*kept);
}

}  // namespace windsplat::scene
