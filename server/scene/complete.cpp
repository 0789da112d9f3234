// View -> the same view with every default of its dataset filled in. What the user said stays as it
// was said; a complete view passes through unchanged and loads nothing.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "server/data/model/digest.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/refusal.hpp"

namespace windsplat::scene {

namespace {

using protocol::ColorBy;
using protocol::FieldChoice;
using protocol::Range;
using protocol::View;

Result<void> check_map(const std::string& name, const std::string& pointer) {
  if (!has_color_map(name)) {
    return invalid_at(pointer, "no colour map is called " + in_double_quotes(name));
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
  if (range && (*range)[0] == (*range)[1]) return invalid_at(pointer, "its two ends are equal");
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
  const data::FieldInfo* first = info.first(data::FieldKind::vector);
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
    return invalid_at(pointer, "is needed for colour by scalar: the name of a scalar field");
  }
  return {};
}

// Numbers that follow from a field at the first step and from `arguments`: made once, so that later
// steps do not need the first one resident.
template <class Make>
Result<std::vector<double>> from_first_step(data::Dataset& dataset, const char* what,
                                            const std::string& field,
                                            const std::vector<double>& arguments,
                                            const Make& make) {
  std::string key = what;
  key += '/' + field + '/';
  key += data::digest_of(
      {reinterpret_cast<const char*>(arguments.data()), arguments.size() * sizeof(double)});
  return dataset.remembered(key, [&]() -> Result<std::vector<double>> {
    auto volume = dataset.volume(field, 0);
    if (!volume) return volume.error();
    return make(**volume);
  });
}

std::vector<double> numbers_of(const Range& range) { return {range.begin(), range.end()}; }

// What placement and slice say, for a key.
std::vector<double> numbers_of(const Lattice& lattice, const std::optional<Slice>& slice) {
  std::vector<double> out{slice ? slice->axis + 1.0 : 0.0,
                          slice ? static_cast<double>(slice->sample) : 0.0};
  for (int a = 0; a < 3; ++a) {
    out.push_back(lattice.box_min[a]);
    out.push_back(lattice.box_max[a]);
  }
  out.insert(out.end(), lattice.positions[2].begin(), lattice.positions[2].end());
  return out;
}

Result<void> complete_magnitudes(View& view, const Lattice& lattice,
                                 const std::optional<Slice>& slice, data::Dataset& dataset) {
  protocol::VectorView& vector = view.vector;
  const bool named = vector.field.kind == FieldChoice::Kind::named;
  const std::string& field = vector.field.name;
  if (!vector.magnitude_range && named) {
    const auto range = from_first_step(
        dataset, "magnitudes", field, {},
        [](const data::Volume& volume) { return numbers_of(default_magnitude_range(volume)); });
    if (!range) return range.error();
    vector.magnitude_range = Range{(*range)[0], (*range)[1]};
  }
  if (!vector.magnitude_range) vector.magnitude_range = Range{0, 1};
  const Range& range = *vector.magnitude_range;
  if (!(range[0] < range[1])) return invalid_at("/vector/magnitudeRange", "does not ascend");
  if (!vector.min_magnitude && named) {
    // Of the lines as they are by default: a view that changes one of their keys changes that
    // alone.
    protocol::VectorView plain;
    plain.length = default_length(lattice, plain.stride, slice);
    plain.magnitude_range = vector.magnitude_range;
    std::vector<double> arguments = numbers_of(lattice, slice);
    arguments.insert(arguments.end(), {range[0], range[1], *plain.length});
    const auto least = from_first_step(
        dataset, "least magnitude", field, arguments, [&](const data::Volume& volume) {
          return std::vector{default_min_magnitude(plain, volume, lattice, slice)};
        });
    if (!least) return least.error();
    vector.min_magnitude = least->front();
  }
  if (!vector.min_magnitude) vector.min_magnitude = 0.0;
  return {};
}

Result<void> check_vector(const protocol::VectorView& vector) {
  if (auto ok = check_map(vector.color.map, "/vector/color/map"); !ok) return ok;
  if (auto ok = check_color(vector.color.constant, "/vector/color/constant"); !ok) return ok;
  if (auto ok = check_color_range(vector.color.range, "/vector/color/range"); !ok) return ok;
  if (vector.r1 > vector.r2) return invalid_at("/vector/r1", "is greater than r2");
  return {};
}

Result<Range> first_scalar_range(const data::FieldInfo& field, data::Dataset& dataset) {
  const auto range = from_first_step(
      dataset, "range", field.name, {},
      [&](const data::Volume& volume) { return numbers_of(default_scalar_range(field, volume)); });
  if (!range) return range.error();
  return Range{(*range)[0], (*range)[1]};
}

// What the colour's value spans.
Result<Range> default_color_range(const View& view, const Lattice& lattice,
                                  const std::array<double, 2>& depths, data::Dataset& dataset) {
  const protocol::VectorView& vector = view.vector;
  const bool lines = vector.field.kind == FieldChoice::Kind::named;
  switch (*vector.color.by) {
    case ColorBy::world_z: {
      if (!lines) return height_range(lattice);
      std::vector<double> arguments = numbers_of(lattice, std::nullopt);
      arguments.push_back(*vector.min_magnitude);
      const auto range = from_first_step(
          dataset, "heights", vector.field.name, arguments, [&](const data::Volume& volume) {
            return numbers_of(default_height_range(vector, volume, lattice));
          });
      if (!range) return range.error();
      return Range{(*range)[0], (*range)[1]};
    }
    case ColorBy::screen_z:
      return Range{depths[0], depths[1]};
    case ColorBy::magnitude:
      return default_magnitude_colors(vector);
    case ColorBy::direction:
      return Range{0, 360};
    case ColorBy::scalar: {
      if (!lines) break;
      return first_scalar_range(*dataset.info().find(vector.color.field.value()), dataset);
    }
    case ColorBy::rise:
    case ColorBy::constant:
      break;
  }
  return Range{0, 1};
}

void complete_camera(View& view, const Lattice& lattice) {
  protocol::CameraView& camera = view.camera;
  if (camera.eye && camera.target && camera.height) return;
  View framed = view;
  const double azimuth = front_azimuth(lattice);
  orbit(framed, lattice, azimuth, default_elevation, 1);
  if (!camera.target) camera.target = framed.camera.target;
  const glm::dvec3 target((*camera.target)[0], (*camera.target)[1], (*camera.target)[2]);
  const OrbitFrame frame = orbit_frame(azimuth, default_elevation);
  const Framing framing = frame_box(lattice, frame, target, camera.fov_y, view.image);
  if (!camera.eye) {
    const glm::dvec3 eye = target - frame.forward * framing.distance;
    camera.eye = protocol::Vec3{eye.x, eye.y, eye.z};
  }
  if (!camera.height) camera.height = std::max(framing.height, 1e-6);
}

Result<void> check_extinction(const protocol::ScalarView& scalar, const std::string& pointer) {
  if (!scalar.extinction) return {};
  for (std::size_t n = 0; n < scalar.extinction->size(); ++n) {
    const auto& point = (*scalar.extinction)[n];
    const std::string at = pointer + "/extinction/" + std::to_string(n);
    if (!std::isfinite(point[0]) || !(point[1] >= 0)) return invalid_at(at, "is not an extinction");
    if (n > 0 && point[0] < (*scalar.extinction)[n - 1][0]) {
      return invalid_at(at, "its value is less than the one before it");
    }
  }
  return {};
}

Result<void> complete_scalar(protocol::ScalarView& scalar, const std::string& pointer,
                             const Lattice& lattice, const std::optional<Slice>& slice,
                             data::Dataset& dataset) {
  auto found =
      find_field(dataset.info(), scalar.field, data::FieldKind::scalar, pointer + "/field");
  if (!found) return found.error();
  const data::FieldInfo& field = **found;
  if (!scalar.color.map) scalar.color.map = scalar_style(field).map;
  if (auto ok = check_map(*scalar.color.map, pointer + "/color/map"); !ok) return ok;
  if (auto ok = check_color_range(scalar.color.range, pointer + "/color/range"); !ok) return ok;
  if (auto ok = check_extinction(scalar, pointer); !ok) return ok;
  if (scalar.color.range && scalar.extinction) return {};
  const auto range = first_scalar_range(field, dataset);
  if (!range) return range.error();
  if (!scalar.color.range) scalar.color.range = *range;
  if (!scalar.extinction) scalar.extinction = default_extinction(field, *range, lattice, slice);
  return {};
}

Result<void> complete_scalars(View& view, const Lattice& lattice, const std::optional<Slice>& slice,
                              data::Dataset& dataset) {
  if (!view.scalars) {
    view.scalars.emplace();
    for (const std::string& name : default_scalars(dataset.info())) {
      protocol::ScalarView scalar;
      scalar.field = name;
      view.scalars->push_back(std::move(scalar));
    }
  }
  for (std::size_t n = 0; n < view.scalars->size(); ++n) {
    auto ok = complete_scalar((*view.scalars)[n], "/scalars/" + std::to_string(n), lattice, slice,
                              dataset);
    if (!ok) return ok;
  }
  return {};
}

}  // namespace

Result<Completed> complete_and_place(const View& view, data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  View full = view;
  if (full.dataset.empty()) full.dataset = info.id;
  if (full.step < 0 || static_cast<std::size_t>(full.step) >= info.steps.size()) {
    return invalid_at("/step", "dataset " + in_double_quotes(info.id) + " has steps 0 to " +
                                   std::to_string(info.steps.size() - 1));
  }
  if (auto ok = check_color(full.image.background, "/image/background"); !ok) return ok.error();
  if (auto ok = check_vector(full.vector); !ok) return ok.error();
  if (full.depth_cue.near >= full.depth_cue.far) {
    return invalid_at("/depthCue/near", "is not less than far");
  }
  if (auto ok = check_geometry(full.geometry, info); !ok) return ok.error();
  auto placed = place_dataset(full.geometry, dataset);
  if (!placed) return placed.error();
  const Lattice* const lattice = &(*placed)->lattice;
  const std::optional<Slice> slice = slice_of(full.geometry);
  complete_camera(full, *lattice);
  auto camera = resolve_camera(full, *lattice);
  if (!camera) return camera.error();
  if (auto ok = choose_vector_field(full, info); !ok) return ok.error();
  protocol::VectorView& vector = full.vector;
  if (!vector.length) vector.length = default_length(*lattice, 1, slice);
  if (auto ok = complete_magnitudes(full, *lattice, slice, dataset); !ok) return ok.error();
  if (auto ok = check_color_field(vector.color, info); !ok) return ok.error();
  if (!vector.color.by) vector.color.by = default_color_by(info.grid);
  if (!vector.color.range) {
    auto range = default_color_range(full, *lattice, view_depths(*camera, *lattice), dataset);
    if (!range) return range.error();
    vector.color.range = *range;
  }
  if (auto ok = complete_scalars(full, *lattice, slice, dataset); !ok) return ok.error();
  return Completed{std::move(full), std::move(*placed)};
}

std::vector<std::string> fields_of(const View& view, const data::DatasetInfo& info) {
  std::vector<std::string> fields;
  const auto add = [&](const std::string& name) {
    const bool is_known = std::find(fields.begin(), fields.end(), name) != fields.end();
    if (!is_known && info.find(name) != nullptr) fields.push_back(name);
  };
  const FieldChoice& lines = view.vector.field;
  if (lines.kind == FieldChoice::Kind::named) add(lines.name);
  if (lines.kind == FieldChoice::Kind::dataset_default) {
    const data::FieldInfo* const first = info.first(data::FieldKind::vector);
    if (first != nullptr) add(first->name);
  }
  if (view.vector.color.by == ColorBy::scalar && view.vector.color.field) {
    add(*view.vector.color.field);
  }
  if (view.scalars) {
    for (const protocol::ScalarView& scalar : *view.scalars) add(scalar.field);
  } else {
    for (const std::string& name : default_scalars(info)) add(name);
  }
  if (view.geometry.height_field) add(*view.geometry.height_field);
  return fields;
}

Result<View> complete_view(const View& view, data::Dataset& dataset) {
  auto completed = complete_and_place(view, dataset);
  if (!completed) return completed.error();
  return std::move(completed->view);
}

Result<View> default_view(data::Dataset& dataset) {
  View view;
  view.dataset = dataset.info().id;
  return complete_view(view, dataset);
}

}  // namespace windsplat::scene
