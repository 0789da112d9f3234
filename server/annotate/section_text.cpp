#include "server/annotate/section_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "server/annotate/axes.hpp"
#include "server/annotate/labels.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/place.hpp"

namespace windsplat::annotate {
namespace {

using data::AxisKind;

constexpr double coordinate_rounding = 1e-9;

// The value between neighbours of a list at an index that need not be whole.
double at_index(const std::vector<double>& values, double index) {
  const double last = static_cast<double>(values.size()) - 1;
  const double at = std::clamp(index, 0.0, last);
  const auto low = static_cast<std::size_t>(at);
  const double part = at - std::floor(at);
  return part > 0 ? values[low] + part * (values[low + 1] - values[low]) : values[low];
}

// Degrees in as few decimals as they have, at most three.
std::string degrees_text(const data::Axis& axis, double value) {
  double step = 1;
  for (int decimals = 0; decimals < 3; ++decimals, step /= 10) {
    if (std::abs(std::remainder(value, step)) <= 1e-6 * step) break;
  }
  return coordinate_text(axis, value, step);
}

// "500 hPa", "45°N", "y = 12 km". letter: of the axis.
std::string place_text(const data::Axis& axis, double value, char letter) {
  constexpr int digits = 5;
  if (axis.kind == AxisKind::longitude || axis.kind == AxisKind::latitude) {
    return degrees_text(axis, value);
  }
  const std::string units = unit_text(axis.units);
  const std::string number = number_text_of(value, digits) + (units.empty() ? "" : " " + units);
  switch (axis.kind) {
    case AxisKind::pressure:
      return units.empty() ? "pressure " + number : number;
    case AxisKind::height:
      return "height " + number;
    case AxisKind::depth:
      return "depth " + number;
    default:
      break;
  }
  std::string name = axis.name.empty() ? std::string(1, letter) : axis.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  return name + " = " + number;
}

char letter_of(std::size_t axis) { return static_cast<char>('x' + axis); }

// Whether the columns of the grid, and not its rows and columns, have longitudes and latitudes.
bool has_columns(const Subject& subject, std::size_t axis) {
  return axis < 2 && subject.completed.placed()->grid.columns != nullptr;
}

// The coordinate of a world position along an axis; nullopt: the box has none.
std::optional<std::string> coordinate_at(const Subject& subject, std::size_t axis, double world) {
  // A map of columns is that of the ends of the box only.
  if (has_columns(subject, axis)) return std::nullopt;
  const auto map = axis_map(subject, axis);
  if (!map) return std::nullopt;
  const data::Axis drawn = drawn_axis(subject, axis);
  const double value = map->single() ? drawn.coordinates.front() : map->value(world);
  return place_text(drawn, value, letter_of(axis));
}

// The place of a plane nearest to the middle of the box, among those where it meets the box.
glm::dvec3 middle_of(const scene::Lattice& lattice, const glm::dvec3& point,
                     const glm::dvec3& normal) {
  const glm::dvec3 centre = 0.5 * (lattice.box_min + lattice.box_max);
  const glm::dvec3 nearest = centre - glm::dot(centre - point, normal) * normal;
  bool inside = true;
  for (int a = 0; a < 3; ++a) {
    inside = inside && nearest[a] >= lattice.box_min[a] && nearest[a] <= lattice.box_max[a];
  }
  const auto corners = scene::points_in_box(lattice, point, normal);
  if (inside || corners.empty()) return nearest;
  glm::dvec3 sum(0);
  for (const glm::dvec3& corner : corners) sum += corner;
  return sum / static_cast<double>(corners.size());
}

}  // namespace

std::string section_text(const Subject& subject, const protocol::SliceView& slice) {
  const auto axis = static_cast<std::size_t>(slice.axis);
  const scene::Placed& placed = *subject.completed.placed();
  const std::string at = "section at ";
  const data::Axis& own = subject.info.grid.axes.at(axis);
  const double last = static_cast<double>(own.coordinates.size()) - 1;
  const double index = std::clamp(slice.index, 0.0, last);
  const bool heights = axis == 2 && subject.completed.view().geometry.height_field;
  if (has_columns(subject, axis)) {
    return at + (axis == 0 ? "column i = " : "row j = ") + number_text_of(index, 5);
  }
  // Heights differ along a layer of levels that follow the terrain.
  if (heights) return at + place_text(own, at_index(own.coordinates, index), letter_of(axis));
  const double in_part = scene::slice_index(slice, placed.lattice);
  const auto& positions = placed.lattice.positions.at(axis);
  const bool contained = in_part >= 0 && in_part <= static_cast<double>(positions.size()) - 1;
  if (contained) {
    if (const auto text = coordinate_at(subject, axis, at_index(positions, in_part))) {
      return at + *text;
    }
  }
  return at + place_text(own, at_index(own.coordinates, index), letter_of(axis));
}

std::string section_text(const Subject& subject, const protocol::PlaneView& plane) {
  const scene::Lattice& lattice = subject.completed.lattice();
  const glm::dvec3 point(plane.point[0], plane.point[1], plane.point[2]);
  const glm::dvec3 normal =
      glm::normalize(glm::dvec3(plane.normal[0], plane.normal[1], plane.normal[2]));
  const bool vertical = std::abs(normal.z) <= coordinate_rounding;
  std::string kind = vertical ? "vertical section" : "oblique section";
  const bool bent = scene::is_bent(subject.completed.view().geometry);
  for (int a = 0; a < 3 && !bent; ++a) {
    if (std::abs(normal[a]) < 1 - coordinate_rounding) continue;
    const auto text = coordinate_at(subject, static_cast<std::size_t>(a), point[a]);
    return text ? "section at " + *text : kind;
  }
  if (bent) return kind;
  const glm::dvec3 place = middle_of(lattice, point, normal);
  std::string text;
  for (int a = 0; a < (vertical ? 2 : 3); ++a) {
    const auto one = coordinate_at(subject, static_cast<std::size_t>(a), place[a]);
    if (!one) return kind;
    text += (a == 0 ? " through " : ", ") + *one;
  }
  return kind + text;
}

std::optional<std::string> section_of_view(const Subject& subject) {
  const protocol::GeometryView& geometry = subject.completed.view().geometry;
  if (geometry.plane) return section_text(subject, *geometry.plane);
  if (geometry.slice) return section_text(subject, *geometry.slice);
  return std::nullopt;
}

}  // namespace windsplat::annotate
