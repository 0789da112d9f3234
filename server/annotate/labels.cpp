#include "server/annotate/labels.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <string>

namespace windsplat::annotate {
namespace {

constexpr const char* minus = "\u2212";
constexpr double slack = 1e-9;  // of a step

// The exponent of the leading digit.
int exponent_of(double value) { return static_cast<int>(std::floor(std::log10(value) + slack)); }

std::string with_minus(std::string text) {
  if (!text.empty() && text.front() == '-') text.replace(0, 1, minus);
  return text;
}

template <class... Values>
std::string formatted(const char* pattern, Values... values) {
  std::array<char, 64> out{};
  const int length = std::snprintf(out.data(), out.size(), pattern, values...);
  return {out.data(), static_cast<std::size_t>(std::clamp(length, 0, 63))};
}

std::string superscript(std::string_view digits) {
  static constexpr std::array<const char*, 10> signs{"\u2070", "\u00b9", "\u00b2", "\u00b3",
                                                     "\u2074", "\u2075", "\u2076", "\u2077",
                                                     "\u2078", "\u2079"};
  std::string out;
  for (const char digit : digits) {
    if (digit == '-') out += "\u207b";
    if (digit >= '0' && digit <= '9') out += signs.at(static_cast<std::size_t>(digit - '0'));
  }
  return out;
}

// mantissa x 10^exponent with `digits` significant digits.
std::string power_text(double value, int digits) {
  std::string text = formatted("%.*e", std::max(digits - 1, 0), value);
  const std::size_t at = text.find('e');
  std::string mantissa = text.substr(0, at);
  const std::string exponent = std::to_string(std::stoi(text.substr(at + 1)));
  if (mantissa.find('.') != std::string::npos) {
    mantissa.erase(mantissa.find_last_not_of('0') + 1);
    if (mantissa.back() == '.') mantissa.pop_back();
  }
  return with_minus(mantissa) + "\u00b710" + superscript(exponent);
}

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

double round_step(double range, int most) {
  if (!(range > 0) || !std::isfinite(range) || most < 1) return 0;
  const double rough = range / most;
  const double power = std::pow(10.0, exponent_of(rough));
  for (const double digit : {1.0, 2.0, 5.0, 10.0}) {
    if (digit * power >= rough * (1 - slack)) return digit * power;
  }
  return 10 * power;
}

std::string number_text(double value, double step) {
  if (!std::isfinite(value)) return "\u2013";
  constexpr int digits_most = 7;
  if (value == 0 || !(step > 0)) return value == 0 ? "0" : number_text_of(value, 4);
  const int first = exponent_of(std::abs(value));
  const int last = exponent_of(step);
  const int digits = std::max(first - last + 1, 1);
  if (std::max(first, 0) - std::min(last, 0) + 1 > digits_most) return power_text(value, digits);
  const std::string text = formatted("%.*f", std::max(-last, 0), value);
  return text.find_first_of("123456789") == std::string::npos ? "0" : with_minus(text);
}

std::string number_text_of(double value, int digits) {
  if (!std::isfinite(value)) return "\u2013";
  if (value == 0) return "0";
  const int first = exponent_of(std::abs(value));
  if (first < -3 || first > 5) return power_text(value, digits);
  std::string text = formatted("%.*f", std::max(digits - 1 - first, 0), value);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return with_minus(text);
}

double round_degrees(double range, int most) {
  const double rough = range / std::max(most, 1);
  for (const double degrees : {1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0}) {
    if (rough > 0.5 && degrees >= rough * (1 - slack)) return degrees;
  }
  return round_step(range, most);
}

std::vector<Tick> even_ticks(double low, double high, int most) {
  const double step = round_step(std::abs(high - low), most);
  return step > 0 ? ticks_of_step(low, high, step) : std::vector<Tick>();
}

std::vector<Tick> ticks_of_step(double low, double high, double step) {
  constexpr int ticks_most = 100;
  const double least = std::min(low, high);
  std::vector<Tick> ticks;
  const double first = std::ceil(least / step - slack);
  if (!std::isfinite(first)) return ticks;
  for (int n = 0; n < ticks_most; ++n) {
    const double value = (first + n) * step;
    if (value > std::max(low, high) + slack * step) break;
    ticks.push_back({value, (value - low) / (high - low), number_text(value, step)});
  }
  return ticks;
}

std::vector<Tick> uneven_ticks(double low, double high, double gap,
                               const std::function<double(double)>& place) {
  const double least = std::min(low, high);
  const double range = std::abs(high - low);
  // Over a wide ratio, a value of few digits is rounder: 300 before 320.
  constexpr double wide = 3;
  constexpr double multiple_most = 10;
  const bool is_wide = least > 0 && least + range > wide * least;
  std::vector<Tick> ticks;
  constexpr int finest = 100;  // parts
  for (int parts = 1, steps = 0; parts <= finest && steps < 8; parts *= 2, ++steps) {
    const double step = round_step(range, parts);
    if (!(step > 0)) break;
    const double first = std::ceil(least / step - slack);
    for (int n = 0; n <= parts; ++n) {
      const double value = (first + n) * step;
      if (value > least + range + slack * step) break;
      if (is_wide && first + n > multiple_most) break;
      const double at = place(value);
      const bool near = std::any_of(ticks.begin(), ticks.end(), [&](const Tick& tick) {
        return !(std::abs(tick.at - at) >= gap);
      });
      if (!near && std::isfinite(at)) ticks.push_back({value, at, number_text(value, step)});
    }
  }
  std::sort(ticks.begin(), ticks.end(),
            [](const Tick& a, const Tick& b) { return a.value < b.value; });
  return ticks;
}

namespace {

// A unit that is written out, in lower case -> its symbol.
struct UnitName {
  std::string_view name;
  const char* symbol;
};
constexpr std::array unit_names{UnitName{"meter", "m"},
                                UnitName{"metre", "m"},
                                UnitName{"kilometer", "km"},
                                UnitName{"kilometre", "km"},
                                UnitName{"centimeter", "cm"},
                                UnitName{"centimetre", "cm"},
                                UnitName{"millimeter", "mm"},
                                UnitName{"millimetre", "mm"},
                                UnitName{"second", "s"},
                                UnitName{"sec", "s"},
                                UnitName{"minute", "min"},
                                UnitName{"hour", "h"},
                                UnitName{"kelvin", "K"},
                                UnitName{"degk", "K"},
                                UnitName{"deg_k", "K"},
                                UnitName{"degree_kelvin", "K"},
                                UnitName{"degc", "\u00b0C"},
                                UnitName{"deg_c", "\u00b0C"},
                                UnitName{"celsius", "\u00b0C"},
                                UnitName{"degree_c", "\u00b0C"},
                                UnitName{"degree_celsius", "\u00b0C"},
                                UnitName{"degree", "\u00b0"},
                                UnitName{"pascal", "Pa"},
                                UnitName{"hectopascal", "hPa"},
                                UnitName{"millibar", "mbar"},
                                UnitName{"kilogram", "kg"},
                                UnitName{"gram", "g"},
                                UnitName{"joule", "J"},
                                UnitName{"watt", "W"},
                                UnitName{"newton", "N"},
                                UnitName{"volt", "V"},
                                UnitName{"percent", "%"}};

// The symbol of a unit that is written out, also in the plural; others are unchanged.
std::string symbol_of(std::string_view word) {
  std::string name;
  for (const char c : word) {
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  const auto found = [&name](const UnitName& one) {
    std::string plural(one.name);
    const std::size_t first = plural.find("degree_") == 0 ? std::size_t{6} : plural.size();
    plural.insert(first, "s");
    return name == one.name || name == plural;
  };
  const auto* const known = std::find_if(unit_names.begin(), unit_names.end(), found);
  return known == unit_names.end() ? std::string(word) : known->symbol;
}

// The length of a degree of Celsius that is written in two words at the start of a text, as "DEG
// C"; 0: there is none.
std::size_t celsius_at(std::string_view text) {
  std::string lower(text.substr(0, std::string_view("degrees celsius").size()));
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const std::string_view degree : {"degrees", "degree", "deg"}) {
    for (const std::string_view scale : {" celsius", " c"}) {
      const std::size_t length = degree.size() + scale.size();
      if (!lower.starts_with(degree) || !lower.substr(degree.size()).starts_with(scale)) continue;
      const bool ends = text.size() == length || !(is_letter(text[length]) || text[length] == '_');
      if (ends) return length;
    }
  }
  return 0;
}

// The length of the power that follows a unit, as in "-1", "2", "**-1", "^2", and its digits.
struct Power {
  std::size_t length = 0;
  std::string_view digits;
};

Power power_at(std::string_view text) {
  const std::size_t sign = text.starts_with("**") ? 2 : text.starts_with('^') ? 1 : 0;
  std::size_t end = sign;
  if (end < text.size() && text[end] == '-') ++end;
  const std::size_t digits = end;
  while (end < text.size() && is_digit(text[end])) ++end;
  const bool ends =
      end == text.size() || std::string_view(" ./*").find(text[end]) != std::string_view::npos;
  if (end == digits || !ends) return {};
  return {end, text.substr(sign, end - sign)};
}

}  // namespace

std::string unit_text(std::string_view units) {
  if (units == "1" || units == "(0 - 1)") return {};  // the latter of ECMWF
  std::string out;
  bool per = false;
  for (std::size_t i = 0; i < units.size();) {
    std::size_t end = i;
    while (end < units.size() && (is_letter(units[end]) || units[end] == '_')) ++end;
    if (end == i) {
      out += units[i++];
      continue;
    }
    if (const std::size_t celsius = celsius_at(units.substr(i)); celsius > 0) {
      out += "\u00b0C";
      i += celsius;
      continue;
    }
    const std::string_view word = units.substr(i, end - i);
    i = end;
    if (word == "per" && !out.empty() && out.back() == ' ' && i < units.size() && units[i] == ' ') {
      per = true;
      ++i;
      continue;
    }
    out += symbol_of(word);
    const Power power = power_at(units.substr(i));
    i += power.length;
    if (per) out += superscript("-" + std::string(power.length > 0 ? power.digits : "1"));
    if (!per) out += superscript(power.digits);
    per = false;
  }
  return out;
}

std::string coordinate_text(const data::Axis& axis, double value, double step) {
  if (axis.kind == data::AxisKind::longitude) {
    constexpr double turn = 360;
    const double from_greenwich = std::remainder(value, turn);
    const bool ends = std::abs(from_greenwich) < slack * step ||
                      std::abs(std::abs(from_greenwich) - turn / 2) < slack * step;
    const char* const side = ends ? "" : from_greenwich < 0 ? "W" : "E";
    return number_text(std::abs(from_greenwich), step) + "\u00b0" + side;
  }
  if (axis.kind == data::AxisKind::latitude) {
    const char* const side = std::abs(value) < slack * step ? "" : value < 0 ? "S" : "N";
    return number_text(std::abs(value), step) + "\u00b0" + side;
  }
  return number_text(value, step);
}

std::string axis_title(const data::Axis& axis) {
  using data::AxisKind;
  std::string name;
  switch (axis.kind) {
    case AxisKind::longitude:
    case AxisKind::latitude:
      return {};
    case AxisKind::pressure:
      name = "pressure";
      break;
    case AxisKind::height:
      name = "height";
      break;
    case AxisKind::depth:
      name = "depth";
      break;
    case AxisKind::level:
    case AxisKind::cartesian:
      name = axis.name;
      std::replace(name.begin(), name.end(), '_', ' ');
      break;
  }
  const std::string units = unit_text(axis.units);
  return units.empty() ? name : name + " (" + units + ")";
}

std::string time_text(std::string_view text) {
  // yyyy-mm-ddThh:mm:ssZ, with a year of four digits.
  constexpr std::string_view shape = "0000-00-00T00:00:00";
  const bool zone = text.size() == shape.size() + 1 && text.back() == 'Z';
  if (text.size() != shape.size() && !zone) return std::string(text);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const bool fits = shape[i] == '0' ? is_digit(text[i]) : text[i] == shape[i];
    if (!fits) return std::string(text);
  }
  constexpr std::size_t minutes = 16;  // characters up to the minutes
  std::string out(text.substr(0, minutes));
  out[10] = ' ';
  if (text.substr(minutes, 3) != ":00") out += text.substr(minutes, 3);
  return zone ? out + "Z" : out;
}

}  // namespace windsplat::annotate
