// Grid + geometry -> Lattice: coordinates -> raw positions -> cells -> a box whose longest edge is
// 2. Curved lattices continue in bend.cpp.
#include "server/scene/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

#include "server/data/cf/fields/atmosphere.hpp"
#include "server/data/cf/units.hpp"
#include "server/scene/angles.hpp"
#include "server/scene/bend.hpp"

namespace windsplat::scene {

namespace {

using data::Axis;
using data::AxisKind;
using protocol::VerticalPlacement;

constexpr double box_edge = 2.0;  // length of the longest edge, world units
// Widest cell of any axis over the narrowest. Kernels of 64 samples along one axis are up to 64
// times as flat; the engine is exact up to 1e9 (tests/numerics/truth/aspect_test.cpp).
constexpr double aspect_max = 1e7;
constexpr double vertical_share = 0.15;  // fraction of the longest horizontal edge, if units differ
constexpr double flat_share = 0.05;      // a box of lengths that is flatter gets vertical_share

bool all_positive(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return v > 0; });
}

bool is_angle(const Axis& axis) {
  return axis.kind == AxisKind::longitude || axis.kind == AxisKind::latitude;
}

bool same_unit(const Axis& a, const Axis& b) {
  if (is_angle(a) || is_angle(b)) return is_angle(a) && is_angle(b);
  return a.units == b.units;
}

// Positions before scaling, ascending. Auto: log p for a pressure axis with positive levels,
// otherwise the coordinate. Index 0 is the bottom, so descending coordinates (pressure, depth,
// model levels) are negated.
Result<std::vector<double>> raw_positions(const Axis& axis, bool vertical,
                                          VerticalPlacement placement) {
  const std::vector<double>& at = axis.coordinates;
  std::vector<double> raw(at.size());
  const bool log_fits = axis.kind == AxisKind::pressure && all_positive(at);
  if (vertical && placement == VerticalPlacement::logp && !log_fits) {
    return make_error_at(ErrorKind::invalid, "/geometry/vertical",
                         "logp requires a vertical axis of positive pressures, not \"" +
                             printable(axis.name) + "\"");
  }
  if (vertical && placement == VerticalPlacement::index) {
    for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = static_cast<double>(i);
    return raw;
  }
  const bool by_log = vertical && log_fits && placement != VerticalPlacement::linear;
  const double sign = at.size() > 1 && at.back() < at.front() ? -1.0 : 1.0;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    raw[i] = sign * (by_log ? std::log(at[i]) : at[i]);
  }
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const bool ascends = i == 0 || raw[i] > raw[i - 1];
    if (!std::isfinite(raw[i]) || !ascends) {
      return make_error(ErrorKind::bad_data, "the coordinates of axis \"" + printable(axis.name) +
                                                 "\" are not finite and strictly monotonic");
    }
  }
  return raw;
}

// Cell edges lie midway between samples; the first and last cell are symmetric about their sample.
// One sample: a cell of width 1, resized later.
std::vector<double> cell_edges(const std::vector<double>& raw) {
  if (raw.size() == 1) return {raw[0] - 0.5, raw[0] + 0.5};
  std::vector<double> edges(raw.size() + 1);
  for (std::size_t i = 1; i < raw.size(); ++i) edges[i] = 0.5 * raw[i - 1] + 0.5 * raw[i];
  edges.front() = raw.front() - 0.5 * (raw[1] - raw[0]);
  edges.back() = raw.back() + 0.5 * (raw[raw.size() - 1] - raw[raw.size() - 2]);
  return edges;
}

struct RawAxis {
  std::vector<double> positions;
  std::vector<double> edges;
  std::array<double, 2> extent{0, 1};  // first to last edge, or as given by the caller
  bool thin = false;                   // true: one sample of unknown thickness
  double length = 1;                   // relative length, before the uniform scale
  [[nodiscard]] double raw_length() const { return extent[1] - extent[0]; }
};

double smallest_cell(const RawAxis& axis) {
  double smallest = std::numeric_limits<double>::infinity();
  if (axis.positions.size() < 2) return smallest;
  for (std::size_t i = 0; i + 1 < axis.edges.size(); ++i) {
    smallest = std::min(smallest, axis.edges[i + 1] - axis.edges[i]);
  }
  return smallest * (axis.length / axis.raw_length());
}

// Metres per raw unit of an axis; nullopt: neither a length nor an angle, or without unit.
std::optional<double> metres_in_unit(const Axis& axis) {
  if (is_angle(axis)) return metres_per_degree;
  if (axis.kind == AxisKind::pressure || axis.kind == AxisKind::level) return std::nullopt;
  return data::metres_in(axis.units);
}

