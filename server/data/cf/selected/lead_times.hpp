// Lead times of forecasts -> valid times, if the file has one reference time. ArrayFile ->
// ArrayFile.
#pragma once

#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// The note of a file whose time steps are the lead times of the dimension.
std::string lead_time_note(const std::string& dimension);

// The file itself, unless it has lead times that count from no time, and one reference time (CF
// standard names forecast_period, forecast_reference_time): on its time dimension, or a single lead
// time in a file without times. Then a variable `valid_time` is appended, the sum of both in the
// units of the reference time, which becomes the coordinate of the dimension. Lead times in unknown
// units stay. Errors: bad_data.
Result<std::unique_ptr<ArrayFile>> with_valid_times(std::unique_ptr<ArrayFile> file);

}  // namespace windsplat::data::cf
