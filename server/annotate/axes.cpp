#include "server/annotate/axes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/annotate/labels.hpp"
#include "server/base/check.hpp"

namespace windsplat::annotate {
namespace {

// Interpolates `to` at x between neighbours of `from`, which ascends or descends; linear beyond.
double between(const std::vector<double>& from, const std::vector<double>& to, double x) {
  if (from.size() == 1) return to.front();
  const bool ascends = from.back() > from.front();
  const auto after = std::upper_bound(
      from.begin() + 1, from.end() - 1, x,
      [ascends](double value, double at) { return ascends ? value < at : value > at; });
  const auto n = static_cast<std::size_t>(after - from.begin());
  return to[n - 1] + (to[n] - to[n - 1]) * ((x - from[n - 1]) / (from[n] - from[n - 1]));
}

bool is_even(const std::vector<double>& values, const std::vector<double>& positions) {
  constexpr double tolerance = 1e-3;  // of the axis
  const double range = values.back() - values.front();
  const double length = positions.back() - positions.front();
  for (std::size_t i = 1; i + 1 < values.size(); ++i) {
    const double by_value = (values[i] - values.front()) / range;
    const double by_place = (positions[i] - positions.front()) / length;
    if (!(std::abs(by_value - by_place) <= tolerance)) return false;
  }
  return true;
}

// The least and the greatest of the columns' degrees with their world positions along `axis`.
std::optional<AxisMap> map_of_columns(const scene::Lattice& lattice,
                                      const std::vector<double>& degrees, std::size_t axis) {
  const auto [low, high] = std::minmax_element(degrees.begin(), degrees.end());
  const auto place = [&](std::vector<double>::const_iterator at) {
    const auto column = static_cast<std::size_t>(at - degrees.begin());
    return static_cast<double>((*lattice.places)[column].at(axis));
  };
  if (!(*high > *low)) return AxisMap({*low}, {place(low)}, false);
  return AxisMap({*low, *high}, {place(low), place(high)}, false);
}

bool is_map_of_columns(const Subject& subject, std::size_t axis) {
  const protocol::GeometryView& geometry = subject.completed.view().geometry;
  return geometry.mapping == protocol::GeometryMapping::curvilinear && axis < 2 &&
         subject.completed.placed()->grid.columns != nullptr;
}

}  // namespace

AxisMap::AxisMap(std::vector<double> values, std::vector<double> positions, bool logarithmic)
    : values_(std::move(values)), positions_(std::move(positions)), logarithmic_(logarithmic) {
  WINDSPLAT_CHECK(!values_.empty() && values_.size() == positions_.size());
  even_ = !logarithmic_ && is_even(values_, positions_);
  if (!logarithmic_) return;
  for (double& value : values_) value = std::log(value);
}

double AxisMap::position(double value) const {
  return between(values_, positions_, logarithmic_ ? std::log(value) : value);
}

double AxisMap::value(double position) const {
  const double value = between(positions_, values_, position);
  return logarithmic_ ? std::exp(value) : value;
}

std::optional<AxisMap> axis_map(const Subject& subject, std::size_t axis) {
  const scene::Placed& placed = *subject.completed.placed();
  const protocol::GeometryView& geometry = subject.completed.view().geometry;
  if (geometry.mapping == protocol::GeometryMapping::sphere) return std::nullopt;
  const scene::Lattice& lattice = placed.lattice;
  if (is_map_of_columns(subject, axis)) {
    const data::Columns& columns = *placed.grid.columns;
    return map_of_columns(lattice, axis == 0 ? columns.longitude : columns.latitude, axis);
  }
  const data::Axis own = drawn_axis(subject, axis);
  const bool positive = std::all_of(own.coordinates.begin(), own.coordinates.end(),
                                    [](double value) { return value > 0; });
  using protocol::VerticalPlacement;
  const bool by_log = axis == 2 && own.kind == data::AxisKind::pressure && positive &&
                      (geometry.vertical == VerticalPlacement::automatic ||
                       geometry.vertical == VerticalPlacement::logp ||
                       geometry.vertical == VerticalPlacement::metric);
  return AxisMap(own.coordinates, lattice.positions.at(axis), by_log);
}

data::Axis drawn_axis(const Subject& subject, std::size_t axis) {
  data::Axis own = subject.completed.placed()->grid.axes.at(axis);
  if (is_map_of_columns(subject, axis)) {
    own.kind = axis == 0 ? data::AxisKind::longitude : data::AxisKind::latitude;
    own.units = axis == 0 ? "degrees_east" : "degrees_north";
  }
  // Coordinates of a map projection: metres have too many digits.
  constexpr double far = 1e5;
  constexpr double kilometre = 1000;
  const bool in_metres = unit_text(own.units) == "m" && own.kind == data::AxisKind::cartesian;
  const auto is_far = [](double value) { return std::abs(value) >= far; };
  if (in_metres && std::any_of(own.coordinates.begin(), own.coordinates.end(), is_far)) {
    own.units = "km";
    for (double& value : own.coordinates) value /= kilometre;
  }
  return own;
}

}  // namespace windsplat::annotate