// Factor of the edge along longitudes. A regional map is equirectangular with its true scale along
// the latitude in the middle of the box, phi: a degree of longitude is cos(phi) times as wide as a
// degree of latitude. A map over three quarters of the globe or more, or over more than 90 degrees
// of latitude, of which no latitude is representative, is the plate carree (factor 1). A section
// along one latitude has the scale of that latitude.
double longitude_share(const Axis& x, const Axis& y, const std::array<RawAxis, 3>& axes) {
  constexpr double longitudes_max = 270;
  constexpr double latitudes_max = 90;
  if (x.kind != AxisKind::longitude || y.kind != AxisKind::latitude) return 1;
  if (axes[0].thin) return 1;
  const bool section = axes[1].thin;
  const double middle =
      section ? y.coordinates.front() : 0.5 * axes[1].extent[0] + 0.5 * axes[1].extent[1];
  const bool whole = axes[0].raw_length() >= longitudes_max || axes[1].raw_length() > latitudes_max;
  if ((whole && !section) || std::abs(middle) >= 90) return 1;
  return std::cos(middle * radians_per_degree);
}

// Sets the length of the vertical axis relative to the horizontal ones.
Result<void> set_height(const data::Grid& grid, VerticalPlacement placement, double horizontal,
                        std::array<RawAxis, 3>& axes) {
  const Axis& z = grid.axes[2];
  const Axis& reference = axes[0].thin ? grid.axes[1] : grid.axes[0];
  const auto unit = metres_in_unit(reference);
  const auto vertical_unit = metres_in_unit(z);
  const bool to_scale = unit && vertical_unit;
  if (placement == VerticalPlacement::metric) {
    if (!to_scale) {
      return make_error_at(ErrorKind::invalid, "/geometry/vertical",
                           "metric requires a vertical axis in a unit of length above horizontal "
                           "ones in units of length or degrees");
    }
    axes[2].length = axes[2].raw_length() * *vertical_unit / *unit;
    return {};
  }
  // Indices and log p have no unit in common with the horizontal axes.
  const bool places_coordinates =
      placement != VerticalPlacement::index && z.kind != AxisKind::pressure;
  const bool lengths = to_scale && !is_angle(reference);
  if (places_coordinates && lengths) {
    axes[2].length = axes[2].raw_length() * *vertical_unit / *unit;
    if (axes[2].thin || axes[2].length >= flat_share * horizontal) return {};
  } else if (places_coordinates && same_unit(z, reference)) {
    return {};
  }
  if (horizontal > 0) axes[2].length = vertical_share * horizontal;
  return {};
}

// Relative lengths of the axes; an axis of one sample gets the smallest cell of the others.
Result<void> proportion(const data::Grid& grid, VerticalPlacement placement,
                        std::array<RawAxis, 3>& axes) {
  const auto& [x, y, z] = grid.axes;
  for (RawAxis& axis : axes) axis.length = axis.raw_length();
  if (!axes[0].thin && !axes[1].thin && !same_unit(x, y)) {
    const auto unit_x = is_angle(x) ? std::nullopt : metres_in_unit(x);
    const auto unit_y = is_angle(y) ? std::nullopt : metres_in_unit(y);
    axes[1].length = unit_x && unit_y ? axes[1].length * *unit_y / *unit_x : axes[0].length;
  }
  axes[0].length *= longitude_share(x, y, axes);
  double horizontal = 0;
  for (std::size_t a = 0; a < 2; ++a) {
    if (!axes[a].thin) horizontal = std::max(horizontal, axes[a].length);
  }
  if (auto ok = set_height(grid, placement, horizontal, axes); !ok) return ok;
  double smallest = std::numeric_limits<double>::infinity();
  for (const RawAxis& axis : axes) {
    if (!axis.thin) smallest = std::min(smallest, smallest_cell(axis));
  }
  if (!std::isfinite(smallest)) smallest = 1;
  for (RawAxis& axis : axes) {
    if (axis.thin) axis.length = smallest;
  }
  return {};
}

// Widths of the narrowest and the widest cell, and their axes.
struct CellWidths {
  double narrowest = std::numeric_limits<double>::infinity();
  double widest = 0;
  std::size_t narrow_axis = 0, wide_axis = 0;
};

