// Completes a view in two passes: first what the description of the dataset determines, then what
// follows from its data. Completing a view without omitted values loads nothing.
#include "server/scene/completed_view.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <sstream>
#include <string>
#include <utility>

#include "protocol/limits.hpp"
#include "protocol/view/shown.hpp"
#include "server/base/ascii.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/defaults/first_step.hpp"
#include "server/scene/defaults/from_data.hpp"
#include "server/scene/difference/difference.hpp"
#include "server/scene/earth/ground.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/lines/mark.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/region/crop.hpp"
#include "server/scene/region/select.hpp"
#include "server/scene/section.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"
#include "server/scene/traced/seeds.hpp"

namespace windsplat::scene {

namespace {

using protocol::ColorBy;
using protocol::FieldChoice;
using protocol::Range;
using protocol::View;

Result<void> check_map(const std::string& name, const std::string& pointer) {
  if (!has_color_map(name)) {
    return invalid_at(pointer, "unknown colour map " + in_double_quotes(name));
  }
  return {};
}

Result<void> check_color(const std::string& text, const std::string& pointer) {
  if (!parse_color(text)) {
    return invalid_at(pointer, in_double_quotes(text) + " is not of the form #rrggbb");
  }
  return {};
}

Result<void> check_color_range(const std::optional<Range>& range, const std::string& pointer) {
  if (range && (*range)[0] == (*range)[1]) return invalid_at(pointer, "both ends are equal");
  return {};
}

Result<void> choose_vector_field(View& view, const data::DatasetInfo& info) {
  FieldChoice& choice = view.vector.field;
  if (choice.kind == FieldChoice::Kind::named) {
    auto field = find_field(info, choice.name, data::FieldKind::vector, "/vector/field");
    if (!field) return field.error();
    return {};
  }
  if (choice.kind == FieldChoice::Kind::none) return {};
  const data::FieldInfo* first = default_vector(info);
  choice = first == nullptr ? FieldChoice{FieldChoice::Kind::none, ""}
                            : FieldChoice{FieldChoice::Kind::named, first->name};
  return {};
}

Result<void> check_color_field(const protocol::VectorColorView& color,
                               const data::DatasetInfo& info) {
  const std::string pointer = "/vector/color/field";
  if (color.field) {
    auto field = find_field(info, *color.field, data::FieldKind::scalar, pointer);
    if (!field) return field.error();
  } else if (color.by == ColorBy::scalar) {
    return invalid_at(pointer, "is required for colour by scalar: the name of a scalar field");
  }
  return {};
}

Result<void> check_vector(const protocol::VectorView& vector) {
  if (auto ok = check_map(vector.color.map, "/vector/color/map"); !ok) return ok;
  if (auto ok = check_color(vector.color.constant, "/vector/color/constant"); !ok) return ok;
  if (auto ok = check_color_range(vector.color.range, "/vector/color/range"); !ok) return ok;
  if (vector.r1 > vector.r2) return invalid_at("/vector/r1", "is greater than r2");
  return {};
}

// Between closer points single precision, of which values and slopes are, does not suffice.
constexpr double extinction_gap_min = 1e-30;

Result<void> check_extinction(const protocol::ScalarView& scalar, const std::string& pointer) {
  if (!scalar.extinction) return {};
  for (std::size_t n = 0; n < scalar.extinction->size(); ++n) {
    const auto& point = (*scalar.extinction)[n];
    const std::string at = pointer + "/extinction/" + std::to_string(n);
    if (!std::isfinite(point[0]) || !(point[1] >= 0)) {
      return invalid_at(at, "must be a finite value and an extinction of at least 0");
    }
    if (n > 0 && point[0] < (*scalar.extinction)[n - 1][0]) {
      return invalid_at(at, "its value is less than the previous one");
    }
    const double gap = n > 0 ? point[0] - (*scalar.extinction)[n - 1][0] : 0;
    if (gap > 0 && gap < extinction_gap_min) {
      return invalid_at(at,
                        "its value is less than 1e-30 above the previous one: two equal values "
                        "form a step");
    }
  }
  return {};
}

// Completes the style of a medium and checks it; needs no data.
Result<void> outline_scalar(protocol::ScalarView& scalar, const std::string& pointer,
                            bool difference, const data::DatasetInfo& info) {
  const auto field = find_field(info, scalar.field, data::FieldKind::scalar, pointer + "/field");
  if (!field) return field.error();
  if (!scalar.color.map) {
    scalar.color.map = difference ? difference_map : default_map(**field, info);
  }
  if (auto ok = check_map(*scalar.color.map, pointer + "/color/map"); !ok) return ok;
  if (auto ok = check_color_range(scalar.color.range, pointer + "/color/range"); !ok) return ok;
  return check_extinction(scalar, pointer);
}

Result<void> outline_scalars(View& view, const data::DatasetInfo& info) {
  if (!view.scalars) {
    view.scalars.emplace();
    for (const std::string& name : default_scalars(info)) {
      view.scalars->emplace_back().field = name;
    }
  }
  for (std::size_t n = 0; n < view.scalars->size(); ++n) {
    auto ok = outline_scalar((*view.scalars)[n], "/scalars/" + std::to_string(n),
                             view.difference.has_value(), info);
    if (!ok) return ok;
  }
  return {};
}

// Checks that need neither data nor a placement.
Result<void> check(const View& view, const data::DatasetInfo& info) {
  if (view.step < 0 || static_cast<std::size_t>(view.step) >= info.steps.size()) {
    return invalid_at("/step", "dataset " + in_double_quotes(info.id) + " has steps 0 to " +
                                   std::to_string(info.steps.size() - 1));
  }
  if (auto ok = check_color(view.image.background, "/image/background"); !ok) return ok;
  if (auto ok = check_ground(view.ground); !ok) return ok;
  if (auto ok = check_vector(view.vector); !ok) return ok;
  if (view.depth_cue.near >= view.depth_cue.far) {
    return invalid_at("/depthCue/near", "is not less than far");
  }
  for (std::size_t n = 0; n < view.region.where.size(); ++n) {
    const auto field = find_field(info, view.region.where[n].field, data::FieldKind::scalar,
                                  "/region/where/" + std::to_string(n) + "/field");
    if (!field) return field.error();
  }
  if (auto ok = check_surfaces(view, info); !ok) return ok;
  return check_geometry(view.geometry, info);
}

// The first pass: camera, fields and styles, as determined by description and placement.
Result<Camera> complete_from_description(View& view, const data::DatasetInfo& info,
                                         const Lattice& lattice) {
  complete_camera(view, lattice);
  auto camera = resolve_camera(view, lattice);
  if (!camera) return camera;
  protocol::VectorView& vector = view.vector;
  if (auto ok = choose_vector_field(view, info); !ok) return ok.error();
  if (vector.trace && (view.geometry.slice || view.geometry.plane)) {
    return invalid_at("/vector/trace",
                      "streamlets leave a slice or plane: set it to null, or vector.trace");
  }
  if (!vector.length || !vector.stride) {
    const LineSpacing spacing = spacing_of(view.geometry, lattice);
    if (!vector.length) vector.length = spacing.length;
    if (!vector.stride) vector.stride = spacing.stride;
  }
  if (vector.trace && vector.trace->seeds) {
    const std::int64_t seeds = seeds_in(*vector.trace->seeds);
    if (seeds > protocol::limits::seeds_max) {
      return invalid_at("/vector/trace/seeds", "has " + std::to_string(seeds) +
                                                   " seeds; the limit is " +
                                                   std::to_string(protocol::limits::seeds_max));
    }
  }
  if (vector.trace && vector.mark.shape == protocol::MarkShape::arrow) {
    return invalid_at("/vector/mark/shape",
                      "traced lines have no arrow heads: use \"taper\" or \"comet\", or set "
                      "vector.trace to null");
  }
  if (const auto& range = vector.magnitude_range; range && !((*range)[0] < (*range)[1])) {
    return invalid_at("/vector/magnitudeRange", "does not ascend");
  }
  if (auto ok = check_color_field(vector.color, info); !ok) return ok.error();
  if (!vector.color.by) {
    vector.color.by = view.difference
                          ? ColorBy::magnitude
                          : default_color_by(info.grid, slice_of(view.geometry, lattice));
  }
  complete_heads(vector, view.image.background);
  if (auto ok = outline_scalars(view, info); !ok) return ok.error();
  return camera;
}

// Errors: invalid at /geometry/plane, or a slice beyond the region.
Result<void> check_section(const View& view, const Lattice& lattice) {
  if (const auto& slice = view.geometry.slice) {
    const auto axis = static_cast<std::size_t>(slice->axis);
    const double index = slice_index(*slice, lattice);
    if (!(index >= 0 && index <= lattice.dims[axis] - 1)) {
      return invalid_at("/geometry/slice/index",
                        "the region keeps layers " + std::to_string(lattice.first[axis]) + " to " +
                            std::to_string(lattice.first[axis] + lattice.dims[axis] - 1));
    }
  }
  if (!is_section(view.geometry)) return {};
  const auto section = make_section(view.geometry, lattice);
  return section ? Result<void>() : section.error();
}

// Of a store that exceeds the memory, lines are drawn from what it has of them.
void set_stored_stride(View& view, const Lattice& lattice, const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  if (view.vector.stride || info.stored == nullptr || dataset.subtrahend()) return;
  const FieldChoice& choice = view.vector.field;
  if (choice.kind == FieldChoice::Kind::none) return;
  const data::FieldInfo* const field =
      choice.kind == FieldChoice::Kind::named ? info.find(choice.name) : default_vector(info);
  if (field == nullptr) return;
  const int stride = spacing_of(view.geometry, lattice).stride;
  const int stored = stored_stride(stride, field->name, dataset);
  if (stored != stride) view.vector.stride = stored;
}

std::atomic<std::uint64_t> completed_views{0};

}  // namespace

Result<void> CompletedView::resolve() {
  auto camera = resolve_camera(view_, placed_->lattice);
  if (!camera) return camera.error();
  camera_ = *camera;
  return {};
}

Result<CompletedView> complete(const View& view, data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  View full = view;
  if (full.dataset.empty()) full.dataset = info.id;
  if (auto ok = check(full, info); !ok) return ok.error();
  if (auto ok = check_difference(full, dataset); !ok) return ok.error();
  auto placed = place_dataset(full.geometry, dataset, full.region);
  if (!placed) return placed.error();
  const Lattice& lattice = (*placed)->lattice;
  if (auto ok = check_section(full, lattice); !ok) return ok.error();
  set_stored_stride(full, lattice, dataset);
  const auto camera = complete_from_description(full, info, lattice);
  if (!camera) return camera.error();
  if (auto ok = complete_from_data(full, *camera, **placed, dataset); !ok) return ok.error();
  ++completed_views;
  return CompletedView(std::move(full), std::move(*placed), *camera);
}

std::uint64_t completions() { return completed_views; }

Result<ViewOutline> outline(const View& view, const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  ViewOutline out;
  out.view = view;
  if (auto ok = check(view, info); !ok) return ok.error();
  out.bent = is_bent(view.geometry);
  // Mapping the grid takes a long time and may read a field.
  out.view.geometry.mapping = protocol::GeometryMapping::flat;
  out.view.geometry.height_field.reset();
  auto lattice = place_lattice(info.grid, out.view.geometry);
  if (!lattice) return lattice.error();
  out.lattice = std::move(*lattice);
  if (is_cropped(view.region)) {
    // Columns are sought with the data.
    protocol::RegionView ranges;
    ranges.x = view.region.x;
    ranges.y = view.region.y;
    ranges.z = view.region.z;
    auto crop = crop_of(ranges, info.grid, 0);
    if (!crop) return crop.error();
    auto whole = std::make_shared<Placed>();
    whole->grid = info.grid;
    whole->lattice = std::move(out.lattice);
    out.lattice = cropped_place(whole, ranges, std::move(*crop)).lattice;
  }
  if (auto ok = check_section(out.view, out.lattice); !ok) return ok.error();
  set_stored_stride(out.view, out.lattice, dataset);
  const auto camera = complete_from_description(out.view, info, out.lattice);
  if (!camera) return camera.error();
  out.camera = *camera;
  return out;
}

Result<std::string> hidden_vectors(const protocol::View& view, data::Dataset& dataset) {
  constexpr double told_least = 0.01;
  const protocol::VectorView& vector = view.vector;
  const double least = vector.min_magnitude.value_or(0);
  if (vector.field.kind != FieldChoice::Kind::named || !(least > 0)) return std::string();
  const auto share = from_first_step(
      dataset, "hidden", vector.field.name, {least},
      [&](const DefaultSamples& of) { return std::vector{hidden_share(least, *of.volume)}; });
  if (!share) return share.error();
  if (share->front() < told_least) return std::string();
  const auto step = step_with_values(dataset, vector.field.name);
  if (!step) return step.error();
  std::ostringstream text;
  text << std::setprecision(3) << "the default view shows no vectors of "
       << in_quotes(vector.field.name) << " shorter than " << least;
  const data::FieldInfo* const field = dataset.info().find(vector.field.name);
  if (field != nullptr && !field->units.empty()) text << ' ' << printable(field->units, 80);
  text << " (/vector/minMagnitude): about " << std::lround(100 * share->front())
       << " % of those at " << (*step == 0 ? "the first step" : "step " + std::to_string(*step));
  return text.str();
}

}  // namespace windsplat::scene
