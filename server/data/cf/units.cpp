// Units are listed in one table per quantity.
#include "server/data/cf/units.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>

#include "server/base/ascii.hpp"

namespace windsplat::data {

namespace {

struct Unit {
  std::string_view name;
  double si;
};

// A geopotential metre is treated as a metre.
constexpr auto lengths = std::to_array<Unit>({{"m", 1},
                                              {"meter", 1},
                                              {"meters", 1},
                                              {"metre", 1},
                                              {"metres", 1},
                                              {"gpm", 1},
                                              {"km", 1000},
                                              {"kilometer", 1000},
                                              {"kilometers", 1000},
                                              {"kilometre", 1000},
                                              {"kilometres", 1000},
                                              {"cm", 0.01},
                                              {"centimeter", 0.01},
                                              {"centimeters", 0.01},
                                              {"centimetre", 0.01},
                                              {"centimetres", 0.01},
                                              {"ft", 0.3048},
                                              {"foot", 0.3048},
                                              {"feet", 0.3048}});

constexpr auto pressures = std::to_array<Unit>({{"pa", 1},
                                                {"pascal", 1},
                                                {"pascals", 1},
                                                {"hpa", 100},
                                                {"hectopascal", 100},
                                                {"hectopascals", 100},
                                                {"mb", 100},
                                                {"mbar", 100},
                                                {"millibar", 100},
                                                {"millibars", 100},
                                                {"kpa", 1000},
                                                {"dbar", 10000},
                                                {"decibar", 10000},
                                                {"decibars", 10000},
                                                {"bar", 100000},
                                                {"atm", 101325}});

template <std::size_t count>
std::optional<double> find(const std::array<Unit, count>& table, std::string_view unit) {
  while (!unit.empty() && unit.front() == ' ') unit.remove_prefix(1);
  while (!unit.empty() && unit.back() == ' ') unit.remove_suffix(1);
  const std::string name = lower(std::string(unit));
  for (const Unit& known : table) {
    if (name == known.name) return known.si;
  }
  return std::nullopt;
}

constexpr auto time_units = std::to_array<Unit>({{"s", 1},
                                                 {"sec", 1},
                                                 {"secs", 1},
                                                 {"second", 1},
                                                 {"seconds", 1},
                                                 {"min", 60},
                                                 {"minute", 60},
                                                 {"minutes", 60},
                                                 {"h", 3600},
                                                 {"hr", 3600},
                                                 {"hour", 3600},
                                                 {"hours", 3600},
                                                 {"d", 86400},
                                                 {"day", 86400},
                                                 {"days", 86400}});

constexpr auto small_lengths = std::to_array<Unit>({{"mm", 1e-3},
                                                    {"millimeter", 1e-3},
                                                    {"millimeters", 1e-3},
                                                    {"millimetre", 1e-3},
                                                    {"millimetres", 1e-3}});

constexpr double knot_si = 1852.0 / 3600;
constexpr auto speed_units = std::to_array<Unit>(
    {{"knot", knot_si}, {"knots", knot_si}, {"kt", knot_si}, {"kts", knot_si}, {"mph", 0.44704}});

struct UnitPrefix {
  char sign;
  double factor;
};
constexpr auto unit_prefixes = std::to_array<UnitPrefix>(
    {{'n', 1e-9}, {'u', 1e-6}, {'m', 1e-3}, {'k', 1e3}, {'M', 1e6}, {'G', 1e9}});
constexpr std::string_view with_prefixes = "VTANJWg";  // volt, tesla, ampere, newton, joule, ...

// A unit as a product: SI factor, and the powers of base units and of unknown names.
struct UnitProduct {
  double factor = 1;
  std::map<std::string, int, std::less<>> powers;

