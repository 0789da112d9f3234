// Forecasts of the settings of a view -> its curve of error against time.
#pragma once

#include "protocol/measurements.hpp"
#include "protocol/view.hpp"
#include "server/quality/table.hpp"

namespace windsplat::quality {

// One point per setting allowed for the completed view, fastest first, and the one chosen by its
// budget, which includes the time of encoding, or error limit. The method of the view must not be
// reference.
protocol::ForecastDescription curve(const protocol::View& completed, const Forecasts& forecasts,
                                    double encoding_ms_a_pixel = 0);

}  // namespace windsplat::quality
