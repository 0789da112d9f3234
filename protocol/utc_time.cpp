#include "protocol/utc_time.hpp"

#include <array>
#include <chrono>
#include <cstddef>

namespace windsplat::protocol {

namespace {

// `form` has 0 for a digit.
bool has_form(std::string_view text, std::string_view form) {
  if (text.size() != form.size()) return false;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (form[i] == '0' ? !digit : text[i] != form[i]) return false;
  }
  return true;
}

int number(std::string_view digits) {
  int value = 0;
  for (const char digit : digits) value = 10 * value + (digit - '0');
  return value;
}

}  // namespace

std::optional<double> days_since_2000(std::string_view utc) {
  const bool seconds = has_form(utc, "0000-00-00T00:00:00Z");
  if (!seconds && !has_form(utc, "0000-00-00T00:00Z")) return std::nullopt;
  const std::chrono::year_month_day date{
      std::chrono::year{number(utc.substr(0, 4))},
      std::chrono::month{static_cast<unsigned>(number(utc.substr(5, 2)))},
      std::chrono::day{static_cast<unsigned>(number(utc.substr(8, 2)))}};
  const int hour = number(utc.substr(11, 2));
  const int minute = number(utc.substr(14, 2));
  const int second = seconds ? number(utc.substr(17, 2)) : 0;
  if (!date.ok() || hour > 23 || minute > 59 || second > 59) return std::nullopt;
  constexpr std::chrono::sys_days epoch{std::chrono::year{2000} / 1 / 1};
  const double days = static_cast<double>((std::chrono::sys_days{date} - epoch).count());
  return days + (hour - 12) / 24.0 + minute / 1440.0 + second / 86400.0;
}

std::string utc_text(std::time_t time) {
  std::tm utc{};
  gmtime_r(&time, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text.data();
}

}  // namespace windsplat::protocol
