// Dataset -> its description: axes, world box, fields with their ranges, steps, sizes.
#include "server/scene/describe.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/model/measure.hpp"
#include "server/scene/bend.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/defaults/first_step.hpp"
#include "server/scene/lattice.hpp"

namespace windsplat::scene {

namespace {

const char* axis_kind_name(data::AxisKind kind) {
  switch (kind) {
    case data::AxisKind::longitude:
      return "longitude";
    case data::AxisKind::latitude:
      return "latitude";
    case data::AxisKind::pressure:
      return "pressure";
    case data::AxisKind::height:
      return "height";
    case data::AxisKind::depth:
      return "depth";
    case data::AxisKind::level:
      return "level";
    case data::AxisKind::cartesian:
      return "cartesian";
  }
  return "cartesian";
}

std::vector<std::string> mappings_of(const data::Grid& grid) {
  using protocol::GeometryMapping;
  constexpr std::array<std::pair<GeometryMapping, const char*>, 3> all{
      {{GeometryMapping::flat, "flat"},
       {GeometryMapping::sphere, "sphere"},
       {GeometryMapping::curvilinear, "curvilinear"}}};
  std::vector<std::string> out;
  for (const auto& [mapping, name] : all) {
    if (check_mapping(grid, mapping)) out.emplace_back(name);
  }
  return out;
}

std::optional<protocol::GroundDescription> describe_ground(const data::Grid& grid) {
  if (!grid.ground) return std::nullopt;
  protocol::GroundDescription out;
  out.name = grid.ground->name;
  out.kind = grid.ground->kind == data::GroundKind::land ? "land" : "seaFloor";
  out.range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const float height : grid.ground->heights) {
    if (std::isnan(height)) continue;
    out.range[0] = std::min(out.range[0], static_cast<double>(height));
    out.range[1] = std::max(out.range[1], static_cast<double>(height));
  }
  return out;
}

protocol::FieldDescription describe_field(const data::FieldInfo& field) {
  protocol::FieldDescription out;
  out.name = field.name;
  out.kind = field.kind == data::FieldKind::vector ? "vector" : "scalar";
  out.components = field.components;
  out.units = field.units;
  out.standard_name = field.standard_name;
  out.long_name = field.long_name;
  out.dtype = field.dtype;
  return out;
}

// Sets range and masked count over the first `steps` steps. The range is absent if all samples are
// masked.
Result<void> add_range(data::Dataset& dataset, std::size_t steps,
                       protocol::FieldDescription& field) {
  data::FieldRange over;
  for (std::size_t step = 0; step < steps; ++step) {
    if (const auto* const stored = stored_range(dataset, field.name, step)) {
      over.add(*stored, dataset.info().grid.samples());
      continue;
    }
    const auto volume = dataset.volume(field.name, step);
    if (!volume) return volume.error();
    over.add(**volume);
  }
  field.range = over.range;
  field.masked = over.masked;
  return {};
}

// Over all steps, if the source has stored it.
void add_stored_range(const data::Dataset& dataset, protocol::FieldDescription& field) {
  data::FieldRange over;
  for (std::size_t step = 0; step < dataset.info().steps.size(); ++step) {
    const auto* const stored = stored_range(dataset, field.name, step);
    if (stored == nullptr) return;
    over.add(*stored, dataset.info().grid.samples());
  }
  field.range_of = "all";
  field.range = over.range;
  field.masked = over.masked;
}

// Of a view of vectors alone: the scalars that it leaves out, since none is known to be a cloud, a
// density or the like; empty if there are none. Components of the vectors are drawn with them.
std::string unshown_scalars(const protocol::View& view, const data::DatasetInfo& info) {
  const bool has_lines = view.vector.field.kind == protocol::FieldChoice::Kind::named;
  if (!has_lines || (view.scalars && !view.scalars->empty())) return {};
  std::set<std::string> components;
  for (const data::FieldInfo& field : info.fields) {
    if (field.kind != data::FieldKind::vector) continue;
    components.insert(field.components.begin(), field.components.end());
  }
  constexpr std::size_t listed_max = 4;
  std::string names;
  std::size_t count = 0;
  for (const data::FieldInfo& field : info.fields) {
    const bool is_left_out = field.kind == data::FieldKind::scalar && !field.derived &&
                             components.count(field.name) == 0;
    if (!is_left_out || ++count > listed_max) continue;
    names += (count > 1 ? ", " : "") + in_quotes(field.name);
  }
  if (count == 0) return {};
  return "the default view shows vectors only: /scalars shows " + names +
         (count > listed_max ? ", ..." : "");
}

// Two further notes are on vectors and scalars that are not shown.
void add_bounded(const std::vector<std::string>& unread, std::vector<std::string>& notes) {
  const std::size_t room = data::notes_max - 2 - std::min(notes.size(), data::notes_max - 3);
  const std::size_t listed = unread.size() <= room ? unread.size() : room - 1;
  notes.insert(notes.end(), unread.begin(), unread.begin() + static_cast<std::ptrdiff_t>(listed));
  if (listed == unread.size()) return;
  notes.push_back("the ranges of " + std::to_string(unread.size() - listed) +
                  " more fields are not known");
}

std::vector<protocol::LevelDescription> describe_levels(const data::DatasetInfo& info) {
  std::vector<protocol::LevelDescription> out;
  if (!info.stored || info.stored->levels.size() < 2) return out;
  std::size_t of_bricks = 0;  // a field that has them
  for (std::size_t f = 0; f < info.fields.size(); ++f) {
    if (info.fields[f].is_read_by_boxes()) of_bricks = f;
  }
  for (std::size_t n = 0; n < info.stored->levels.size(); ++n) {
    protocol::LevelDescription level;
    level.halvings = info.stored->levels[n];
    std::uint64_t samples = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      level.dims.at(a) = data::halved(info.grid.dims().at(a), level.halvings.at(a));
      samples *= static_cast<std::uint64_t>(level.dims.at(a));
    }
    const data::StoredPart whole{data::whole_box(level.dims), n};
    level.bricks = std::max<std::uint64_t>(1, data::bricks_of(info, of_bricks, whole));
    for (std::size_t f = 0; f < info.stored->fields.size(); ++f) {
      if (!info.stored->fields[f].has_levels) continue;  // as components that are shown alone
      const data::FieldInfo& field = info.fields[f];
      const bool is_vector = field.kind == data::FieldKind::vector;
      const auto as = n == 0      ? data::StoredAs::samples
                      : is_vector ? data::StoredAs::drawn
                                  : data::StoredAs::two_values;
      level.bytes += samples * static_cast<std::uint64_t>(components_of(field, as)) * sizeof(float);
    }
    if (!info.stored->bytes.empty()) level.stored_bytes = info.stored->bytes.at(n);
    out.push_back(level);
  }
  return out;
}

