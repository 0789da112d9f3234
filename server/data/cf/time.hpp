// Converts CF time coordinates to steps with ISO 8601 text. Depends on the arguments only, without
// I/O.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// CF 1.8, section 4.4.1. "standard" is Julian up to 1582-10-04 and Gregorian from 1582-10-15.
enum class Calendar { standard, proleptic_gregorian, julian, noleap, all_leap, day360 };

// The calendar of a `calendar` attribute; empty text means standard. nullopt if unknown.
std::optional<Calendar> parse_calendar(std::string_view text);

// A day of a calendar. Years are numbered astronomically: year 0 precedes year 1.
struct Date {
  std::int64_t year = 0;
  int month = 1;  // 1..12
  int day = 1;    // 1..31

  bool operator==(const Date&) const = default;
};

[[nodiscard]] bool is_valid(const Date& date, Calendar calendar);

// Days since the calendar's own day zero, and back; |year| <= 10^7.
std::int64_t day_number(const Date& date, Calendar calendar);
Date date_of(std::int64_t day_number, Calendar calendar);

struct DecodedTime {
  std::vector<TimeStep> steps;
  std::string reason;  // why times are given as plain numbers; empty if they are dates
};

// values: one per step, in `units` ("hours since 2001-01-01 00:00"). Times are rounded to the
// millisecond. Months and years are calendar months and years; fractions are relative to the length
// of their month. If unit, epoch or calendar is not supported, the strings are plain numbers.
DecodedTime decode_time(const std::vector<double>& values, std::string_view units,
                        std::string_view calendar);

struct TimeUnits {
  std::string units;
  std::string calendar;
};

// Converts times to other units, to the millisecond. Empty if a unit is not supported, the
// calendars have different days, or `to` counts months.
std::optional<std::vector<double>> convert_times(const std::vector<double>& values,
                                                 const TimeUnits& from, const TimeUnits& to);

// Whether units count from a time: "hours since 2001-01-01".
inline bool counts_from_a_time(std::string_view units) {
  return units.find(" since ") != std::string_view::npos;
}

// The shortest decimal text that reads back as the same double.
std::string number_text(double value);

}  // namespace windsplat::data::cf
