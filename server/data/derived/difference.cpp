#include "server/data/derived/difference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "server/base/check.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::derived {

namespace {

constexpr double tolerance = 1e-3;  // of the distance of neighbours

std::string coordinate_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

const char* name_of(AxisKind kind) {
  switch (kind) {
    case AxisKind::longitude:
      return "longitudes";
    case AxisKind::latitude:
      return "latitudes";
    case AxisKind::pressure:
      return "pressures";
    case AxisKind::height:
      return "heights";
    case AxisKind::depth:
      return "depths";
    case AxisKind::level:
      return "levels";
    case AxisKind::cartesian:
      break;
  }
  return "coordinates";
}

bool same_units(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const auto ratio = unit_ratio(a, b);
  return ratio && std::abs(*ratio - 1) < 1e-9;
}

std::string units_text(const std::string& units) {
  return units.empty() ? "no units" : in_quotes(units);
}

// Distance of a sample from its nearest neighbour; of a single one its own magnitude.
double spacing(const std::vector<double>& at, std::size_t n) {
  double least = std::numeric_limits<double>::infinity();
  if (n > 0) least = std::abs(at[n] - at[n - 1]);
  if (n + 1 < at.size()) least = std::min(least, std::abs(at[n + 1] - at[n]));
  return std::isfinite(least) ? least : std::abs(at[n]);
}

Error differ(const std::string& along, const std::string& how) {
  return make_error(ErrorKind::invalid, "the grids differ along " + along + ": " + how);
}

Result<void> check_same_axis(const std::string& letter, const Axis& a, const Axis& b,
                             const std::string& other) {
  const std::string along = letter + (a.name.empty() ? "" : " (" + in_quotes(a.name) + ")");
  const std::string there = " in " + in_quotes(other);
  const std::size_t count = a.coordinates.size();
  if (count != b.coordinates.size()) {
    return differ(along, std::to_string(count) + " samples here, " +
                             std::to_string(b.coordinates.size()) + there);
  }
  if (a.kind != b.kind) {
    return differ(along, std::string(name_of(a.kind)) + " here, " + name_of(b.kind) + there);
  }
  if (!same_units(a.units, b.units)) {
    return differ(along, units_text(a.units) + " here, " + units_text(b.units) + there);
  }
  for (std::size_t n = 0; n < count; ++n) {
    const double apart = std::abs(a.coordinates[n] - b.coordinates[n]);
    if (apart <= tolerance * spacing(a.coordinates, n)) continue;
    return differ(along, "sample " + std::to_string(n) + " is at " +
                             coordinate_text(a.coordinates[n]) + " here, at " +
                             coordinate_text(b.coordinates[n]) + there);
  }
  return {};
}

// Rows are x fastest; the distance of neighbours along x stands for that along both axes.
Result<void> check_same_columns(const char* name, const std::vector<double>& a,
                                const std::vector<double>& b, std::size_t row,
                                const std::string& other) {
  for (std::size_t n = 0; n < a.size(); ++n) {
    const bool last = (n + 1) % row == 0;
    const double along_x = row < 2 ? 1 : std::abs(a[n] - a[last ? n - 1 : n + 1]);
    const double along_y = n + row < a.size() ? std::abs(a[n] - a[n + row])
                           : n >= row         ? std::abs(a[n] - a[n - row])
                                              : 0;
    if (std::abs(a[n] - b[n]) <= tolerance * std::max(along_x, along_y)) continue;
    return differ("x and y", std::string("the ") + name + " of column " + std::to_string(n % row) +
                                 ", " + std::to_string(n / row) + " is " + coordinate_text(a[n]) +
                                 " here, " + coordinate_text(b[n]) + " in " + in_quotes(other));
  }
  return {};
}

}  // namespace

Result<void> check_same_grid(const DatasetInfo& a, const DatasetInfo& b) {
  constexpr std::array<const char*, 3> letters{"x", "y", "z"};
  for (std::size_t axis = 0; axis < letters.size(); ++axis) {
    auto same = check_same_axis(letters.at(axis), a.grid.axes.at(axis), b.grid.axes.at(axis), b.id);
    if (!same) return same;
  }
  const Columns* const own = a.grid.columns.get();
  const Columns* const others = b.grid.columns.get();
  if ((own == nullptr) != (others == nullptr)) {
    return differ("x and y", own != nullptr ? "longitudes and latitudes of columns here only"
                                            : "longitudes and latitudes of columns in " +
                                                  in_quotes(b.id) + " only");
  }
  if (own == nullptr || own == others) return {};
  const std::size_t row = a.grid.axes[0].coordinates.size();
  if (auto same = check_same_columns("longitude", own->longitude, others->longitude, row, b.id);
      !same) {
    return same;
  }
  return check_same_columns("latitude", own->latitude, others->latitude, row, b.id);
}

Result<void> check_same_field(const std::string& field, const DatasetInfo& a,
                              const DatasetInfo& b) {
  const FieldInfo* const own = a.find(field);
  if (own == nullptr) {
    return make_error(ErrorKind::not_found,
                      "dataset " + in_quotes(a.id) + " has no field " + in_quotes(field));
  }
  const FieldInfo* const other = b.find(field);
  if (other == nullptr) {
    return make_error(ErrorKind::invalid, "dataset " + in_quotes(b.id) + " has no field " +
                                              in_quotes(field) + " to subtract" +
                                              absence_text(b, field));
  }
  const std::size_t components = own->components.size();
  if (own->kind != other->kind || components != other->components.size()) {
    return make_error(ErrorKind::invalid, in_quotes(field) + " has " + std::to_string(components) +
                                              " components here, " +
                                              std::to_string(other->components.size()) + " in " +
                                              in_quotes(b.id));
  }
  for (std::size_t c = 0; c < components; ++c) {
    const auto units_of = [c](const FieldInfo& of) {
      return c < of.component_units.size() ? of.component_units[c] : of.units;
    };
    if (same_units(units_of(*own), units_of(*other))) continue;
    return make_error(ErrorKind::invalid, "the units of " + in_quotes(field) +
                                              " differ: " + units_text(units_of(*own)) + " here, " +
                                              units_text(units_of(*other)) + " in " +
                                              in_quotes(b.id));
  }
  return {};
}

Volume subtract(const Volume& a, const Volume& b) {
  WINDSPLAT_CHECK(a.dims == b.dims && a.components == b.components);
  Volume out;
  out.dims = a.dims;
  out.components = a.components;
  out.values = Samples(a.values.size());
  const float* const from = a.values.data();
  const float* const minus = b.values.data();
  std::transform(from, from + a.values.size(), minus, out.values.data(), std::minus<>());
  finish_volume(out);  // NaN in either operand is NaN
  return out;
}

}  // namespace windsplat::data::derived
