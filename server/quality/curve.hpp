// Forecasts of a view's settings in, its curve of error against time out.
#pragma once

#include "protocol/measurements.hpp"
#include "protocol/view.hpp"
#include "server/quality/table.hpp"

namespace windsplat::quality {

// A point for each setting that is allowed for the completed view, which is none of method
// reference: the fastest first, and which of them its budget or error picks.
protocol::ForecastDescription curve(const protocol::View& completed, const Forecasts& forecasts);

}  // namespace windsplat::quality
