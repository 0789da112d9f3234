// A time of a request -> the step of a dataset.
#pragma once

#include <cstddef>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::api {

enum class Match { exact, nearest };

// The step at a time of ISO 8601 in the calendar of the dataset: YYYY-MM-DD, with Thh:mm, seconds
// and their fraction, and with Z or an offset (without: UTC). Of two equally near steps the earlier
// one; of equal times the first. Errors, which name the parameter 'datetime': malformed (not of
// this form, no such day); invalid (steps without dates; no step at this time, with those before
// and after).
Result<std::size_t> step_of_time(const data::DatasetInfo& info, std::string_view time, Match match);

}  // namespace windsplat::api
