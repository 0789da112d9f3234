// Calls to PROJ, whose every parameter is a number.
#include "server/data/cf/grid/projected_columns.hpp"

#include <proj.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "server/data/cf/grid/curvilinear.hpp"
#include "server/data/cf/grid/proj_context.hpp"

namespace windsplat::data::cf {

namespace {

constexpr double degree_in_radians = std::numbers::pi / 180;

// A projection and its inverse.
class Transform {
 public:
  explicit Transform(const Projection& projection)
      : projection_(projection), context_(context_without_files()) {
    if (context_ == nullptr) return;
    operation_ = proj_create(context_, projection.definition.c_str());
  }
  ~Transform() {
    if (operation_ != nullptr) proj_destroy(operation_);
    if (context_ != nullptr) proj_context_destroy(context_);
  }
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;

  [[nodiscard]] bool exists() const { return operation_ != nullptr; }
  [[nodiscard]] std::string reason() const {
    const int code = context_ == nullptr ? 0 : proj_context_errno(context_);
    const char* const text = code == 0 ? nullptr : proj_context_errno_string(context_, code);
    return text == nullptr ? "not a projection" : text;
  }

  // Converts coordinates in place to degrees; NaN where they are not on the map.
  void apply(std::vector<double>& x, std::vector<double>& y) {
    const double unit = projection_.in_degrees ? degree_in_radians : 1;
    for (double& v : x) v *= unit;
    for (double& v : y) v *= unit;
    if (projection_.verified) {
      x_before_ = x;
      y_before_ = y;
    }
    transform(PJ_INV, x, y);
    if (projection_.verified) {
      // An inverse may give a longitude on the other side of the date line.
      const double centre = projection_.central_longitude * degree_in_radians;
      for (double& v : x) v = centre + std::remainder(v - centre, 2 * std::numbers::pi);
      x_again_ = x;
      y_again_ = y;
      transform(PJ_FWD, x_again_, y_again_);
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (projection_.verified &&
          !(std::hypot(x_again_[i] - x_before_[i], y_again_[i] - y_before_[i]) < tolerance())) {
        x[i] = std::nan("");
      }
      x[i] /= degree_in_radians;
      y[i] /= degree_in_radians;
      constexpr double rounding = 1e-9;
      const double from_centre = std::abs(x[i] - projection_.central_longitude);
      const bool wraps = projection_.may_repeat || projection_.in_degrees;
      const bool fits = std::isfinite(x[i]) && std::abs(y[i]) <= 90 + rounding &&
                        (wraps || from_centre <= 180 + rounding);
      if (!fits) x[i] = y[i] = std::nan("");
    }
  }

  // The forward projection of longitude and latitude in degrees.
  std::array<double, 2> forward(double longitude, double latitude) {
    const double from_centre = std::remainder(longitude - projection_.central_longitude, 360);
    one_x_ = {(projection_.central_longitude + from_centre) * degree_in_radians};
    one_y_ = {latitude * degree_in_radians};
    transform(PJ_FWD, one_x_, one_y_);
    return {one_x_[0], one_y_[0]};
  }

  [[nodiscard]] bool is_on_map(double x, double y) {
    one_x_ = {x};
    one_y_ = {y};
    apply(one_x_, one_y_);
    return std::isfinite(one_x_[0]);
  }
  // Of the last point that is_on_map() found.
  [[nodiscard]] std::pair<double, double> place() const { return {one_x_[0], one_y_[0]}; }

 private:
  // Far below any cell, far above rounding.
  [[nodiscard]] double tolerance() const { return 1e-7 * projection_.radius_m; }
  void transform(PJ_DIRECTION direction, std::vector<double>& x, std::vector<double>& y) {
    constexpr std::size_t stride = sizeof(double);
    proj_trans_generic(operation_, direction, x.data(), stride, x.size(), y.data(), stride,
                       y.size(), nullptr, 0, 0, nullptr, 0, 0);
  }

