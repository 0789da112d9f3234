// Forecasts and what is aimed at in, the setting to draw by out.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "protocol/view.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/table.hpp"

namespace windsplat::quality {

// With both: the fastest setting that keeps the error within the budget, else the one within the
// budget that errs least.
struct Aim {
  std::optional<double> budget_ms;
  std::optional<double> max_error;  // linear RMSE
};

// An error that 95 of 100 frames keep, as far as errors scatter as forecast; and one that 5 of 100
// stay below.
double error_bound(const Forecast& forecast);
double error_low(const Forecast& forecast);

// Pixels of the view's picture at a setting.
double pixels_at(const protocol::View& view, const Setting& setting);

struct Choice {
  std::size_t setting = 0;
  bool fits = false;  // the budget; else it is the fastest there is
};

// Of the settings that are allowed for the view, and whose pictures have at most `pixels_most`
// pixels unless none has. `ms`: what each is expected to take.
Choice pick(const protocol::View& view, const Forecasts& forecasts,
            const std::array<double, settings_count>& ms, const Aim& aim, double pixels_most);

// By the forecasts' own times and without a limit of pixels.
Choice pick(const protocol::View& view, const Forecasts& forecasts, const Aim& aim);

}  // namespace windsplat::quality