// The view that a dataset is first shown with, and notes on it. `has_damage`: some fields cannot be
// read.
Result<void> add_default_view(data::Dataset& dataset, bool has_damage, RangesOf ranges,
                              protocol::DatasetDescription& out) {
  if (const auto unfit = why_not_shown(dataset);
      ranges == RangesOf::seen && unfit && !unfit->empty()) {
    out.notes.push_back("its default view is not shown, but its fields can be probed: " + *unfit);
    return {};
  }
  auto completed = complete(out.default_view, dataset);
  if (!completed) {
    const bool is_damage = completed.error().kind == ErrorKind::bad_data;
    return is_damage && has_damage ? Result<void>() : completed.error();
  }
  out.default_view = completed->view();
  auto hidden = hidden_vectors(out.default_view, dataset);
  if (!hidden) return hidden.error();
  std::string unshown = unshown_scalars(out.default_view, dataset.info());
  for (std::string* note : {&*hidden, &unshown}) {
    if (!note->empty()) out.notes.push_back(std::move(*note));
  }
  return {};
}

}  // namespace

Result<std::string> why_not_shown(const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  const auto room = dataset.check_room(fields_of({}, info));
  if (room) return std::string();
  const auto is_probed = [&](const data::FieldInfo& field) {
    return field.derived || dataset.reads_within_limit(field.name);
  };
  if (!std::all_of(info.fields.begin(), info.fields.end(), is_probed)) return room.error();
  return room.error().message;
}

