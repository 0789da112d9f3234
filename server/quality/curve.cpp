// Sorts points by time and marks those of the Pareto front.
#include "server/quality/curve.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

#include "server/base/check.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/pick.hpp"

namespace windsplat::quality {
namespace {

protocol::ForecastPoint point_at(const protocol::View& view, const Setting& setting,
                                 const Forecast& forecast) {
  const bool slab = setting.method == protocol::MethodName::slab;
  protocol::ForecastPoint point;
  point.method = slab ? "slab" : "kernel";
  if (slab) point.slab_thickness = view.method.slab_thickness / setting.thinner;
  const PictureSize size = size_at(view, setting);
  point.width = size.width;
  point.height = size.height;
  point.coarser = setting.coarser;
  point.ms = forecast.ms;
  point.timed = forecast.timed;
  point.error = std::min(forecast.error, 1.0);
  point.error_low = std::clamp(error_low(forecast), std::min(error_least, point.error), 1.0);
  point.error_high = std::min(error_bound(forecast), 1.0);
  point.measured = forecast.measured;
  return point;
}

}  // namespace

protocol::ForecastDescription curve(const protocol::View& completed, const Forecasts& forecasts,
                                    double encoding_ms_a_pixel) {
  WINDSPLAT_CHECK(completed.method.name != protocol::MethodName::reference);
  std::vector<std::size_t> order(settings_count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order, [&](std::size_t i) { return !is_allowed(settings[i], completed); });
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return forecasts[a].ms != forecasts[b].ms ? forecasts[a].ms < forecasts[b].ms
                                              : forecasts[a].error < forecasts[b].error;
  });

  protocol::ForecastDescription out;
  out.width = completed.image.width;
  out.height = completed.image.height;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    out.points.push_back(point_at(completed, settings[i], forecasts[i]));
    protocol::ForecastPoint& point = out.points.back();
    point.pareto = point.error < least;  // uses the clamped error that is reported
    least = std::min(least, point.error);
  }
  const Aim aim{completed.quality.budget_ms, completed.quality.max_error};
  if (aim.budget_ms || aim.max_error) {
    const std::size_t picked =
        pick(completed, with_encoding(completed, forecasts, encoding_ms_a_pixel), aim).setting;
    out.chosen =
        static_cast<std::size_t>(std::find(order.begin(), order.end(), picked) - order.begin());
  }
  return out;
}

}  // namespace windsplat::quality