  const Projection& projection_;
  PJ_CONTEXT* context_;
  PJ* operation_ = nullptr;
  std::vector<double> x_before_, y_before_, x_again_, y_again_;
  std::vector<double> one_x_, one_y_;
};

// Distance of the edge of the map from its origin by direction. Points beyond it lie outside; the
// map is taken to be star-shaped about its origin, as those of all projections of appendix F are.
class Edge {
 public:
  Edge(Transform& inverse, const Projection& projection, double reach_m)
      : inverse_(inverse), projection_(projection) {
    for (std::size_t d = 0; d < directions; ++d) radius_.push_back(bisect(d, reach_m));
  }

  // Longitude and latitude just inside the edge; NaN if there are none.
  std::pair<double, double> nearest(double x, double y) {
    const double turn =
        std::atan2(y - projection_.origin_y_m, x - projection_.origin_x_m) / step + directions;
    const auto below = static_cast<std::size_t>(turn) % directions;
    double radius = std::min(radius_[below], radius_[(below + 1) % directions]);
    for (int tries = 0; tries < 20; ++tries) {
      radius *= inward;
      if (on_map(turn * step, radius)) return inverse_.place();
    }
    return {std::nan(""), std::nan("")};
  }

 private:
  static constexpr std::size_t directions = 1024;
  static constexpr double step = 2 * std::numbers::pi / directions;
  static constexpr double inward = 0.9999;

  bool on_map(double direction, double radius) {
    return inverse_.is_on_map(projection_.origin_x_m + radius * std::cos(direction),
                              projection_.origin_y_m + radius * std::sin(direction));
  }
  double bisect(std::size_t d, double reach_m) {
    double inside = 0;
    double beyond = reach_m;
    for (int halving = 0; halving < 40; ++halving) {
      const double middle = 0.5 * (inside + beyond);
      (on_map(step * static_cast<double>(d), middle) ? inside : beyond) = middle;
    }
    return inside;
  }

  Transform& inverse_;
  const Projection& projection_;
  std::vector<double> radius_;
};

Error unusable(const std::string& reason) { return make_error(ErrorKind::bad_data, reason); }

// The largest distance of a coordinate from the origin.
double farthest(const std::vector<double>& coordinates, double origin) {
  double out = 0;
  for (const double v : coordinates) out = std::max(out, std::abs(v - origin));
  return out;
}

struct ColumnPlace {
  double longitude;
  double latitude;
};

// The direction of the way between two places near `here`: along east and north, of length 1, or 0
// if there is no way.
std::array<float, 2> direction(const ColumnPlace& here, const ColumnPlace& from,
                               const ColumnPlace& to) {
  const double shrink = std::cos(here.latitude * degree_in_radians);
  const double east = std::remainder(to.longitude - from.longitude, 360.0) * shrink;
  const double north = to.latitude - from.latitude;
  const double length = std::hypot(east, north);
  if (!(length > 0)) return {0, 0};
  return {static_cast<float>(east / length), static_cast<float>(north / length)};
}

// The shortest distance of neighbours; 1 if there are none.
double shortest_step(const std::vector<double>& coordinates) {
  double out = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < coordinates.size(); ++i) {
    out = std::min(out, std::abs(coordinates[i] - coordinates[i - 1]));
  }
  return std::isfinite(out) ? out : 1;
}

}  // namespace

