// Names of settings, and results of measured points: Pareto front, orders, medians.
#include "server/study/types.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/base/check.hpp"

namespace windsplat::study {

namespace {

constexpr std::size_t slope_points_min = 3;

bool beats(const Measurement& a, const Measurement& b) {
  return a.ms <= b.ms && a.rmse <= b.rmse && (a.ms < b.ms || a.rmse < b.rmse);
}

}  // namespace

const char* name_of(scene::Method method) {
  switch (method) {
    case scene::Method::kernel:
      return "kernel";
    case scene::Method::slab:
      return "slab";
    case scene::Method::reference:
      return "reference";
  }
  return "";
}

const char* name_of(scene::Compositing compositing) {
  switch (compositing) {
    case scene::Compositing::simple:
      return "simple";
    case scene::Compositing::cd_naive:
      return "cd-naive";
    case scene::Compositing::cd:
      return "cd";
    case scene::Compositing::analytic:
      return "analytic";
    case scene::Compositing::cd_euler:
      return "cd-euler";
  }
  return "";
}

const char* name_of(Knob knob) {
  switch (knob) {
    case Knob::stride:
      return "stride";
    case Knob::span:
      return "span";
    case Knob::slab_thickness:
      return "slabThickness";
    case Knob::stop_transmittance:
      return "stopTransmittance";
    case Knob::width:
      return "width";
  }
  return "";
}

double value_of(const Knobs& knobs, Knob knob) {
  switch (knob) {
    case Knob::stride:
      return knobs.stride;
    case Knob::span:
      return knobs.span;
    case Knob::slab_thickness:
      return knobs.slab_thickness;
    case Knob::stop_transmittance:
      return knobs.stop_transmittance;
    case Knob::width:
      return knobs.width;
  }
  return 0;
}

void mark_pareto(std::vector<Point>& points) {
  const auto counts = [](const Point& p) {
    return p.measured.stable && std::isfinite(p.measured.rmse);
  };
  for (Point& point : points) {
    point.pareto = counts(point) && std::none_of(points.begin(), points.end(), [&](const Point& p) {
                     return counts(p) && beats(p.measured, point.measured);
                   });
  }
}

double log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  WINDSPLAT_CHECK(x.size() == y.size());
  std::vector<double> u;
  std::vector<double> v;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0 && y[i] > 0 && std::isfinite(x[i]) && std::isfinite(y[i]))) continue;
    u.push_back(std::log(x[i]));
    v.push_back(std::log(y[i]));
  }
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  if (u.size() < slope_points_min) return unknown;
  double u_mean = 0;
  double v_mean = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    u_mean += u[i] / static_cast<double>(u.size());
    v_mean += v[i] / static_cast<double>(u.size());
  }
  double across = 0;
  double along = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    across += (u[i] - u_mean) * (v[i] - v_mean);
    along += (u[i] - u_mean) * (u[i] - u_mean);
  }
  return along > 0 ? across / along : unknown;
}

void find_order(const std::vector<Point>& points, Curve& curve) {
  std::vector<double> knob;
  std::vector<double> rmse;
  for (const std::size_t i : curve.points) {
    if (!points[i].measured.stable) continue;
    knob.push_back(value_of(points[i].setting.knobs, curve.knob));
    rmse.push_back(points[i].measured.rmse);
  }
  curve.order = log_slope(knob, rmse);
}

double median(std::vector<double> values) {
  WINDSPLAT_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

}  // namespace windsplat::study
