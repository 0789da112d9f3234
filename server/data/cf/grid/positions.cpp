#include "server/data/cf/grid/positions.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/crs_wkt.hpp"
#include "server/data/cf/grid/curvilinear.hpp"
#include "server/data/cf/grid/projected_columns.hpp"
#include "server/data/cf/grid/projection.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::size_t columns_max = std::size_t{1} << 24;
constexpr double radian = std::numbers::pi / 180;

// What a coordinate is multiplied by to be in the unit of the projection.
std::optional<double> factor_of(const Projection& projection, const Axis& axis) {
  if (projection.in_degrees) return 1.0;
  if (const auto metres = metres_in(axis.units)) return metres;
  if (projection.metres_per_radian == 0) return std::nullopt;
  const std::string units = lower(axis.units);
  constexpr auto degrees = std::to_array<std::string_view>({"degrees", "degree", "deg"});
  constexpr auto microradians = std::to_array<std::string_view>({"microradian", "microradians"});
  if (is_radian(units)) return projection.metres_per_radian;
  if (is_one_of(units, microradians)) return 1e-6 * projection.metres_per_radian;
  if (is_one_of(units, degrees)) return radian * projection.metres_per_radian;
  return std::nullopt;
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

struct Place {
  double longitude;
  double latitude;
};

// Great-circle distance in degrees.
double distance_between(const Place& a, const Place& b) {
  const double along = std::sin((a.latitude - b.latitude) * radian / 2);
  const double across = std::sin((a.longitude - b.longitude) * radian / 2);
  const double h = along * along +
                   std::cos(a.latitude * radian) * std::cos(b.latitude * radian) * across * across;
  return 2 * std::asin(std::sqrt(std::clamp(h, 0.0, 1.0))) / radian;
}

class PositionFinder {
 public:
  PositionFinder(const ArrayFile& file, const std::vector<int>& variables,
                 const std::array<int, 2>& axes, const Placement& placement, DatasetInfo& info)
      : file_(file), axes_(axes), placement_(placement), info_(info) {
    const int x = axes[0];
    mapping_ = grid_mapping_of(file, variables, x < 0 ? "" : variable(x).name);
    if (mapping_ < 0) {
      take_code_of(variables);
    } else {
      attributes_ = grid_mapping_at(file, mapping_);
      if (attributes_.texts.count("grid_mapping_name") == 0) read_wkt();
    }
    if (const auto name = attributes_.texts.find("grid_mapping_name");
        name != attributes_.texts.end()) {
      kind_ = lower(name->second);
    }
  }

  Result<Positions> find() {
    Positions out;
    const Axis& x = info_.grid.axes[0];
    const bool about_pole = x.kind == AxisKind::longitude &&
                            (x.standard_name == "grid_longitude" ||
                             (kind_ == "rotated_latitude_longitude" && x.standard_name.empty()));
    if (x.kind == AxisKind::longitude && !about_pole) {
      if (kind_ == "latitude_longitude") shift_longitudes();
      return out;
    }
    auto own = find_columns(file_, placement_);
    if (!own) return own.error();
    out.columns = std::move(*own);
    const bool is_placed = axes_[0] >= 0 && axes_[1] >= 0 && mapping_ >= 0;
    if (is_placed && is_projected(about_pole)) {
      if (out.columns) {
        compare(*out.columns);
      } else {
        project(out);
      }
    }
    if (is_placed && !out.columns && kind_ == "latitude_longitude" &&
        x.kind == AxisKind::cartesian) {
      info_.notes.push_back("longitudes and latitudes are unknown: " + mapping_name() +
                            " is geographic, but " + in_quotes(x.name) + " and " +
                            in_quotes(info_.grid.axes[1].name) +
                            " are not marked as longitude and latitude");
    }
    const bool on_map = x.standard_name == "projection_x_coordinate" || !kind_.empty();
    out.follow_other_axes = out.columns || about_pole || (on_map && !is_along_east(kind_));
    return out;
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return file_.contents().variables.at(at(v));
  }
  // A field with a code of its own is no mapping itself.
  [[nodiscard]] std::string mapping_name() const {
    return (is_of_field_ ? "of " : "") + in_quotes(variable(mapping_).name);
  }

  void take(Result<GridMapping> found) {
    if (found) {
      attributes_ = std::move(*found);
    } else {
      fault_ = found.error();
    }
  }

  // A mapping without attributes may have well-known text, or an EPSG code.
  void read_wkt() {
    for (const char* name : {"crs_wkt", "spatial_ref"}) {
      const std::string text = file_.text_of(mapping_, name);
      if (text.empty()) continue;
      const auto code = epsg_code_of(text);
      take(code ? mapping_of_epsg(*code) : mapping_of_wkt(text));
      return;
    }
    if (const auto code = code_at(mapping_)) take(mapping_of_epsg(*code));
  }

  // The EPSG code of a variable, as text or as a number.
  [[nodiscard]] std::optional<int> code_at(int v) const {
    for (const char* name : {"epsg_code", "EPSG_code", "epsg", "EPSG", "crs"}) {
      if (const auto code = epsg_code_of(file_.text_of(v, name))) return code;
      const auto numbers = file_.numbers(v, name).values;
      constexpr double code_max = 1e6;
      if (numbers.size() == 1 && numbers[0] >= 1 && numbers[0] < code_max) {
        return static_cast<int>(numbers[0]);
      }
    }
    return std::nullopt;
  }

  // Fields without a mapping may have a code themselves.
  void take_code_of(const std::vector<int>& variables) {
    for (const int v : variables) {
      const auto code = code_at(v);
      if (!code) continue;
      mapping_ = v;
      is_of_field_ = true;
      take(mapping_of_epsg(*code));
      return;
    }
  }

  // Whether the axes have the coordinates that a map projection needs.
  [[nodiscard]] bool is_projected(bool about_pole) const {
    const auto& [x, y, z] = info_.grid.axes;
    if (about_pole) return y.kind == AxisKind::latitude;
    return kind_ != "latitude_longitude" && x.kind == AxisKind::cartesian &&
           y.kind == AxisKind::cartesian;
  }

  void shift_longitudes() {
    const double shift = prime_meridian(attributes_);
    if (shift == 0) return;
    for (double& longitude : info_.grid.axes[0].coordinates) longitude += shift;
    info_.notes.push_back("longitudes are relative to the prime meridian of " + mapping_name() +
                          ": converted to those of Greenwich");
  }

  // The positions at the given samples of each axis. Errors: bad_data, a predicate.
  Result<ProjectedColumns> positions_at(const Projection& projection, const std::vector<double>& x,
                                        const std::vector<double>& y) const {
    const auto factor_x = factor_of(projection, info_.grid.axes[0]);
    const auto factor_y = factor_of(projection, info_.grid.axes[1]);
    if (!factor_x || !factor_y) {
      const Axis& axis = info_.grid.axes.at(factor_x ? 1 : 0);
      return make_error(ErrorKind::bad_data, "needs the unit of " + in_quotes(axis.name) +
                                                 ", which is " + in_quotes(axis.units));
    }
    return project_columns(projection, scaled(x, *factor_x), scaled(y, *factor_y));
  }

  Result<ProjectedColumns> positions() {
    if (fault_) return *fault_;
    auto projection = projection_of(attributes_);
    if (!projection) return projection.error();
    const std::vector<double>& x = info_.grid.axes[0].coordinates;
    const std::vector<double>& y = info_.grid.axes[1].coordinates;
    if (x.size() > columns_max / y.size()) {
      return make_error(ErrorKind::bad_data,
                        "has more than " + std::to_string(columns_max) + " columns");
    }
    const double bytes = 2.0 * sizeof(double) * static_cast<double>(x.size() * y.size());
    if (auto fine = file_.charge(mapping_, bytes); !fine) return fine.error();
    auto found = positions_at(*projection, x, y);
    if (found) {
      for (const std::string& note : projection->notes) {
        info_.notes.push_back(mapping_name() + ' ' + note);
      }
    }
    return found;
  }

  void project(Positions& out) {
    auto found = positions();
    if (!found) {
      info_.notes.push_back("longitudes and latitudes are not computed: the map projection " +
                            mapping_name() + ' ' + found.error().message);
      return;
    }
    info_.notes.push_back("longitudes and latitudes are computed from the map projection " +
                          mapping_name() + " (" + kind_ + ')');
    if (found->outside_count > 0) {
      info_.notes.push_back(std::to_string(found->outside_count) + " of " +
                            std::to_string(found->outside.size()) +
                            " columns do not lie on the Earth: they are masked");
    }
    if (found->outside_count > 0) {
      const auto projection = projection_of(attributes_);
      const auto& [x, y, z] = info_.grid.axes;
      out.tangents = [projection = *projection, columns = *found,
                      x = scaled(x.coordinates, factor_of(*projection, x).value_or(1)),
                      y = scaled(y.coordinates, factor_of(*projection, y).value_or(1))] {
        return tangents_on_map(projection, x, y, columns);
      };
    }
    out.columns = std::move(found->columns);
    out.outside = std::move(found->outside);
  }

  // Notes 2-D positions that contradict the map projection, at some columns.
  void compare(const Columns& own) {
    const auto projection = projection_of(attributes_);
    if (!projection) return;
    constexpr std::size_t parts = 4;
    std::array<std::vector<std::size_t>, 2> chosen;
    std::array<std::vector<double>, 2> coordinates;
    for (std::size_t a = 0; a < 2; ++a) {
      const std::vector<double>& all = info_.grid.axes.at(a).coordinates;
      for (std::size_t part = 0; part <= parts; ++part) {
        const std::size_t i = (all.size() - 1) * part / parts;
        if (!chosen.at(a).empty() && chosen.at(a).back() == i) continue;
        chosen.at(a).push_back(i);
        coordinates.at(a).push_back(all[i]);
      }
    }
    const auto found = positions_at(*projection, coordinates[0], coordinates[1]);
    if (!found) return;
    const std::size_t width = placement_.length[0];
    double farthest = 0;
    double cell = 0;
    for (std::size_t n = 0; n < found->columns->latitude.size(); ++n) {
      if (!found->outside.empty() && found->outside[n]) continue;
      const std::size_t i = chosen[0][n % chosen[0].size()];
      const std::size_t at = chosen[1][n / chosen[0].size()] * width + i;
      const std::size_t beside = i + 1 < width ? at + 1 : width > 1 ? at - 1 : at;
      const Place here{own.longitude[at], own.latitude[at]};
      farthest = std::max(farthest, distance_between(here, {found->columns->longitude[n],
                                                            found->columns->latitude[n]}));
      cell = std::max(cell, distance_between(here, {own.longitude[beside], own.latitude[beside]}));
    }
    if (!(farthest > 0.5 * cell)) return;
    info_.notes.push_back(
        "the 2-D longitudes and latitudes, which are used, differ from the map "
        "projection " +
        mapping_name() + " by up to " + number_text(farthest) + " degrees");
  }

  const ArrayFile& file_;
  std::array<int, 2> axes_;
  const Placement& placement_;
  DatasetInfo& info_;
  int mapping_ = -1;
  GridMapping attributes_;
  std::optional<Error> fault_;  // of well-known text
  bool is_of_field_ = false;    // mapping_ is a field
  std::string kind_;            // grid_mapping_name
};

}  // namespace

Result<Positions> find_positions(const ArrayFile& file, const std::vector<int>& variables,
                                 const std::array<int, 2>& axes, const Placement& placement,
                                 DatasetInfo& info) {
  return PositionFinder(file, variables, axes, placement, info).find();
}

}  // namespace windsplat::data::cf