Result<ProjectedColumns> project_columns(const Projection& projection, const std::vector<double>& x,
                                         const std::vector<double>& y) {
  const double reach =
      std::hypot(farthest(x, projection.origin_x_m), farthest(y, projection.origin_y_m));
  const double reach_max = projection.in_degrees ? 1000 : 100 * projection.radius_m;
  if (!(reach <= reach_max)) return unusable("has coordinates far beyond its map");
  Transform inverse(projection);
  if (!inverse.exists()) return unusable("is refused by PROJ: " + inverse.reason());
  auto columns = std::make_shared<Columns>();
  columns->longitude.reserve(x.size() * y.size());
  columns->latitude.reserve(x.size() * y.size());
  ProjectedColumns out;
  std::vector<double> row_x;
  std::vector<double> row_y;
  for (const double at : y) {
    row_x = x;
    row_y.assign(x.size(), at);
    inverse.apply(row_x, row_y);
    columns->longitude.insert(columns->longitude.end(), row_x.begin(), row_x.end());
    columns->latitude.insert(columns->latitude.end(), row_y.begin(), row_y.end());
  }
  const auto is_outside = [](double v) { return std::isnan(v); };
  const auto& found = columns->longitude;
  out.outside_count =
      static_cast<std::size_t>(std::count_if(found.begin(), found.end(), is_outside));
  if (out.outside_count == found.size()) return unusable("has no column on the Earth");
  if (out.outside_count > 0) {
    if (projection.in_degrees || !inverse.is_on_map(projection.origin_x_m, projection.origin_y_m)) {
      return unusable("has columns that do not lie on the Earth");
    }
    Edge edge(inverse, projection, reach);
    out.outside.resize(found.size());
    for (std::size_t n = 0; n < found.size(); ++n) {
      if (!is_outside(found[n])) continue;
      out.outside[n] = true;
      std::tie(columns->longitude[n], columns->latitude[n]) =
          edge.nearest(x[n % x.size()], y[n / x.size()]);
      if (is_outside(found[n])) return unusable("has columns that do not lie on the Earth");
    }
  }
  unwrap_longitudes(columns->longitude, x.size());
  out.columns = std::move(columns);
  return out;
}

Result<AxisTangents> tangents_on_map(const Projection& projection, const std::vector<double>& x,
                                     const std::vector<double>& y,
                                     const ProjectedColumns& columns) {
  Transform inverse(projection);
  if (!inverse.exists()) return unusable("is refused by PROJ: " + inverse.reason());
  const double step = 1e-3 * std::min(shortest_step(x), shortest_step(y));
  AxisTangents out;
  out.x.resize(x.size() * y.size());
  out.y.resize(out.x.size());
  std::array<std::vector<double>, 2> before;  // longitudes and latitudes
  std::array<std::vector<double>, 2> after;
  for (std::size_t row = 0; row < y.size(); ++row) {
    for (const bool along_x : {true, false}) {
      for (const bool is_after : {false, true}) {
        auto& [to_x, to_y] = is_after ? after : before;
        const double aside = is_after ? step : -step;
        to_x = x;
        to_y.assign(x.size(), y[row] + (along_x ? 0 : aside));
        if (along_x) {
          for (double& v : to_x) v += aside;
        }
        inverse.apply(to_x, to_y);
      }
      for (std::size_t i = 0; i < x.size(); ++i) {
        const std::size_t n = row * x.size() + i;
        if (!columns.outside.empty() && columns.outside[n]) continue;
        const ColumnPlace here{columns.columns->longitude[n], columns.columns->latitude[n]};
        ColumnPlace from{before[0][i], before[1][i]};
        ColumnPlace to{after[0][i], after[1][i]};
        if (!std::isfinite(from.longitude)) from = here;
        if (!std::isfinite(to.longitude)) to = here;
        (along_x ? out.x : out.y)[n] = direction(here, from, to);
      }
    }
  }
  return out;
}

Result<std::array<double, 2>> project_place(const Projection& projection, double longitude,
                                            double latitude) {
  Transform inverse(projection);
  if (!inverse.exists()) return unusable("is refused by PROJ: " + inverse.reason());
  const auto at = inverse.forward(longitude, latitude);
  if (!(std::hypot(at[0], at[1]) <= 100 * projection.radius_m)) {
    return unusable("does not contain the first point");
  }
  return at;
}

}  // namespace windsplat::data::cf