void add_seen_ranges(const data::Dataset& dataset, protocol::DatasetDescription& description) {
  const auto samples = static_cast<std::int64_t>(dataset.info().grid.samples());
  for (protocol::FieldDescription& field : description.fields) {
    field.storage_error = static_cast<double>(dataset.storage_error(field.name));
    const auto seen = dataset.seen(field.name, 0);
    if (!seen || !field.range_of.empty()) continue;
    field.range_of = "step";
    field.masked = seen->masked;
    if (seen->masked < samples) {
      field.range =
          protocol::Range{static_cast<double>(seen->range[0]), static_cast<double>(seen->range[1])};
    }
  }
}

void add_resident_bytes(const data::Dataset& dataset, protocol::DatasetDescription& description) {
  description.resident_bytes = dataset.resident_bytes();
  const std::vector<std::uint64_t> bytes = dataset.resident_bytes_of_levels();
  for (std::size_t n = 0; n < description.levels.size(); ++n) {
    description.levels[n].resident_bytes = bytes.at(n);
  }
}

protocol::DatasetDescription describe_briefly(const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  protocol::DatasetDescription out;
  out.id = info.id;
  out.title = info.title;
  out.source = info.source;
  out.format = info.format;
  out.state = "ready";
  out.step_count = info.steps.size();
  out.time_units = info.time_units;
  out.notes = info.notes;
  for (const data::FieldInfo& field : info.fields) out.fields.push_back(describe_field(field));
  out.resident_bytes = dataset.resident_bytes();
  return out;
}

Result<protocol::DatasetDescription> describe(data::Dataset& dataset, RangesOf ranges) {
  const data::DatasetInfo& info = dataset.info();
  protocol::DatasetDescription out;
  out.id = info.id;
  out.title = info.title;
  out.source = info.source;
  out.format = info.format;
  out.state = "ready";
  out.step_count = info.steps.size();
  out.dims = info.grid.dims();
  auto lattice = place_lattice(info.grid, protocol::GeometryView{});
  if (!lattice) return lattice.error();
  for (std::size_t a = 0; a < 3; ++a) {
    const data::Axis& axis = info.grid.axes[a];
    const int index = static_cast<int>(a);
    out.axes[a] = {axis.name,        axis.standard_name,   axis.units, axis_kind_name(axis.kind),
                   axis.coordinates, lattice->positions[a]};
    out.world_min[a] = lattice->box_min[index];
    out.world_max[a] = lattice->box_max[index];
  }
  out.vertical_exaggeration = vertical_exaggeration(info.grid, *lattice);
  out.ground = describe_ground(info.grid);
  out.mappings = mappings_of(info.grid);
  const std::size_t steps = ranges == RangesOf::all_steps ? info.steps.size() : 1;
  std::uint64_t components = 0;
  std::vector<std::string> unread;
  for (const data::FieldInfo& field : info.fields) {
    protocol::FieldDescription description = describe_field(field);
    // Derived fields are computed only when they are shown.
    const bool all = ranges == RangesOf::first_step || ranges == RangesOf::all_steps;
    if (all && !field.derived) {
      description.range_of = ranges == RangesOf::all_steps ? "all" : "step";
      if (auto ok = add_range(dataset, steps, description); !ok) {
        if (ok.error().kind != ErrorKind::bad_data) return ok.error();
        description.range_of.clear();
        unread.push_back("the range of " + in_quotes(field.name) +
                         " is not known: " + ok.error().message);
      }
    }
    if (ranges == RangesOf::none) add_stored_range(dataset, description);
    if (!field.derived) components += field.components.size();
    out.fields.push_back(std::move(description));
  }
  for (const data::LeftOut& left : info.left_out) out.left_out.emplace_back(left.name, left.reason);
  for (const data::DimensionChoice& choice : info.choices) {
    out.choices.push_back({choice.name, choice.length, choice.values, choice.chosen});
  }
  out.levels = describe_levels(info);
  out.notes = info.notes;
  add_bounded(unread, out.notes);
  for (const data::TimeStep& step : info.steps) out.steps.push_back({step.value, step.text});
  out.time_units = info.time_units;
  out.time_calendar = info.time_calendar;
  out.bytes_when_resident = components * info.grid.samples() * sizeof(float) * info.steps.size();
  out.default_view.dataset = info.id;
  if (ranges != RangesOf::none) {
    if (auto done = add_default_view(dataset, !unread.empty(), ranges, out); !done) {
      return done.error();
    }
  }
  if (ranges == RangesOf::seen) add_seen_ranges(dataset, out);
  add_resident_bytes(dataset, out);
  return out;
}

}  // namespace windsplat::scene
