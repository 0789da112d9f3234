// Date arithmetic with std::chrono, or with years of 365 days.
#include "server/data/formats/grads/dates.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"

namespace windsplat::data::grads {

namespace {

constexpr std::array<std::string_view, 12> months{"jan", "feb", "mar", "apr", "may", "jun",
                                                  "jul", "aug", "sep", "oct", "nov", "dec"};
constexpr std::array<int, 13> days_before{0,   31,  59,  90,  120, 151, 181,
                                          212, 243, 273, 304, 334, 365};
constexpr int year_max = 9999;

std::int64_t day_number(const Date& date, bool no_leap) {
  if (no_leap) {
    return std::int64_t{365} * date.year +
           days_before.at(static_cast<std::size_t>(date.month - 1)) + date.day - 1;
  }
  const std::chrono::year_month_day day(std::chrono::year(date.year),
                                        std::chrono::month(static_cast<unsigned>(date.month)),
                                        std::chrono::day(static_cast<unsigned>(date.day)));
  return std::chrono::sys_days(day).time_since_epoch().count();
}

void set_day(Date& date, std::int64_t number, bool no_leap) {
  if (no_leap) {
    date.year = static_cast<int>(number / 365);
    const auto in_year = static_cast<int>(number % 365);
    const auto* after = std::upper_bound(days_before.begin(), days_before.end(), in_year);
    date.month = static_cast<int>(after - days_before.begin());
    date.day = in_year - *(after - 1) + 1;
    return;
  }
  const std::chrono::year_month_day day{
      std::chrono::sys_days(std::chrono::days(static_cast<int>(number)))};
  date.year = static_cast<int>(day.year());
  date.month = static_cast<int>(static_cast<unsigned>(day.month()));
  date.day = static_cast<int>(static_cast<unsigned>(day.day()));
}

std::int64_t minutes_of(const Date& date, bool no_leap) {
  return (day_number(date, no_leap) * 24 + date.hour) * 60 + date.minute;
}

// Takes at most `most` digits from the front; -1 if there are none.
int take_digits(std::string_view& text, std::size_t most) {
  std::size_t end = 0;
  while (end < text.size() && end < most && text[end] >= '0' && text[end] <= '9') ++end;
  if (end == 0) return -1;
  const int out = static_cast<int>(bytes::to_integer(text.substr(0, end)).value_or(0));
  text.remove_prefix(end);
  return out;
}

std::string digits(std::int64_t number, std::size_t width) {
  std::string out = std::to_string(number);
  if (out.size() < width) out.insert(0, width - out.size(), '0');
  return out;
}

struct Part {
  std::string_view mark;
  std::string (*text)(const Date& date);
};
constexpr auto date_parts = std::to_array<Part>({
    {"y4", [](const Date& d) { return digits(d.year, 4); }},
    {"y2", [](const Date& d) { return digits(d.year % 100, 2); }},
    {"m1", [](const Date& d) { return digits(d.month, 1); }},
    {"m2", [](const Date& d) { return digits(d.month, 2); }},
    {"mc",
     [](const Date& d) { return std::string(months.at(static_cast<std::size_t>(d.month - 1))); }},
    {"d1", [](const Date& d) { return digits(d.day, 1); }},
    {"d2", [](const Date& d) { return digits(d.day, 2); }},
    {"h1", [](const Date& d) { return digits(d.hour, 1); }},
    {"h2", [](const Date& d) { return digits(d.hour, 2); }},
    {"h3", [](const Date& d) { return digits(d.hour, 3); }},
    {"n2", [](const Date& d) { return digits(d.minute, 2); }},
});

// Expands one part after a '%', taken from the front of `rest`.
std::optional<std::string> expand_part(std::string_view& rest, const Clock& clock, const Date& now,
                                       std::int64_t step) {
  const auto takes = [&](std::string_view mark) {
    if (!rest.starts_with(mark)) return false;
    rest.remove_prefix(mark.size());
    return true;
  };
  const bool initial = rest.starts_with('i');
  if (initial) rest.remove_prefix(1);
  for (const Part& part : date_parts) {
    if (takes(part.mark)) return part.text(initial ? clock.first : now);
  }
  if (initial) return std::nullopt;
  const std::int64_t minutes = minutes_since_first(clock, now);
  if (takes("f2")) return digits(minutes / 60, 2);
  if (takes("f3")) return digits(minutes / 60, 3);
  if (takes("fn2")) return digits(minutes, 2);
  if (takes("fhn")) return digits(minutes / 60, 2) + digits(minutes % 60, 2);
  if (takes("j3")) {
    Date new_year;
    new_year.year = now.year;
    return digits(day_number(now, clock.no_leap) - day_number(new_year, clock.no_leap) + 1, 3);
  }
  std::int64_t index = step + 1;
  if (takes("tm")) {
    index = step;
  } else if (!takes("t")) {
    return std::nullopt;
  }
  if (rest.empty() || rest.front() < '1' || rest.front() > '6') return std::nullopt;
  const auto width = static_cast<std::size_t>(rest.front() - '0');
  rest.remove_prefix(1);
  return digits(index, width);
}

}  // namespace

std::optional<Date> parse_date(std::string_view text) {
  const std::string lowered = lower(text);
  std::string_view rest = lowered;
  Date date;
  if (const std::size_t z = rest.find('z'); z != std::string_view::npos) {
    std::string_view clock = rest.substr(0, z);
    date.hour = take_digits(clock, 2);
    if (clock.starts_with(':')) {
      clock.remove_prefix(1);
      date.minute = take_digits(clock, 2);
    }
    if (!clock.empty()) return std::nullopt;
    rest.remove_prefix(z + 1);
  }
  if (!rest.empty() && rest.front() >= '0' && rest.front() <= '9') date.day = take_digits(rest, 2);
  const auto* month = std::find(months.begin(), months.end(), rest.substr(0, 3));
  if (month == months.end()) return std::nullopt;
  date.month = static_cast<int>(month - months.begin()) + 1;
  rest.remove_prefix(3);
  const std::size_t width = rest.size();
  date.year = take_digits(rest, 4);
  if (width == 2) date.year += date.year < 50 ? 2000 : 1900;
  const std::chrono::year_month_day day(std::chrono::year(date.year),
                                        std::chrono::month(static_cast<unsigned>(date.month)),
                                        std::chrono::day(static_cast<unsigned>(date.day)));
  const bool good = rest.empty() && (width == 2 || width == 4) && date.year >= 1 && date.day >= 1 &&
                    day.ok() && date.hour >= 0 && date.hour < 24 && date.minute >= 0 &&
                    date.minute < 60;
  return good ? std::optional(date) : std::nullopt;
}

bool parse_increment(std::string_view text, Clock& clock) {
  constexpr std::array<std::string_view, 5> units{"mn", "hr", "dy", "mo", "yr"};
  constexpr std::array<char, 5> letters{'n', 'h', 'd', 'm', 'y'};
  if (text.size() < 3) return false;
  const auto count = bytes::to_integer(text.substr(0, text.size() - 2));
  const std::string word = lower(text.substr(text.size() - 2));
  const auto* unit = std::find(units.begin(), units.end(), word);
  if (!count || *count < 1 || *count > 1'000'000 || unit == units.end()) return false;
  clock.increment = *count;
  clock.unit = letters.at(static_cast<std::size_t>(unit - units.begin()));
  return true;
}

std::optional<Date> date_of(const Clock& clock, std::int64_t step) {
  Date date = clock.first;
  const std::int64_t by = step * clock.increment;
  if (clock.unit == 'y' || clock.unit == 'm') {
    const std::int64_t month = date.month - 1 + (clock.unit == 'y' ? by * 12 : by);
    const std::int64_t year = date.year + month / 12;
    if (year > year_max) return std::nullopt;
    date.year = static_cast<int>(year);
    date.month = static_cast<int>(month % 12) + 1;
    // The 31st of a shorter month is its last day.
    const bool leap = !clock.no_leap && std::chrono::year(date.year).is_leap();
    const auto at = static_cast<std::size_t>(date.month);
    const int length = days_before.at(at) - days_before.at(at - 1) + (leap && at == 2 ? 1 : 0);
    date.day = std::min(date.day, length);
    return date;
  }
  const std::int64_t scale = clock.unit == 'd' ? 1440 : clock.unit == 'h' ? 60 : 1;
  const std::int64_t minutes = minutes_of(date, clock.no_leap) + by * scale;
  const std::int64_t day = minutes >= 0 ? minutes / 1440 : -((1439 - minutes) / 1440);
  const std::int64_t in_day = minutes - day * 1440;
  Date last;
  last.year = year_max;
  if (day > day_number(last, clock.no_leap)) return std::nullopt;
  set_day(date, day, clock.no_leap);
  date.hour = static_cast<int>(in_day / 60);
  date.minute = static_cast<int>(in_day % 60);
  return date;
}

std::int64_t minutes_since_first(const Clock& clock, const Date& date) {
  return minutes_of(date, clock.no_leap) - minutes_of(clock.first, clock.no_leap);
}

std::string text_of(const Date& date) {
  return digits(date.year, 4) + '-' + digits(date.month, 2) + '-' + digits(date.day, 2) + ' ' +
         digits(date.hour, 2) + ':' + digits(date.minute, 2) + ":00";
}

std::optional<std::string> expand(std::string_view name, const Clock& clock, std::int64_t step,
                                  std::string& problem) {
  const auto now = date_of(clock, step);
  if (!now) {
    problem = "the time extends beyond the year " + std::to_string(year_max);
    return std::nullopt;
  }
  std::string out;
  while (!name.empty()) {
    if (name.front() != '%') {
      out += name.front();
      name.remove_prefix(1);
      continue;
    }
    name.remove_prefix(1);
    const std::string_view part = name.substr(0, 4);
    auto text = expand_part(name, clock, *now, step);
    if (!text) {
      problem = "the template's part ";
      problem += in_quotes(std::string("%").append(part)) + " is not known";
      return std::nullopt;
    }
    out += *text;
  }
  return out;
}

}  // namespace windsplat::data::grads
