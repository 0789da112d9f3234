// Grid, units and placement -> rates in world units.
#include "server/scene/rates.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>

#include "server/data/cf/units.hpp"
#include "server/scene/angles.hpp"
#include "server/scene/region/crop.hpp"

namespace windsplat::scene {

namespace {

using data::Axis;
using data::AxisKind;

constexpr double scale_height_m = 7400.0;
constexpr double ground_pressure_pa = 100000.0;
constexpr double cosine_min = 1e-3;  // avoids division by zero at the poles

Error no_motion(const Axis& axis, std::string_view what) {
  return make_error_at(ErrorKind::invalid, "/vector/space",
                       "world: no known rate along axis \"" + printable(axis.name) + "\" (" +
                           printable(axis.units) + ") for " + printable(what));
}

// Metres per unit. An axis without unit is in metres; empty for units that are not lengths.
std::optional<double> metres(const Axis& axis) {
  if (axis.units.empty() && axis.kind == AxisKind::cartesian) return 1.0;
  return data::metres_in(axis.units);
}

// d(world)/d(coordinate) at each of at least two samples by differences of neighbours; exact if the
// world position is linear in the coordinate or (by_log) in its logarithm.
std::vector<double> slopes(const Axis& axis, const std::vector<double>& world, bool by_log) {
  const std::vector<double>& at = axis.coordinates;
  const std::size_t count = at.size();
  std::vector<double> out(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t below = k == 0 ? 0 : k - 1;
    const std::size_t above = std::min(k + 1, count - 1);
    const double rise = world[above] - world[below];
    out[k] =
        by_log ? rise / std::log(at[above] / at[below]) / at[k] : rise / (at[above] - at[below]);
  }
  return out;
}

// Coordinate units per second per unit of the component.
Result<double> vertical_speed(const Axis& axis, double coordinate, std::string_view unit) {
  const std::optional<double> omega = data::pascals_per_second_in(unit);
  switch (axis.kind) {
    case AxisKind::pressure: {
      if (!omega) return -coordinate / scale_height_m;
      if (const auto unit_pa = data::pascals_in(axis.units)) return *omega / *unit_pa;
      break;
    }
    case AxisKind::height:
    case AxisKind::cartesian: {
      const auto unit_m = metres(axis);
      if (!unit_m) break;
      if (!omega) return 1.0 / *unit_m;
      const double pressure = ground_pressure_pa * std::exp(-coordinate * *unit_m / scale_height_m);
      return -*omega * scale_height_m / pressure / *unit_m;
    }
    case AxisKind::depth:
      if (const auto unit_m = metres(axis); unit_m && !omega) return -1.0 / *unit_m;
      break;
    default:
      break;
  }
  return no_motion(axis, "a component in " + std::string(unit));
}

// Ratio of a degree of longitude to a degree of latitude.
double row_width(double latitude) {
  return std::max(std::cos(latitude * std::numbers::pi / 180.0), cosine_min);
}

// World units per second per unit of a component along a straight axis.
Result<double> axis_rate(const Axis& axis, const std::vector<double>& world) {
  if (world.size() < 2) return 0.0;
  const double raw = std::abs(axis.coordinates.back() - axis.coordinates.front());
  const bool angle = axis.kind == AxisKind::longitude || axis.kind == AxisKind::latitude;
  const auto unit_m = angle ? std::optional(metres_per_degree) : metres(axis);
  if (!unit_m) return no_motion(axis, "a horizontal component");
  return (world.back() - world.front()) / raw / *unit_m;
}

// World units per second per unit of a component towards east (by row) and north.
Result<void> straight_rates(const data::Grid& grid, const Lattice& lattice, Rates& rates) {
  const auto& [x, y, z] = grid.axes;
  const auto along_y = axis_rate(y, lattice.positions[1]);
  if (!along_y) return along_y.error();
  rates.y = *along_y;
  const auto along_x = axis_rate(x, lattice.positions[0]);
  if (!along_x) return along_x.error();
  rates.x.assign(y.coordinates.size(), *along_x);
  if (x.kind == AxisKind::longitude && y.kind == AxisKind::latitude) {
    for (std::size_t j = 0; j < rates.x.size(); ++j) rates.x[j] /= row_width(y.coordinates[j]);
  }
  return {};
}

void sphere_rates(const Lattice& lattice, Rates& rates) {
  const auto radius = [&lattice](std::size_t n) {
    const std::array<float, 3>& p = (*lattice.places)[n];
    return std::hypot(static_cast<double>(p[0]), static_cast<double>(p[1]),
                      static_cast<double>(p[2]));
  };
  rates.y = 0.5 * (radius(0) + radius(lattice.places->size() - 1)) / earth_radius_m;
  rates.x.assign(static_cast<std::size_t>(lattice.dims[1]), rates.y);
}

// World units per degree of a map, from its first and last column.
void map_rates(const data::Grid& grid, const Lattice& lattice, Rates& rates) {
  const data::Columns& columns = *grid.columns;
  const auto width = static_cast<std::size_t>(lattice.dims[0]);
  const auto scale = [&](const std::vector<double>& degrees, std::size_t a) {
    const auto [low, high] = std::minmax_element(degrees.begin(), degrees.end());
    const auto at = [&](auto place) {
      return static_cast<double>(
          (*lattice.places)[static_cast<std::size_t>(place - degrees.begin())][a]);
    };
    return *high > *low ? (at(high) - at(low)) / (*high - *low) / metres_per_degree : 0.0;
  };
  rates.y = scale(columns.latitude, 1);
  const double along_x = scale(columns.longitude, 0);
  for (std::size_t row = 0; row < columns.latitude.size(); row += width) {
    double sum = 0;
    for (std::size_t i = 0; i < width; ++i) sum += columns.latitude[row + i];
    rates.x.push_back(along_x / row_width(sum / static_cast<double>(width)));
  }
}

Result<void> horizontal_rates(const data::Grid& grid, protocol::GeometryMapping mapping,
                              const Lattice& lattice, Rates& rates) {
  switch (mapping) {
    case protocol::GeometryMapping::flat:
      return straight_rates(grid, lattice, rates);
    case protocol::GeometryMapping::curvilinear:
      map_rates(grid, lattice, rates);
      break;
    case protocol::GeometryMapping::sphere:
      sphere_rates(lattice, rates);
      break;
  }
  return {};
}

}  // namespace

bool rises_where_negative(const data::Grid& grid, const data::FieldInfo& field) {
  const AxisKind kind = grid.axes[2].kind;
  const bool up_is_known =
      kind == AxisKind::pressure || kind == AxisKind::height || kind == AxisKind::cartesian;
  return up_is_known && field.component_units.size() > 2 &&
         data::pascals_per_second_in(field.component_units[2]).has_value();
}

Result<Rates> world_rates(const data::Grid& grid, const data::FieldInfo& field,
                          const protocol::GeometryView& geometry, const Lattice& lattice) {
  Rates rates;
  if (auto ok = horizontal_rates(grid, geometry.mapping, lattice, rates); !ok) return ok.error();
  const data::Axis& z = grid.axes[2];
  rates.z.assign(z.coordinates.size(), 0.0);
  if (field.components.size() < 3 || rates.z.size() < 2) return rates;
  const std::string& unit =
      field.component_units.size() > 2 ? field.component_units[2] : field.units;
  const bool by_log =
      z.kind == AxisKind::pressure && geometry.vertical != protocol::VerticalPlacement::linear &&
      std::all_of(z.coordinates.begin(), z.coordinates.end(), [](double p) { return p > 0; });
  const std::vector<double> slope = slopes(z, lattice.positions[2], by_log);
  for (std::size_t k = 0; k < rates.z.size(); ++k) {
    auto speed = vertical_speed(z, z.coordinates[k], unit);
    if (!speed) return speed.error();
    rates.z[k] = slope[k] * *speed;
  }
  return rates;
}

Result<ComponentFactors> component_factors(const protocol::View& view, const Placed& placed,
                                           const data::FieldInfo& field) {
  ComponentFactors factors;
  const protocol::VectorView& vector = view.vector;
  factors.scale = {vector.scale[0], vector.scale[1], vector.scale[2]};
  if (vector.space == protocol::VectorSpace::world) {
    const Placed& whole = placed.whole ? *placed.whole : placed;
    auto rates = world_rates(whole.grid, field, view.geometry, whole.lattice);
    if (!rates) return rates.error();
    factors.rates = placed.crop ? cropped_rates(*rates, *placed.crop) : std::move(*rates);
  } else if (rises_where_negative(placed.grid, field)) {
    // Omega is positive downward, so drawing it unchanged would show rising air as sinking.
    factors.scale.z = -factors.scale.z;
  }
  return factors;
}

}  // namespace windsplat::scene
