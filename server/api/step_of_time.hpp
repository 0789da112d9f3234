// A time of a request -> the step of a dataset.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {

enum class Match { exact, nearest };

// The step at a time of ISO 8601 in the calendar of the dataset: YYYY-MM-DD, with Thh:mm, seconds
// and their fraction, and with Z or an offset (without: UTC). Of two equally near steps the earlier
// one; of equal times the first. Errors, which name the parameter 'datetime': malformed (not of
// this form, no such day); invalid (steps without dates; no step at this time, with those before
// and after).
Result<std::size_t> step_of_time(const data::DatasetInfo& info, std::string_view time, Match match);

// What a query says of the time of a step.
struct TimeQuery {
  std::optional<std::string> time;
  std::optional<bool> nearest;
};
TimeQuery read_time(http::QueryReader& query);
// The step at the time of the query; nullopt: it has none. `has_step`: the query has a number, too.
// Errors: those of step_of_time(); invalid (a number and a time; 'nearest' without a time).
Result<std::optional<std::size_t>> step_of(const TimeQuery& query, bool has_step,
                                           const data::DatasetInfo& info);

}  // namespace windsplat::api
