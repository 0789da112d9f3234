// Times of GrADS: initial time and increment of tdef -> date of each step and file names by
// template.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace windsplat::data::grads {

struct Date {
  int year = 0;
  int month = 1;
  int day = 1;
  int hour = 0;
  int minute = 0;
};

struct Clock {
  Date first;
  std::int64_t increment = 1;
  char unit = 'h';       // n minutes, h hours, d days, m months, y years
  bool no_leap = false;  // every year has 365 days
};

// "12:30Z05MAR1999", "00Z1jan90", "jan1979": a year of two digits lies between 1950 and 2049.
std::optional<Date> parse_date(std::string_view text);
// "6hr" into the increment and unit of a clock.
bool parse_increment(std::string_view text, Clock& clock);

// step counts from 0. nullopt after the year 9999.
std::optional<Date> date_of(const Clock& clock, std::int64_t step);
// Minutes between the first step and a date.
std::int64_t minutes_since_first(const Clock& clock, const Date& date);
// "1999-03-05 12:30:00"
std::string text_of(const Date& date);

// The name of the file that contains a step. nullopt if the template has an unknown part, which is
// then stored in `problem`.
std::optional<std::string> expand(std::string_view name, const Clock& clock, std::int64_t step,
                                  std::string& problem);

}  // namespace windsplat::data::grads