  void multiply(std::string_view name, int power) {
    const auto add = [&](double si, std::string_view base, int exponent) {
      factor *= std::pow(si, power);
      int& sum = powers[std::string(base)];
      sum += exponent * power;
    };
    if (const auto metres = find(lengths, name)) return add(*metres, "m", 1);
    if (const auto metres = find(small_lengths, name)) return add(*metres, "m", 1);
    if (const auto seconds = find(time_units, name)) return add(*seconds, "s", 1);
    if (const auto pascals = find(pressures, name)) return add(*pascals, "Pa", 1);
    if (const auto speed = find(speed_units, name)) {
      add(*speed, "m", 1);
      return add(1, "s", -1);
    }
    const std::string_view last = name.substr(name.size() - 1);
    if (name.size() == 2 && with_prefixes.find(last) != std::string_view::npos) {
      for (const UnitPrefix& prefix : unit_prefixes) {
        if (name.front() == prefix.sign) return add(prefix.factor, last, 1);
      }
    }
    add(1, name, 1);
  }
};

// nullopt if the text is no product of names with whole powers.
std::optional<UnitProduct> product_of(std::string_view text) {
  UnitProduct out;
  if (lower(trim(text)) == "ms-1") text = "m s-1";
  int sign = 1;
  while (!(text = trim(text)).empty()) {
    if (text.front() == '/' || text.front() == '.' || text.front() == '*') {
      if (text.front() == '/') sign = -1;
      text.remove_prefix(1);
      continue;
    }
    std::size_t letters = 0;
    const auto is_letter = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    };
    while (letters < text.size() && is_letter(text[letters])) ++letters;
    if (letters == 0) {
      if (text.front() != '1' || (text.size() > 1 && text[1] != ' ' && text[1] != '/')) return {};
      text.remove_prefix(1);
      continue;
    }
    const std::string_view name = text.substr(0, letters);
    text.remove_prefix(letters);
    if (text.starts_with("**")) text.remove_prefix(2);
    if (text.starts_with("^")) text.remove_prefix(1);
    const bool negative = text.starts_with("-");
    if (negative || text.starts_with("+")) text.remove_prefix(1);
    int power = 1;
    if (!text.empty() && text.front() >= '1' && text.front() <= '9') {
      power = text.front() - '0';
      text.remove_prefix(1);
    } else if (negative) {
      return {};
    }
    out.multiply(name, sign * (negative ? -power : power));
    sign = 1;
  }
  std::erase_if(out.powers, [](const auto& one) { return one.second == 0; });
  return out;
}

}  // namespace

std::optional<double> unit_ratio(std::string_view from, std::string_view to) {
  if (trim(from) == trim(to)) return 1.0;
  const auto a = product_of(from);
  const auto b = product_of(to);
  if (!a || !b || a->powers != b->powers) return std::nullopt;
  const double ratio = a->factor / b->factor;
  if (!std::isfinite(ratio) || !(ratio > 0)) return std::nullopt;
  return std::abs(ratio - 1) < 1e-12 ? 1.0 : ratio;
}

std::optional<double> metres_in(std::string_view unit) { return find(lengths, unit); }

std::optional<double> pascals_in(std::string_view unit) { return find(pressures, unit); }

bool is_speed(std::string_view unit) {
  constexpr auto known = std::to_array<std::string_view>(
      {"m/s",           "m s-1",          "m s**-1",   "m s^-1",       "m.s-1",   "ms-1",
       "m/sec",         "cm/s",           "cm s-1",    "km/h",         "km/s",    "km s-1",
       "knots",         "knot",           "kt",        "kts",          "meter/s", "metre/s",
       "meters/second", "meter second-1", "meter/sec", "centimeter/s", "mm/s",    "meter sec-1"});
  return is_one_of(lower(unit), known);
}

std::optional<double> pascals_per_second_in(std::string_view unit) {
  for (const std::string_view ending : {"/s", " s-1", " s^-1", " s**-1", "*s-1", ".s-1", "/sec"}) {
    if (unit.size() > ending.size() && unit.ends_with(ending)) {
      return pascals_in(unit.substr(0, unit.size() - ending.size()));
    }
  }
  return std::nullopt;
}

}  // namespace windsplat::data
