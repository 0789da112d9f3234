// Characters of a file -> times in seconds.
#include "server/data/formats/netcdf/dates.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::netcdf {

namespace {

std::optional<int> number_in(std::string_view text) {
  int out = 0;
  const char* end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data(), end, out);
  if (fault != std::errc() || rest != end || text.front() == '-') return std::nullopt;
  return out;
}

// Whether units count from a date, which begins with a digit: not from "simulation start".
bool counts_from_a_date(const std::string& units) {
  constexpr std::string_view since = " since ";
  const std::size_t found = lower(units).find(since);
  if (found == std::string::npos) return false;
  const std::size_t first = units.find_first_not_of(' ', found + since.size());
  return first != std::string::npos && units[first] >= '0' && units[first] <= '9';
}

bool has_numeric_time(const FileContents& contents, int dimension) {
  const std::string& name = contents.dimensions[cf::at(dimension)].name;
  return std::any_of(contents.variables.begin(), contents.variables.end(),
                     [&](const FileVariable& one) {
                       return one.numeric && one.dims == std::vector{dimension} &&
                              (one.name == name || counts_from_a_date(one.units) ||
                               (one.standard_name == "time" &&
                                lower(one.units).find(" since ") == std::string::npos));
                     });
}

// Of what follows the whole seconds; nullopt if that is no fraction, Z or blank.
std::optional<double> fraction_in(std::string_view text) {
  std::size_t end = 0;
  double out = 0;
  if (!text.empty() && text[0] == '.') {
    double place = 0.1;
    for (end = 1; end < text.size() && text[end] >= '0' && text[end] <= '9'; ++end) {
      out += place * (text[end] - '0');
      place /= 10;
    }
    if (end == 1) return std::nullopt;
  }
  if (end < text.size() && text[end] == 'Z') ++end;
  constexpr std::string_view blanks(" \0", 2);
  if (text.find_first_not_of(blanks, end) != std::string_view::npos) return std::nullopt;
  return out;
}

}  // namespace

double seconds_of_date(std::string_view text, cf::Calendar calendar) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  constexpr std::string_view form = "dddd-dd-dd_dd:dd:dd";
  if (text.size() < form.size()) return none;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const bool fits = form[i] == 'd'   ? text[i] >= '0' && text[i] <= '9'
                      : form[i] == '_' ? text[i] == '_' || text[i] == 'T' || text[i] == ' '
                                       : text[i] == form[i];
    if (!fits) return none;
  }
  std::array<int, 6> parts{};
  constexpr std::array<std::size_t, 6> starts{0, 5, 8, 11, 14, 17};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto part = number_in(text.substr(starts[i], i == 0 ? 4 : 2));
    if (!part) return none;
    parts[i] = *part;
  }
  const auto [year, month, day, hour, minute, second] = parts;
  const cf::Date date{year, month, day};
  if (!cf::is_valid(date, calendar) || hour > 24 || minute > 59 || second > 60) return none;
  const auto fraction = fraction_in(text.substr(form.size()));
  if (!fraction) return none;
  const auto days = cf::day_number(date, calendar) - cf::day_number(cf::Date{1970, 1, 1}, calendar);
  return 86400.0 * static_cast<double>(days) + 3600.0 * hour + 60.0 * minute + second + *fraction;
}

std::string calendar_of_dates(std::string_view text) {
  const std::string name = lower(trim(text));
  if (name.empty() || name == "gregorian" || name == "standard") return "proleptic_gregorian";
  if (name == "gregorian_noleap" || name == "no_leap") return "noleap";
  if (name == "360day") return "360_day";
  return cf::parse_calendar(name) ? name : std::string();
}

int text_of_dates(const FileContents& contents) {
  for (const char* name : {"Times", "xtime"}) {
    const int found = cf::variable_named(contents, name);
    if (found < 0) continue;
    const FileVariable& dates = contents.variables[cf::at(found)];
    if (dates.type != "text" || !dates.unread.empty() || dates.dims.size() != 2) continue;
    const int time = dates.dims[0];
    const std::size_t width = contents.dimensions[cf::at(dates.dims[1])].length;
    if (lower(contents.dimensions[cf::at(time)].name) == "time" && width >= date_length &&
        width <= date_width_max && !has_numeric_time(contents, time)) {
      return found;
    }
  }
  return -1;
}

void use_dates(FileContents& contents, int text, const std::string& calendar) {
  FileVariable& dates = contents.variables[cf::at(text)];
  dates.type = "float64";
  dates.numeric = true;
  dates.dims.pop_back();
  dates.standard_name = "time";
  dates.units = date_units;
  dates.calendar = calendar;
  dates.is_date_text = true;
  contents.notes.push_back("times are read from the text of " + in_quotes(dates.name) +
                           (calendar == "proleptic_gregorian" ? "" : ", calendar " + calendar));
}

}  // namespace windsplat::data::netcdf
