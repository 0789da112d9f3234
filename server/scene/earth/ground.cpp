#include "server/scene/earth/ground.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/camera.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/refusal.hpp"

namespace windsplat::scene {

namespace {

using data::AxisKind;
using protocol::GeometryMapping;

// The sphere lies slightly inside the lowest cells, so that lines in them are not cut off.
constexpr double globe_share = 0.999;

bool is_ascending(const std::vector<double>& positions) {
  return positions.size() > 1 && std::is_sorted(positions.begin(), positions.end()) &&
         positions.back() > positions.front();
}

// A map places columns linearly by their degrees: the outermost two tell how.
std::optional<ground::Axis> axis_of_columns(const Lattice& lattice,
                                            const std::vector<double>& degrees, std::size_t axis) {
  const auto [low, high] = std::minmax_element(degrees.begin(), degrees.end());
  const auto position = [&](std::vector<double>::const_iterator at) {
    const auto column = static_cast<std::size_t>(at - degrees.begin());
    return static_cast<double>((*lattice.places)[column].at(axis));
  };
  ground::Axis of{{*low, *high}, {position(low), position(high)}};
  if (!is_ascending(of.positions)) return std::nullopt;
  return of;
}

std::shared_ptr<const ground::Map> map_of_axes(std::optional<ground::Axis> x,
                                               std::optional<ground::Axis> y) {
  if (!x || !y) return nullptr;
  return std::make_shared<ground::AxesMap>(std::move(*x), std::move(*y));
}

// Where the line of sight through the middle of the picture meets the ground, or comes nearest to
// it.
glm::dvec3 middle_of(const Camera& camera, const Lattice& lattice, bool sphere) {
  if (sphere) {
    const double along = -glm::dot(camera.eye, camera.forward);
    const glm::dvec3 nearest = camera.eye + along * camera.forward;
    const double radius = lattice.inner_radius;
    const double inside = radius * radius - glm::dot(nearest, nearest);
    return inside > 0 ? nearest - std::sqrt(inside) * camera.forward
                      : radius * glm::normalize(nearest);
  }
  const double depth = (lattice.box_min.z - camera.eye.z) / camera.forward.z;
  const glm::dvec3 at = camera.eye + depth * camera.forward;
  const bool seen = depth > 0 && at.x > lattice.box_min.x && at.x < lattice.box_max.x &&
                    at.y > lattice.box_min.y && at.y < lattice.box_max.y;
  if (seen) return at;
  const glm::dvec3 centre = 0.5 * (lattice.box_min + lattice.box_max);
  return {centre.x, centre.y, lattice.box_min.z};
}

// The least of the steps that keeps lines this far apart at that place, in degrees.
double graticule_step(const Camera& camera, const ground::Map& map, const glm::dvec3& at) {
  constexpr std::array<double, 5> steps{1, 2, 5, 10, 30};
  constexpr double apart = 60;  // pixels at the reference height
  const double pixel = 2 * camera.half_height / camera.height;
  const double depth = std::max(glm::dot(at - camera.eye, camera.forward), camera.near);
  const double size = camera.perspective ? pixel * depth : pixel;
  const double least =
      apart * camera.height / reference_height * size * glm::length(map.locate(at).north);
  const auto* const found =
      std::find_if(steps.begin(), steps.end(), [&](double step) { return step >= least; });
  return found == steps.end() ? steps.back() : *found;
}

ground::Color color_of(const std::string& text) {
  const auto linear = parse_color(text).value();
  return {linear[0], linear[1], linear[2]};
}

std::shared_ptr<const ground::Paint> paint_of(const protocol::View& view, const Camera& camera,
                                              const Placed& placed) {
  const protocol::GroundView& ground = view.ground;
  if (!ground.tint && !ground.coastlines && !ground.borders && !ground.graticule) return nullptr;
  auto map = map_of(view.geometry, placed);
  if (!map) return nullptr;
  ground::Style style;
  style.land = color_of(ground.tint ? ground.land_color : ground.surface_color);
  style.sea = color_of(ground.tint ? ground.sea_color : ground.surface_color);
  style.line = color_of(ground.line_color);
  style.coastlines = ground.coastlines;
  style.borders = ground.borders;
  style.scale = camera.height / reference_height;
  if (ground.graticule) {
    const bool sphere = view.geometry.mapping == GeometryMapping::sphere;
    style.graticule = graticule_step(camera, *map, middle_of(camera, placed.lattice, sphere));
  }
  return std::make_shared<ground::Paint>(std::move(map), style);
}

// Whether levels lie below the level of the sea, where coasts are: by the kind of the vertical
// axis, the names of CF for levels of oceans, or negative heights.
bool is_below_sea(const data::Axis& vertical) {
  if (vertical.kind == AxisKind::depth) return true;
  if (vertical.standard_name.rfind("ocean_", 0) == 0) return true;
  const auto& heights = vertical.coordinates;
  return vertical.kind == AxisKind::height && !heights.empty() &&
         std::min(heights.front(), heights.back()) < 0;
}

// Beneath data of the Earth, seen from above: a map below one layer, below levels of the
// atmosphere, and below lines in a sea. A medium alone shows where land is by its gaps, beside
// which coasts at the floor would be others. An eye below the ground would see nothing else.
bool is_ground_by_default(const protocol::View& view, const Camera& camera, const Placed& placed) {
  const Lattice& lattice = placed.lattice;
  const protocol::GeometryView& geometry = view.geometry;
  const bool below = camera.perspective ? camera.eye.z < lattice.box_min.z : camera.forward.z > 0;
  if (below || !map_of(geometry, placed)) return false;
  const bool one_layer =
      lattice.dims[2] == 1 || (geometry.slice && geometry.slice->axis == protocol::GridAxis::z);
  const bool lines = view.vector.field.kind == protocol::FieldChoice::Kind::named;
  return one_layer || lines || !is_below_sea(placed.grid.axes[2]);
}

}  // namespace

std::shared_ptr<const ground::Map> map_of(const protocol::GeometryView& geometry,
                                          const Placed& placed) {
  const Lattice& lattice = placed.lattice;
  const auto& axes = placed.grid.axes;
  const auto& columns = placed.grid.columns;
  if (geometry.mapping == GeometryMapping::sphere) return std::make_shared<ground::Globe>();
  if (geometry.mapping == GeometryMapping::curvilinear) {
    if (!columns) return nullptr;
    return map_of_axes(axis_of_columns(lattice, columns->longitude, 0),
                       axis_of_columns(lattice, columns->latitude, 1));
  }
  if (!is_ascending(lattice.positions[0]) || !is_ascending(lattice.positions[1])) return nullptr;
  if (columns) {
    using Values = std::shared_ptr<const std::vector<double>>;
    return std::make_shared<ground::ColumnsMap>(
        ground::Columns{lattice.positions[0], lattice.positions[1],
                        Values(columns, &columns->longitude), Values(columns, &columns->latitude)});
  }
  if (axes[0].kind != AxisKind::longitude || axes[1].kind != AxisKind::latitude) return nullptr;
  return map_of_axes(ground::Axis{axes[0].coordinates, lattice.positions[0]},
                     ground::Axis{axes[1].coordinates, lattice.positions[1]});
}

Result<std::optional<Body>> make_body(const protocol::View& view, const Camera& camera,
                                      const Placed& placed, data::Dataset& dataset) {
  const Lattice& lattice = placed.lattice;
  const bool sphere = view.geometry.mapping == GeometryMapping::sphere;
  const bool asked = view.ground.show == protocol::GroundShow::on;
  const bool automatic = view.ground.show == protocol::GroundShow::automatic;
  const bool shown = asked || (automatic && (sphere || is_ground_by_default(view, camera, placed)));
  if (!shown) return std::optional<Body>();
  Body body;
  // Not by default: moving frames cannot afford its rays.
  if (asked) {
    auto terrain = terrain_of(view.geometry, placed, dataset);
    if (!terrain) return terrain.error();
    body.terrain = std::move(*terrain);
  }
  body.shape = sphere ? BodyShape::sphere : body.terrain ? BodyShape::terrain : BodyShape::ground;
  body.radius = globe_share * lattice.inner_radius;
  body.low = {lattice.box_min.x, lattice.box_min.y};
  body.high = {lattice.box_max.x, lattice.box_max.y};
  body.height = lattice.box_min.z;
  body.color = parse_color(view.ground.surface_color).value();
  body.paint = paint_of(view, camera, placed);
  return std::optional(std::move(body));
}

Result<void> check_ground(const protocol::GroundView& ground) {
  const std::array<std::pair<const std::string&, const char*>, 4> colors{
      {{ground.surface_color, "/ground/surfaceColor"},
       {ground.land_color, "/ground/landColor"},
       {ground.sea_color, "/ground/seaColor"},
       {ground.line_color, "/ground/lineColor"}}};
  for (const auto& [color, pointer] : colors) {
    if (!parse_color(color)) {
      return invalid_at(pointer, in_double_quotes(color) + " is not of the form \"#rrggbb\"");
    }
  }
  return {};
}

}  // namespace windsplat::scene
