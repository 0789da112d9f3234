// Calendars in integer arithmetic on day numbers, and the "<unit> since <epoch>" grammar.
#include "server/data/cf/time.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "server/base/ascii.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::int64_t ms_per_day = 86'400'000;
constexpr std::int64_t year_limit = 10'000'000;

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - ((a % b != 0 && (a < 0) != (b < 0)) ? 1 : 0);
}

bool divides(std::int64_t divisor, std::int64_t year) { return year % divisor == 0; }

bool is_leap(std::int64_t year, Calendar calendar) {
  switch (calendar) {
    case Calendar::proleptic_gregorian:
      return divides(4, year) && (!divides(100, year) || divides(400, year));
    case Calendar::julian:
      return divides(4, year);
    case Calendar::all_leap:
      return true;
    default:
      return false;
  }
}

int month_length(std::int64_t year, int month, Calendar calendar) {
  constexpr std::array<int, 12> month_days{31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  if (calendar == Calendar::day360) {
    return 30;
  }
  return month_days.at(static_cast<std::size_t>(month - 1)) +
         (month == 2 && is_leap(year, calendar) ? 1 : 0);
}

// Days in the years 0 .. year-1; negative before year 0. Year 0 is itself a leap year, so ceil(year
// / n) multiples of n lie in 0 .. year-1.
std::int64_t days_before_year(std::int64_t year, Calendar calendar) {
  const auto multiples = [year](std::int64_t n) { return floor_div(year + n - 1, n); };
  switch (calendar) {
    case Calendar::proleptic_gregorian:
      return 365 * year + multiples(4) - multiples(100) + multiples(400);
    case Calendar::julian:
      return 365 * year + multiples(4);
    case Calendar::all_leap:
      return 366 * year;
    case Calendar::day360:
      return 360 * year;
    default:
      return 365 * year;
  }
}

// Any calendar except the mixed one.
std::int64_t plain_day_number(const Date& date, Calendar calendar) {
  std::int64_t days = days_before_year(date.year, calendar);
  for (int month = 1; month < date.month; ++month) {
    days += month_length(date.year, month, calendar);
  }
  return days + date.day - 1;
}

Date plain_date_of(std::int64_t number, Calendar calendar) {
  // Start from an estimate by the mean length of a year, then correct it.
  Date date;
  date.year = static_cast<std::int64_t>(std::floor(
      static_cast<double>(number) / (static_cast<double>(days_before_year(400, calendar)) / 400)));
  while (days_before_year(date.year, calendar) > number) {
    --date.year;
  }
  while (days_before_year(date.year + 1, calendar) <= number) {
    ++date.year;
  }
  std::int64_t rest = number - days_before_year(date.year, calendar);
  while (rest >= month_length(date.year, date.month, calendar)) {
    rest -= month_length(date.year, date.month, calendar);
    ++date.month;
  }
  date.day = static_cast<int>(rest) + 1;
  return date;
}

// The mixed calendar counts on the Gregorian scale; its Julian part is shifted so that
// 1582-10-04 (Julian) is the day before 1582-10-15 (Gregorian).
struct Reform {
  std::int64_t first_gregorian =
      plain_day_number(Date{1582, 10, 15}, Calendar::proleptic_gregorian);
  std::int64_t julian_shift =
      first_gregorian - 1 - plain_day_number(Date{1582, 10, 4}, Calendar::julian);
};

bool is_gregorian_part(const Date& date) {
  return std::pair(date.year, date.month * 100 + date.day) >=
         std::pair<std::int64_t, int>(1582, 1015);
}

// Parses an epoch from left to right.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : rest_(text) {}

  void skip_blanks() {
    while (!rest_.empty() && rest_.front() == ' ') {
      rest_.remove_prefix(1);
    }
  }
  bool take(char c) {
    if (rest_.empty() || rest_.front() != c) {
      return false;
    }
    rest_.remove_prefix(1);
    return true;
  }
  // Up to digits_max digits, at least one.
  std::optional<std::int64_t> digits(std::size_t digits_max, std::size_t* taken = nullptr) {
    std::int64_t value = 0;
    std::size_t n = 0;
    while (n < rest_.size() && n < digits_max && rest_[n] >= '0' && rest_[n] <= '9') {
      value = value * 10 + (rest_[n] - '0');
      ++n;
    }
    rest_.remove_prefix(n);
    if (taken != nullptr) {
      *taken = n;
    }
    return n == 0 ? std::nullopt : std::optional(value);
  }
  [[nodiscard]] bool digit_next() const {
    return !rest_.empty() && rest_.front() >= '0' && rest_.front() <= '9';
  }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

std::optional<Date> parse_date(Cursor& cursor) {
  const bool before_zero = cursor.take('-');
  Date date;
  const auto year = cursor.digits(8);
  if (!year || *year > year_limit || !cursor.take('-')) {
    return std::nullopt;
  }
  const auto month = cursor.digits(2);
  if (!month || !cursor.take('-')) {
    return std::nullopt;
  }
  const auto day = cursor.digits(2);
  if (!day) {
    return std::nullopt;
  }
  date.year = before_zero ? -*year : *year;
  date.month = static_cast<int>(*month);
  date.day = static_cast<int>(*day);
  return date;
}

// hh[:mm[:ss[.fff]]] -> milliseconds of the day.
std::optional<std::int64_t> parse_clock(Cursor& cursor) {
  const auto hours = cursor.digits(2);
  if (!hours || *hours > 24) {
    return std::nullopt;
  }
  std::int64_t ms = *hours * 3'600'000;
  if (!cursor.take(':')) {
    return ms;
  }
  const auto minutes = cursor.digits(2);
  if (!minutes || *minutes > 59) {
    return std::nullopt;
  }
  ms += *minutes * 60'000;
  if (!cursor.take(':')) {
    return ms;
  }
  const auto seconds = cursor.digits(2);
  if (!seconds || *seconds > 59) {
    return std::nullopt;
  }
  ms += *seconds * 1000;
  if (cursor.take('.')) {
    std::int64_t unit = 100;
    while (cursor.digit_next()) {
      ms += *cursor.digits(1) * unit;
      unit /= 10;
    }
  }
  return ms;
}

// Z, UTC, GMT, or +h, +hh:mm, +hhmm -> milliseconds east of UTC, at most 18 hours.
std::optional<std::int64_t> parse_zone(Cursor& cursor) {
  const std::string name = lower(cursor.rest());
  if (name.empty() || name == "z" || name == "utc" || name == "gmt") {
    return 0;
  }
  const bool west = cursor.take('-');
  if (!west && !cursor.take('+') && !cursor.digit_next()) {
    return std::nullopt;
  }
  std::size_t taken = 0;
  const auto number = cursor.digits(4, &taken);
  if (!number) {
    return std::nullopt;
  }
  std::int64_t minutes = taken > 2 ? *number / 100 * 60 + *number % 100 : *number * 60;
  if (cursor.take(':')) {
    const auto more = cursor.digits(2);
    if (!more) {
      return std::nullopt;
    }
    minutes += *more;
  }
  if (!cursor.at_end() || minutes > 1080) {
    return std::nullopt;
  }
  return (west ? -minutes : minutes) * 60'000;
}

// Milliseconds since the calendar's day zero, UTC.
std::optional<std::int64_t> parse_epoch(std::string_view text, Calendar calendar) {
  Cursor cursor(trim(text));
  const auto date = parse_date(cursor);
  if (!date || !is_valid(*date, calendar)) {
    return std::nullopt;
  }
  std::int64_t ms = 0;
  if (!cursor.take('T')) {
    cursor.skip_blanks();
  }
  if (cursor.digit_next()) {
    const auto clock = parse_clock(cursor);
    if (!clock) {
      return std::nullopt;
    }
    ms = *clock;
  }
  cursor.skip_blanks();
  const auto zone = parse_zone(cursor);
  if (!zone) {
    return std::nullopt;
  }
  return day_number(*date, calendar) * ms_per_day + ms - *zone;
}

// Milliseconds in a unit of fixed length; 0 if it has none.
std::int64_t unit_ms(std::string_view unit) {
  struct Unit {
    std::string_view name;
    std::int64_t ms;
  };
  constexpr std::array<Unit, 21> known_units{
      {{"day", ms_per_day},  {"days", ms_per_day}, {"d", ms_per_day},   {"hour", 3'600'000},
       {"hours", 3'600'000}, {"hr", 3'600'000},    {"hrs", 3'600'000},  {"h", 3'600'000},
       {"minute", 60'000},   {"minutes", 60'000},  {"min", 60'000},     {"mins", 60'000},
       {"second", 1000},     {"seconds", 1000},    {"sec", 1000},       {"secs", 1000},
       {"s", 1000},          {"millisecond", 1},   {"milliseconds", 1}, {"msec", 1},
       {"msecs", 1}}};
  const auto* at = std::find_if(known_units.begin(), known_units.end(),
                                [&](const Unit& known) { return known.name == unit; });
  return at == known_units.end() ? 0 : at->ms;
}

std::string iso_text(std::int64_t ms, Calendar calendar) {
  const std::int64_t day = floor_div(ms, ms_per_day);
  const std::int64_t in_day = ms - day * ms_per_day;
  const Date date = date_of(day, calendar);
  // ISO 8601 requires a sign for years outside 0000 to 9999.
  const bool plain = date.year >= 0 && date.year <= 9999;
  std::array<char, 64> out{};
  std::snprintf(out.data(), out.size(),
                plain ? "%04lld-%02d-%02dT%02d:%02d:%02d" : "%+05lld-%02d-%02dT%02d:%02d:%02d",
                static_cast<long long>(date.year), date.month, date.day,
                static_cast<int>(in_day / 3'600'000), static_cast<int>(in_day / 60'000 % 60),
                static_cast<int>(in_day / 1000 % 60));
  std::string text(out.data());
  if (in_day % 1000 != 0) {
    std::snprintf(out.data(), out.size(), ".%03d", static_cast<int>(in_day % 1000));
    text += out.data();
  }
  return text + "Z";
}

// Months in a unit that is counted on the calendar; 0 if it is not.
int unit_months(std::string_view unit) {
  if (unit == "month" || unit == "months" || unit == "mon" || unit == "mons") return 1;
  const bool years = unit == "year" || unit == "years" || unit == "yr" || unit == "yrs" ||
                     unit == "common_year" || unit == "common_years";
  return years ? 12 : 0;
}

struct Scale {
  std::int64_t unit_ms = 0;
  int unit_months = 0;  // used if unit_ms is 0
  std::int64_t epoch_ms = 0;
  Calendar calendar = Calendar::standard;
};

// Parses units and calendar; otherwise sets the reason.
std::optional<Scale> parse_scale(std::string_view units, std::string_view calendar,
                                 std::string& reason) {
  const std::string text = lower(trim(units));
  const auto since = text.find(" since ");
  if (since == std::string::npos) {
    // An elapsed time ("s") needs no date.
    if (unit_ms(text) == 0) reason = "its units have no epoch";
    return std::nullopt;
  }
  Scale scale;
  const std::string unit(trim(std::string_view(text).substr(0, since)));
  scale.unit_ms = unit_ms(unit);
  scale.unit_months = unit_months(unit);
  if (scale.unit_ms == 0 && scale.unit_months == 0) {
    reason = "its unit is unknown";
    return std::nullopt;
  }
  const auto known = parse_calendar(calendar);
  if (!known) {
    reason = "its calendar is unknown";
    return std::nullopt;
  }
  scale.calendar = *known;
  // Parsed from the original text, because T and Z are upper case there.
  const auto epoch = parse_epoch(trim(units).substr(since + 7), scale.calendar);
  if (!epoch) {
    reason = "its epoch is not a date of its calendar";
    return std::nullopt;
  }
  scale.epoch_ms = *epoch;
  return scale;
}

// The same day and time `months` later, or the last day of a shorter month.
std::int64_t months_on(std::int64_t epoch_ms, std::int64_t months, Calendar calendar) {
  const std::int64_t epoch_day = floor_div(epoch_ms, ms_per_day);
  Date date = date_of(epoch_day, calendar);
  const std::int64_t month = date.year * 12 + (date.month - 1) + months;
  date.year = floor_div(month, 12);
  date.month = static_cast<int>(month - date.year * 12) + 1;
  while (date.day > 1 && !is_valid(date, calendar)) --date.day;
  return day_number(date, calendar) * ms_per_day + (epoch_ms - epoch_day * ms_per_day);
}

// Whole calendar months; the fraction is relative to the length of its month.
std::optional<std::int64_t> months_to_ms(double value, const Scale& scale) {
  const double months = value * scale.unit_months;
  const double whole = std::floor(months);
  constexpr auto months_max = static_cast<double>(6 * year_limit);
  if (!std::isfinite(months) || std::abs(whole) > months_max ||
      std::abs(date_of(floor_div(scale.epoch_ms, ms_per_day), scale.calendar).year) >
          year_limit / 4) {
    return std::nullopt;
  }
  const auto count = static_cast<std::int64_t>(whole);
  const std::int64_t from = months_on(scale.epoch_ms, count, scale.calendar);
  if (months == whole) return from;
  const std::int64_t to = months_on(scale.epoch_ms, count + 1, scale.calendar);
  return from + std::llround((months - whole) * static_cast<double>(to - from));
}

// Whole units are exact; the fraction is rounded to the millisecond. nullopt beyond about 10^7
// years.
std::optional<std::int64_t> to_ms(double value, const Scale& scale) {
  if (scale.unit_months > 0) return months_to_ms(value, scale);
  const double whole = std::floor(value);
  if (!std::isfinite(value) || std::abs(whole) * static_cast<double>(scale.unit_ms) > 3e17) {
    return std::nullopt;
  }
  const double fraction = value - whole;
  return scale.epoch_ms + static_cast<std::int64_t>(whole) * scale.unit_ms +
         std::llround(fraction * static_cast<double>(scale.unit_ms));
}

}  // namespace

std::optional<Calendar> parse_calendar(std::string_view text) {
  const std::string name = lower(trim(text));
  if (name.empty() || name == "standard" || name == "gregorian") {
    return Calendar::standard;
  }
  if (name == "proleptic_gregorian") {
    return Calendar::proleptic_gregorian;
  }
  if (name == "julian") {
    return Calendar::julian;
  }
  if (name == "noleap" || name == "365_day") {
    return Calendar::noleap;
  }
  if (name == "all_leap" || name == "366_day") {
    return Calendar::all_leap;
  }
  if (name == "360_day") {
    return Calendar::day360;
  }
  return std::nullopt;
}

bool is_valid(const Date& date, Calendar calendar) {
  if (std::abs(date.year) > year_limit || date.month < 1 || date.month > 12 || date.day < 1) {
    return false;
  }
  if (calendar == Calendar::standard) {
    if (date.year == 1582 && date.month == 10 && date.day > 4 && date.day < 15) {
      return false;
    }
    calendar = is_gregorian_part(date) ? Calendar::proleptic_gregorian : Calendar::julian;
  }
  return date.day <= month_length(date.year, date.month, calendar);
}

std::int64_t day_number(const Date& date, Calendar calendar) {
  if (calendar != Calendar::standard) {
    return plain_day_number(date, calendar);
  }
  if (is_gregorian_part(date)) {
    return plain_day_number(date, Calendar::proleptic_gregorian);
  }
  return plain_day_number(date, Calendar::julian) + Reform{}.julian_shift;
}

Date date_of(std::int64_t number, Calendar calendar) {
  if (calendar != Calendar::standard) {
    return plain_date_of(number, calendar);
  }
  const Reform reform;
  if (number >= reform.first_gregorian) {
    return plain_date_of(number, Calendar::proleptic_gregorian);
  }
  return plain_date_of(number - reform.julian_shift, Calendar::julian);
}

DecodedTime decode_time(const std::vector<double>& values, std::string_view units,
                        std::string_view calendar) {
  DecodedTime out;
  const auto scale = parse_scale(units, calendar, out.reason);
  for (const double value : values) {
    TimeStep step{value, number_text(value)};
    if (scale) {
      if (const auto ms = to_ms(value, *scale)) {
        step.text = iso_text(*ms, scale->calendar);
      } else {
        out.reason = "a value is out of range";
      }
    }
    out.steps.push_back(std::move(step));
  }
  return out;
}

std::optional<std::vector<double>> convert_times(const std::vector<double>& values,
                                                 const TimeUnits& from, const TimeUnits& to) {
  if (from.units == to.units && lower(from.calendar) == lower(to.calendar)) return values;
  std::string ignored;
  const auto source = parse_scale(from.units, from.calendar, ignored);
  const auto target = parse_scale(to.units, to.calendar, ignored);
  if (!source || !target || target->unit_months > 0) return std::nullopt;
  // Both calendars agree from the first Gregorian day onwards.
  const auto gregorian = [](const Scale& scale) {
    return scale.calendar == Calendar::proleptic_gregorian || scale.calendar == Calendar::standard;
  };
  const std::int64_t reform_ms = Reform{}.first_gregorian * ms_per_day;
  std::vector<double> out;
  for (const double value : values) {
    const auto ms = to_ms(value, *source);
    const bool comparable =
        source->calendar == target->calendar || (gregorian(*source) && gregorian(*target) && ms &&
                                                 *ms >= reform_ms && target->epoch_ms >= reform_ms);
    if (!ms || !comparable) return std::nullopt;
    out.push_back(static_cast<double>(*ms - target->epoch_ms) /
                  static_cast<double>(target->unit_ms));
  }
  return out;
}

std::string number_text(double value) {
  std::array<char, 40> out{};
  const auto end = std::to_chars(out.data(), out.data() + out.size(), value);
  return end.ec == std::errc() ? std::string(out.data(), end.ptr) : std::string("?");
}

}  // namespace windsplat::data::cf
