// Fields -> triangles, by the extraction of server/surface; colour maps and widths.
#include "server/scene/surfaces/make_surfaces.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <iomanip>
#include <memory>
#include <sstream>
#include <utility>

#include "server/base/thread_pool.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/place.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/region/crop.hpp"

namespace windsplat::scene {

namespace {

using protocol::SurfaceView;

constexpr int map_entries = 256;
constexpr double contours_height = 720;  // pixels, for which a view gives the width of contours
constexpr double isosurface_ambient = 0.3;

std::string pointer_of(std::size_t surface, const char* key = "") {
  return "/surfaces/" + std::to_string(surface) + key;
}

Result<void> check_surface(const SurfaceView& surface, std::size_t n,
                           const data::DatasetInfo& info) {
  auto field = find_field(info, surface.field, data::FieldKind::scalar, pointer_of(n, "/field"));
  if (!field) return field.error();
  if (surface.color.field) {
    auto colors = find_field(info, *surface.color.field, data::FieldKind::scalar,
                             pointer_of(n, "/color/field"));
    if (!colors) return colors.error();
  }
  if (!has_color_map(surface.color.map)) {
    return invalid_at(pointer_of(n, "/color/map"),
                      "unknown colour map " + in_double_quotes(surface.color.map));
  }
  if (!parse_color(surface.color.constant)) {
    return invalid_at(pointer_of(n, "/color/constant"),
                      in_double_quotes(surface.color.constant) + " is not of the form #rrggbb");
  }
  if (surface.contours && !parse_color(surface.contours->line_color)) {
    return invalid_at(
        pointer_of(n, "/contours/lineColor"),
        in_double_quotes(surface.contours->line_color) + " is not of the form #rrggbb");
  }
  const std::array<int, 3> dims = info.grid.dims();
  for (const int samples : dims) {
    if (samples < 2) {
      return invalid_at(pointer_of(n), "requires a grid of at least two samples along every axis");
    }
  }
  if (surface.slice) {
    const int last = dims.at(static_cast<std::size_t>(surface.slice->axis)) - 1;
    if (!(surface.slice->index <= last)) {
      return invalid_at(pointer_of(n, "/slice/index"),
                        "the grid has layers 0 to " + std::to_string(last) + " across this axis");
    }
  }
  return {};
}

surface::Cut cut_of(const SurfaceView& from, const Lattice& lattice) {
  surface::Cut cut;
  if (from.isovalue) {
    cut.level = *from.isovalue;
  } else if (from.plane) {
    cut.kind = surface::Cut::Kind::plane;
    const auto& [px, py, pz] = from.plane->point;
    const auto& [nx, ny, nz] = from.plane->normal;
    cut.point = {px, py, pz};
    cut.normal = glm::normalize(glm::dvec3(nx, ny, nz));
    // Away from the middle of the box: samples in the plane are inside, so that one at the end of
    // the grid needs the others outside.
    const glm::dvec3 middle = 0.5 * (lattice.box_min + lattice.box_max);
    if (glm::dot(cut.point - middle, cut.normal) < 0) cut.normal = -cut.normal;
  } else {
    cut.kind = surface::Cut::Kind::layer;
    cut.axis = static_cast<int>(from.slice->axis);
    cut.index = slice_index(*from.slice, lattice);
  }
  return cut;
}

// Whatever the triangles and their values depend on.
std::string key_of(const SurfaceView& surface, const surface::Cut& cut, const protocol::View& view,
                   const data::Derivation& kept) {
  const protocol::GeometryView& geometry = view.geometry;
  std::ostringstream key;
  key << "surface " << view.step << ' ' << static_cast<int>(geometry.mapping) << ' '
      << static_cast<int>(geometry.vertical) << ' ' << static_cast<int>(cut.kind) << ' ' << cut.axis
      << std::hexfloat;
  for (const double scale : geometry.scale) key << ' ' << scale;
  for (const double number : {cut.level, cut.index, cut.point.x, cut.point.y, cut.point.z,
                              cut.normal.x, cut.normal.y, cut.normal.z}) {
    key << ' ' << number;
  }
  // Names may contain spaces, but no control characters.
  key << '\n'
      << geometry.height_field.value_or("") << '\n'
      << surface.field << '\n'
      << color_field_of(surface) << '\n'
      << kept.variant;
  return key.str();
}

surface::Samples samples_of(const Lattice& lattice) {
  surface::Samples samples;
  samples.dims = lattice.dims;
  for (std::size_t a = 0; a < 3; ++a) samples.positions.at(a) = lattice.positions.at(a).data();
  if (lattice.places) samples.places = lattice.places->data();
  samples.around = lattice.around;
  return samples;
}

Result<std::shared_ptr<const surface::Mesh>> mesh_of(const SurfaceView& from, std::size_t n,
                                                     const CompletedView& completed,
                                                     data::Dataset& dataset) {
  const auto step = static_cast<std::size_t>(completed.view().step);
  const Placed& placed = *completed.placed();
  for (const int count : placed.lattice.dims) {
    if (count < 2) {
      return invalid_at(pointer_of(n),
                        "requires at least two samples of the region along every axis");
    }
  }
  const auto filters = filters_of(completed.view().region, protocol::FilterOf::all);
  const data::Derivation kept_samples = kept_part(placed, 1, filters);
  auto volume = dataset.derived(from.field, step, kept_samples);
  if (!volume) return volume.error();
  std::shared_ptr<const data::Volume> colors;
  if (const std::string name = color_field_of(from); !name.empty()) {
    auto second = dataset.derived(name, step, kept_part(placed, 1, {}));
    if (!second) return second.error();
    colors = std::move(*second);
  }
  const surface::Samples samples = samples_of(completed.lattice());
  surface::Cut cut = cut_of(from, completed.lattice());
  if (cut.kind == surface::Cut::Kind::layer &&
      !(cut.index >= 0 && cut.index <= samples.dims.at(static_cast<std::size_t>(cut.axis)) - 1)) {
    return make_error_at(ErrorKind::invalid, pointer_of(n, "/slice/index"),
                         "is a layer that the region leaves out");
  }
  cut.values = (*volume)->component(0);
  const std::string key = key_of(from, cut, completed.view(), kept_samples);
  const CancelToken cancel = dataset.cancellation();
  const auto numbers = dataset.remembered(key, [&]() -> Result<std::vector<double>> {
    const auto pool = few_threads(static_cast<std::size_t>(samples.dims[2]));
    const surface::MeshSize size = surface::measure(samples, cut, *pool, cancel);
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "meshing cancelled");
    return std::vector{static_cast<double>(size.vertices), static_cast<double>(size.triangles)};
  });
  if (!numbers) return numbers.error();
  const surface::MeshSize size{static_cast<std::size_t>((*numbers)[0]),
                               static_cast<std::size_t>((*numbers)[1])};
  if (size.triangles > surface_triangles_max) {
    return make_error_at(ErrorKind::too_large, pointer_of(n),
                         "would have " + std::to_string(size.triangles) + " triangles; at most " +
                             std::to_string(surface_triangles_max) + " are drawn");
  }
  auto kept =
      dataset.auxiliary(key, size.bytes(colors != nullptr), [&]() -> Result<data::Resident> {
        const auto pool = few_threads(static_cast<std::size_t>(samples.dims[2]));
        auto made = std::make_shared<const surface::Mesh>(
            surface::extract(samples, cut, colors ? colors->component(0) : nullptr, *pool, cancel));
        if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "meshing cancelled");
        return data::Resident(std::move(made));
      });
  if (!kept) return kept.error();
  return std::static_pointer_cast<const surface::Mesh>(*kept);
}