// The widths divided by `scale` of their axis.
CellWidths cell_widths(const Lattice& lattice, const std::array<double, 3>& scale) {
  CellWidths widths;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto [low, high] =
        std::minmax_element(lattice.spacing.at(a).begin(), lattice.spacing.at(a).end());
    if (*low / scale.at(a) < widths.narrowest) {
      widths.narrowest = *low / scale.at(a);
      widths.narrow_axis = a;
    }
    if (*high / scale.at(a) > widths.widest) {
      widths.widest = *high / scale.at(a);
      widths.wide_axis = a;
    }
  }
  return widths;
}

// Refuses cells whose proportions single precision cannot represent: a fault of the scale if the
// unscaled cells would do, otherwise of the data.
Result<void> check_aspect(const data::Grid& grid, const protocol::GeometryView& geometry,
                          const Lattice& lattice) {
  const CellWidths widths = cell_widths(lattice, {1, 1, 1});
  if (widths.widest <= aspect_max * widths.narrowest) return {};
  const auto name = [&](std::size_t axis) {
    return "axis \"" + printable(grid.axes.at(axis).name) + "\"";
  };
  const std::string narrow = name(widths.narrow_axis);
  const std::string wide =
      widths.wide_axis == widths.narrow_axis ? "the same axis" : name(widths.wide_axis);
  const std::string limit = ", less than the limit of 1e-7";
  const CellWidths unscaled =
      cell_widths(lattice, {geometry.scale[0], geometry.scale[1], geometry.scale[2]});
  std::ostringstream part;
  part << std::setprecision(2) << widths.narrowest / widths.widest;
  if (unscaled.widest <= aspect_max * unscaled.narrowest) {
    return make_error_at(ErrorKind::invalid,
                         "/geometry/scale/" + std::to_string(widths.narrow_axis),
                         "leaves the narrowest cell of " + narrow + " " + part.str() +
                             " times as wide as the widest of " + wide + limit);
  }
  return make_error(ErrorKind::bad_data, "the narrowest cell of " + narrow + " is " + part.str() +
                                             " times as wide as the widest of " + wide + limit);
}

// Along the middle row (axis 0) or column (axis 1) of a grid with a longitude and latitude for
// every column, metres.
double length_of_line(const data::Grid& grid, std::size_t axis) {
  const data::Columns& columns = *grid.columns;
  const auto width = static_cast<std::size_t>(grid.dims()[0]);
  const auto height = static_cast<std::size_t>(grid.dims()[1]);
  const std::size_t first = axis == 0 ? height / 2 * width : width / 2;
  const std::size_t step = axis == 0 ? 1 : width;
  double metres = 0;
  for (std::size_t n = 1; n < (axis == 0 ? width : height); ++n) {
    const std::size_t to = first + n * step;
    const std::size_t from = to - step;
    const double latitude = 0.5 * (columns.latitude[from] + columns.latitude[to]);
    const double east = std::remainder(columns.longitude[to] - columns.longitude[from], 360.0);
    metres += metres_per_degree * std::hypot(columns.latitude[to] - columns.latitude[from],
                                             east * std::cos(latitude * radians_per_degree));
  }
  return metres;
}

// Metres from the first to the last sample of an axis: of pressures by the ICAO standard
// atmosphere, of axes of map projections and rows by the positions of the columns. nullopt:
// unknown.
std::optional<double> length_of(const data::Grid& grid, std::size_t axis) {
  const Axis& own = grid.axes.at(axis);
  const double first = own.coordinates.front();
  const double last = own.coordinates.back();
  if (own.kind == AxisKind::pressure) {
    const auto pascals = data::pascals_in(own.units);
    if (!pascals || !(first > 0) || !(last > 0)) return std::nullopt;
    return std::abs(data::cf::standard_height(last * *pascals) -
                    data::cf::standard_height(first * *pascals));
  }
  if (const auto unit = metres_in_unit(own)) return std::abs(last - first) * *unit;
  if (axis < 2 && grid.columns) return length_of_line(grid, axis);
  return std::nullopt;
}

// Metres for each world unit along an axis; nullopt: unknown.
std::optional<double> metres_along(const data::Grid& grid, const Lattice& lattice,
                                   std::size_t axis) {
  const std::vector<double>& world = lattice.positions.at(axis);
  if (world.size() < 2) return std::nullopt;
  const auto metres = length_of(grid, axis);
  if (!metres || !(*metres > 0)) return std::nullopt;
  return *metres / (world.back() - world.front());
}

}  // namespace

Result<Lattice> place_lattice(const data::Grid& grid, const protocol::GeometryView& geometry,
                              const Heights* heights) {
  if (geometry.mapping == protocol::GeometryMapping::flat && heights == nullptr) {
    return place_straight(grid, geometry, std::nullopt);
  }
  return bend_lattice(grid, geometry, heights);
}

