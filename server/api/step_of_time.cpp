// Times are compared as milliseconds of the dataset's calendar.
#include "server/api/step_of_time.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>

#include "server/api/operations/parameters.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::api {
namespace {

constexpr std::int64_t minute_ms = 60'000;
constexpr std::int64_t day_ms = 86'400'000;

// Takes parts of a text from its beginning.
class Parts {
 public:
  explicit Parts(std::string_view text) : rest_(text) {}

  bool take(char wanted) {
    if (rest_.empty() || rest_.front() != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }
  // So many digits; -1: there are fewer.
  int digits(std::size_t count) {
    int value = 0;
    if (rest_.size() < count) return -1;
    for (const char digit : rest_.substr(0, count)) {
      if (digit < '0' || digit > '9') return -1;
      value = 10 * value + (digit - '0');
    }
    rest_.remove_prefix(count);
    return value;
  }
  // The digits of a fraction of a second, at most milliseconds; -1: none, or more.
  int fraction_ms() {
    const std::size_t count = std::min(rest_.find_first_not_of("0123456789"), rest_.size());
    if (count < 1 || count > 3) return -1;
    int value = digits(count);
    for (std::size_t n = count; n < 3; ++n) value *= 10;
    return value;
  }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

// "hh:mm", "hh:mm:ss" or "hh:mm:ss.fff" in milliseconds.
std::optional<std::int64_t> clock_of(Parts& parts) {
  const int hour = parts.digits(2);
  if (hour < 0 || hour > 23 || !parts.take(':')) return std::nullopt;
  const int minute = parts.digits(2);
  if (minute < 0 || minute > 59) return std::nullopt;
  std::int64_t ms = (std::int64_t{60} * hour + minute) * minute_ms;
  if (!parts.take(':')) return ms;
  const int second = parts.digits(2);
  if (second < 0 || second > 59) return std::nullopt;
  ms += std::int64_t{1000} * second;
  if (!parts.take('.')) return ms;
  const int fraction = parts.fraction_ms();
  return fraction < 0 ? std::nullopt : std::optional(ms + fraction);
}

// What is to be subtracted for UTC. A plus sign of a query that was not encoded is a space.
std::optional<std::int64_t> zone_of(Parts& parts) {
  if (parts.take('Z') || parts.at_end()) return 0;
  const bool east = parts.take('+') || parts.take(' ');
  if (!east && !parts.take('-')) return std::nullopt;
  const int hours = parts.digits(2);
  if (hours < 0 || hours > 18 || !parts.take(':')) return std::nullopt;
  const int minutes = parts.digits(2);
  if (minutes < 0 || minutes > 59) return std::nullopt;
  const std::int64_t ms = (std::int64_t{60} * hours + minutes) * minute_ms;
  return east ? ms : -ms;
}

std::optional<std::int64_t> milliseconds_of(std::string_view text, data::cf::Calendar calendar) {
  Parts parts(text);
  data::cf::Date date;
  date.year = parts.digits(4);
  if (date.year < 0 || !parts.take('-')) return std::nullopt;
  date.month = parts.digits(2);
  if (date.month < 0 || !parts.take('-')) return std::nullopt;
  date.day = parts.digits(2);
  if (date.day < 0 || !data::cf::is_valid(date, calendar)) return std::nullopt;
  std::int64_t ms = data::cf::day_number(date, calendar) * day_ms;
  if (parts.at_end()) return ms;
  if (!parts.take('T')) return std::nullopt;
  const auto clock = clock_of(parts);
  if (!clock) return std::nullopt;
  const auto zone = zone_of(parts);
  if (!zone || !parts.at_end()) return std::nullopt;
  ms += *clock - *zone;
  return ms;
}

// The steps around a time.
struct Around {
  struct Step {
    std::size_t index = 0;
    std::int64_t ms = 0;
  };
  std::optional<Step> exact;
  std::optional<Step> before;
  std::optional<Step> after;

  void add(const Step& step, std::int64_t wanted) {
    if (step.ms == wanted) {
      if (!exact) exact = step;
    } else if (step.ms < wanted) {
      if (!before || step.ms > before->ms) before = step;
    } else if (!after || step.ms < after->ms) {
      after = step;
    }
  }
};

// Nothing: a step has no date.
std::optional<Around> steps_around(const std::vector<data::TimeStep>& steps, std::int64_t wanted,
                                   data::cf::Calendar calendar) {
  auto from = steps.begin();
  auto to = steps.end();
  const auto earlier = [](const data::TimeStep& a, const data::TimeStep& b) {
    return a.value < b.value;
  };
  // In long series only the places beside the time are read.
  if (std::is_sorted(from, to, earlier)) {
    const auto at = std::partition_point(from, to, [&](const data::TimeStep& step) {
      const auto ms = milliseconds_of(step.text, calendar);
      return ms && *ms < wanted;
    });
    if (at != from) from = at - 1;
    if (at != to) to = at + 1;
  }
  Around out;
  for (auto step = from; step != to; ++step) {
    const auto ms = milliseconds_of(step->text, calendar);
    if (!ms) return std::nullopt;
    out.add({static_cast<std::size_t>(step - steps.begin()), *ms}, wanted);
  }
  return out;
}

std::string named(const data::DatasetInfo& info, const Around::Step& step) {
  return info.steps[step.index].text + " (step " + std::to_string(step.index) + ')';
}

Error no_such_step(const data::DatasetInfo& info, const Around& around, std::string_view time) {
  std::string text = "query parameter 'datetime': no step is at " + printable(time, 40) + "; ";
  if (around.before) text += "the one before is " + named(info, *around.before);
  if (around.before && around.after) text += ", ";
  if (around.after) text += "the one after is " + named(info, *around.after);
  return make_error(ErrorKind::invalid, text + "; 'nearest=true' takes the nearest");
}

}  // namespace

Result<std::size_t> step_of_time(const data::DatasetInfo& info, std::string_view time,
                                 Match match) {
  const auto calendar = data::cf::parse_calendar(info.time_calendar);
  const auto no_dates = [&] {
    return make_error(ErrorKind::invalid, "query parameter 'datetime': the steps of dataset '" +
                                              printable(info.id) + "' have no dates; use 'step'");
  };
  if (!calendar || !milliseconds_of(info.steps.front().text, *calendar)) return no_dates();
  const auto wanted = milliseconds_of(time, *calendar);
  if (!wanted) {
    return make_error(
        ErrorKind::malformed,
        "query parameter 'datetime' must be a time of the dataset's calendar such as " +
            info.steps.front().text + ", not " + printable(time, 40));
  }
  const auto around = steps_around(info.steps, *wanted, *calendar);
  if (!around) return no_dates();
  if (around->exact) return around->exact->index;
  if (match == Match::exact) return no_such_step(info, *around, time);
  if (!around->after) return around->before->index;
  if (!around->before) return around->after->index;
  return *wanted - around->before->ms <= around->after->ms - *wanted ? around->before->index
                                                                     : around->after->index;
}

TimeQuery read_time(http::QueryReader& query) {
  TimeQuery out;
  out.time = read_text(query, parameters::time);
  out.nearest = read_boolean(query, parameters::nearest);
  return out;
}

Result<std::optional<std::size_t>> step_of(const TimeQuery& query, bool has_step,
                                           const data::DatasetInfo& info) {
  if (!query.time) {
    if (!query.nearest) return std::optional<std::size_t>{};
    return make_error(ErrorKind::invalid, "query parameter 'nearest' requires 'datetime'");
  }
  if (has_step) {
    return make_error(ErrorKind::invalid,
                      "query parameters 'step' and 'datetime' are mutually exclusive");
  }
  const auto step = step_of_time(info, *query.time,
                                 query.nearest.value_or(false) ? Match::nearest : Match::exact);
  if (!step) return step.error();
  return std::optional(*step);
}

}  // namespace windsplat::api
