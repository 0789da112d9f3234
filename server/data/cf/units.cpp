// Units are listed in one table per quantity.
#include "server/data/cf/units.hpp"

#include <array>
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

}  // namespace

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