std::string number_text(double value) {
  std::ostringstream text;
  text << std::setprecision(4) << value;
  return text.str();
}

// Of a surface without triangles.
std::string why_none(const SurfaceView& surface, std::size_t n, const protocol::View& view,
                     const data::Volume& volume) {
  const std::string name = in_double_quotes(surface.field);
  const std::string part = view.region == protocol::RegionView{} ? "" : " in the region";
  const std::string left_out = view.region.where.empty() ? "" : ", or left out by /region/where";
  if (volume.masked == static_cast<std::int64_t>(volume.samples())) {
    return pointer_of(n) + ": every sample of " + name + part + " is masked at step " +
           std::to_string(view.step) + left_out;
  }
  const auto least = static_cast<double>(volume.range[0]);
  const auto most = static_cast<double>(volume.range[1]);
  if (surface.isovalue && !(*surface.isovalue >= least && *surface.isovalue <= most)) {
    return pointer_of(n, "/isovalue") + " " + number_text(*surface.isovalue) +
           " is beyond the values of " + name + part + ", " + number_text(least) + " to " +
           number_text(most);
  }
  if (surface.isovalue) {
    return pointer_of(n, "/isovalue") + " " + number_text(*surface.isovalue) + ": " + name +
           " does not cross it between samples that are not masked" + left_out;
  }
  return pointer_of(n) + ": the section lies outside the data" + part + ", or where " + name +
         " is masked at step " + std::to_string(view.step) + left_out;
}

}  // namespace