double cell_size(const Lattice& lattice, std::size_t axis) {
  double length = 0;
  for (const double width : lattice.spacing.at(axis)) length += width;
  return length / lattice.dims.at(axis);
}

std::optional<double> metres_per_unit(const data::Grid& grid, const Lattice& lattice) {
  if (const auto y = metres_along(grid, lattice, 1)) return y;
  const bool is_narrowed = grid.axes[0].kind == AxisKind::longitude && !grid.columns;
  return is_narrowed ? std::nullopt : metres_along(grid, lattice, 0);
}

std::optional<double> vertical_exaggeration(const data::Grid& grid, const Lattice& lattice) {
  const auto up = metres_along(grid, lattice, 2);
  const auto across = metres_per_unit(grid, lattice);
  if (!up || !across) return std::nullopt;
  return *across / *up;
}

Result<Lattice> place_straight(const data::Grid& grid, const protocol::GeometryView& geometry,
                               const std::optional<std::array<double, 2>>& vertical_extent) {
  std::array<RawAxis, 3> axes;
  for (std::size_t a = 0; a < 3; ++a) {
    if (grid.axes[a].coordinates.empty()) {
      return make_error(ErrorKind::bad_data, "an axis has no coordinates");
    }
    auto raw = raw_positions(grid.axes[a], a == 2, geometry.vertical);
    if (!raw) return raw.error();
    axes[a].positions = std::move(*raw);
    const bool stretched = a == 2 && vertical_extent.has_value();
    // A single layer is centred at 0: at coordinates beyond 2^53, half a cell would be rounded off.
    if (axes[a].positions.size() == 1 && !stretched) axes[a].positions = {0};
    axes[a].edges = cell_edges(axes[a].positions);
    axes[a].extent =
        stretched ? *vertical_extent : std::array{axes[a].edges.front(), axes[a].edges.back()};
    axes[a].thin = axes[a].positions.size() == 1 && !stretched;
  }
  if (auto ok = proportion(grid, geometry.vertical, axes); !ok) return ok.error();
  double longest = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    axes[a].length *= geometry.scale[a];
    longest = std::max(longest, axes[a].length);
  }
  Lattice lattice;
  for (std::size_t a = 0; a < 3; ++a) {
    const RawAxis& axis = axes[a];
    const double world_length = axis.length / longest * box_edge;
    const double scale = world_length / axis.raw_length();
    const double centre = 0.5 * axis.extent[0] + 0.5 * axis.extent[1];
    if (!std::isfinite(scale) || scale <= 0) {
      return make_error_at(ErrorKind::invalid, "/geometry/scale/" + std::to_string(a),
                           "leaves the box without a finite length along axis \"" +
                               printable(grid.axes[a].name) + "\"");
    }
    const int index = static_cast<int>(a);
    lattice.dims[a] = static_cast<int>(axis.positions.size());
    lattice.positions[a].reserve(axis.positions.size());
    lattice.spacing[a].reserve(axis.positions.size());
    for (std::size_t i = 0; i < axis.positions.size(); ++i) {
      lattice.positions[a].push_back((axis.positions[i] - centre) * scale);
      lattice.spacing[a].push_back((axis.edges[i + 1] - axis.edges[i]) * scale);
    }
    lattice.box_min[index] = -0.5 * world_length;
    lattice.box_max[index] = 0.5 * world_length;
  }
  if (auto ok = check_aspect(grid, geometry, lattice); !ok) return ok.error();
  return lattice;
}

std::vector<glm::dvec3> points_in_box(const Lattice& lattice, const glm::dvec3& point,
                                      const glm::dvec3& normal) {
  std::vector<glm::dvec3> points;
  const auto corner = [&](unsigned bits) {
    glm::dvec3 at = lattice.box_min;
    for (int a = 0; a < 3; ++a) {
      if ((bits >> static_cast<unsigned>(a) & 1U) != 0) at[a] = lattice.box_max[a];
    }
    return at;
  };
  for (unsigned bits = 0; bits < 8; ++bits) {
    for (unsigned a = 0; a < 3; ++a) {
      if ((bits >> a & 1U) != 0) continue;
      const glm::dvec3 from = corner(bits);
      const glm::dvec3 to = corner(bits | 1U << a);
      const double before = glm::dot(normal, from - point);
      const double after = glm::dot(normal, to - point);
      if (before * after > 0 || before == after) continue;
      points.push_back(from + (to - from) * (before / (before - after)));
    }
  }
  return points;
}

}  // namespace windsplat::scene
