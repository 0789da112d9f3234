// Forecasts and limits on time and error -> the setting to render with.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "protocol/view.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/sizes.hpp"
#include "server/quality/table.hpp"

namespace windsplat::quality {

// With both limits: the fastest setting that satisfies both, otherwise the one within the time
// budget that has the least error.
struct Aim {
  std::optional<double> budget_ms;
  std::optional<double> max_error;  // linear RMSE
  // The frame precedes the final one of its view, which is the most accurate.
  bool before_final = false;
};

// Whether a setting may be chosen: it is allowed for the view, and not finer than the view's own
// unless for an error bound that does not apply to a frame before the final one.
bool is_candidate(const Setting& setting, const protocol::View& view, const Aim& aim);

// The 95 % and 5 % quantiles of the error by the forecast distribution.
double error_bound(const Forecast& forecast);
double error_low(const Forecast& forecast);

// Pixels of the view's picture at a setting.
double pixels_at(const protocol::View& view, const Setting& setting);

// The forecasts with the time of encoding each picture, which a budget includes.
Forecasts with_encoding(const protocol::View& view, Forecasts forecasts, double ms_a_pixel);

struct Choice {
  std::size_t setting = 0;  // its index in the list of settings, or of options
  bool fits = false;        // within the budget; otherwise the fastest setting was chosen
};

// Chooses among the candidates with at most `pixels_most` pixels, or among all if none is that
// small.
Choice pick(const protocol::View& view, const Forecasts& forecasts, const Aim& aim,
            double pixels_most = std::numeric_limits<double>::infinity());

// Chooses among the options alike, of those that differ by at most `step` sixteenths from the size
// of `from`, if it is given: an index of `options`, which are not empty.
struct Near {
  Setting from;
  int step = 0;
};
Choice pick(const protocol::View& view, const std::vector<Option>& options, const Aim& aim,
            double pixels_most, const std::optional<Near>& near = std::nullopt);

}  // namespace windsplat::quality