Result<void> check_surfaces(const protocol::View& view, const data::DatasetInfo& info) {
  for (std::size_t n = 0; n < view.surfaces.size(); ++n) {
    if (auto ok = check_surface(view.surfaces[n], n, info); !ok) return ok;
  }
  return {};
}

std::string color_field_of(const SurfaceView& surface) {
  if (surface.color.field) return *surface.color.field;
  return surface.isovalue ? "" : surface.field;
}

bool is_seen(const SurfaceView& surface) { return surface.opacity > 0 || surface.contours; }

std::vector<std::string> surface_fields(const protocol::View& view) {
  std::vector<std::string> fields;
  for (const SurfaceView& surface : view.surfaces) {
    fields.push_back(surface.field);
    if (surface.color.field) fields.push_back(*surface.color.field);
  }
  return fields;
}

std::vector<std::pair<std::string, data::Derivation>> needed_by_surfaces(
    const CompletedView& completed) {
  const Placed& placed = *completed.placed();
  const auto filters = filters_of(completed.view().region, protocol::FilterOf::all);
  std::vector<std::pair<std::string, data::Derivation>> needed;
  for (const SurfaceView& surface : completed.view().surfaces) {
    if (!is_seen(surface)) continue;
    needed.emplace_back(surface.field, kept_part(placed, 1, filters));
    const std::string colors = color_field_of(surface);
    if (!colors.empty()) needed.emplace_back(colors, kept_part(placed, 1, {}));
  }
  return needed;
}

Result<std::vector<std::string>> why_no_surfaces(const CompletedView& completed,
                                                 data::Dataset& dataset) {
  const protocol::View& view = completed.view();
  const auto filters = filters_of(view.region, protocol::FilterOf::all);
  std::vector<std::string> reasons;
  for (std::size_t n = 0; n < view.surfaces.size(); ++n) {
    const SurfaceView& from = view.surfaces[n];
    if (!is_seen(from)) continue;
    const auto mesh = mesh_of(from, n, completed, dataset);
    if (!mesh) return mesh.error();
    if (!(*mesh)->triangles.empty()) continue;
    const auto volume = dataset.derived(from.field, static_cast<std::size_t>(view.step),
                                        kept_part(*completed.placed(), 1, filters));
    if (!volume) return volume.error();
    reasons.push_back(why_none(from, n, view, **volume));
  }
  return reasons;
}

Result<std::vector<surface::Shown>> make_surfaces(const CompletedView& completed,
                                                  data::Dataset& dataset) {
  const protocol::View& view = completed.view();
  std::vector<surface::Shown> all;
  for (std::size_t n = 0; n < view.surfaces.size(); ++n) {
    const SurfaceView& from = view.surfaces[n];
    if (!is_seen(from)) continue;
    auto mesh = mesh_of(from, n, completed, dataset);
    if (!mesh) return mesh.error();
    surface::Shown shown;
    shown.mesh = std::move(*mesh);
    shown.opacity = from.opacity;
    shown.ambient = from.isovalue ? isosurface_ambient : 1;
    if (color_field_of(from).empty()) {
      shown.colors = {parse_color(from.color.constant).value()};
    } else {
      const protocol::Range& range = from.color.range.value();
      shown.colors = color_map_linear(from.color.map, map_entries);
      shown.range = range;
      if (range[0] > range[1]) {
        std::swap(shown.range[0], shown.range[1]);
        std::reverse(shown.colors.begin(), shown.colors.end());
      }
    }
    if (from.contours) {
      shown.contours = {from.contours->interval.value_or(0),
                        from.contours->line_width * view.image.height / contours_height,
                        parse_color(from.contours->line_color).value(), from.contours->levels};
    }
    all.push_back(std::move(shown));
  }
  return all;
}

}  // namespace windsplat::scene
