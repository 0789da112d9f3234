// Surfaces by their scaled values; directions by the type of level.
#include "server/data/formats/grib/levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

namespace windsplat::data::grib {

namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

// A fixed surface of edition 2, in the unit of code table 4.5; NaN if missing.
double surface(const Message& message, const std::string& which) {
  return scaled(message.whole(("scaledValueOf" + which + "FixedSurface").c_str(), -1),
                message.whole(("scaleFactorOf" + which + "FixedSurface").c_str(), 255));
}

// NaN for levels that are numbered, and for missing surfaces.
double measured_2(const Message& message) {
  // Pressure, heights, sigma, depth, temperature, distance in pressure, eta, depth in the sea.
  constexpr auto measured = std::to_array<long>({100, 102, 103, 104, 106, 107, 108, 111, 160});
  const long code = message.whole("typeOfFirstFixedSurface", 255);
  const bool is_layer = message.whole("typeOfSecondFixedSurface", 255) == code;
  double place = surface(message, "First");
  if (std::find(measured.begin(), measured.end(), code) == measured.end()) {
    // `level` is the second number of a layer, which some producers leave 0.
    return is_layer && place > surface(message, "Second") ? place : nothing;
  }
  if (is_layer) place = (place + surface(message, "Second")) / 2;
  constexpr long pressure = 100;
  constexpr long pressure_from_ground = 108;
  return code == pressure || code == pressure_from_ground ? place / 100 : place;
}

double measured_1(const Message& message) {
  const double level = message.number("level");
  const double top = message.number("topLevel");
  const double bottom = message.number("bottomLevel");
  const double middle = (top + bottom) / 2;
  switch (message.whole("indicatorOfTypeOfLevel", 255)) {
    case 101:
      return middle * 10;  // kPa
    case 104:
    case 106:
      return middle * 100;  // hm
    case 107:
    case 119:
      return level / 10000;
    case 108:
    case 120:
      return middle / 100;
    case 111:
    case 125:
      return level / 100;  // cm
    case 112:
      return middle / 100;  // cm
    case 114:
      return 475 - middle;
    case 116:
      return middle;  // hPa
    case 121:
      return 1100 - middle;  // hPa
    case 128:
      return 1.1 - middle / 1000;
    case 141:
      return (top * 10 + 1100 - bottom) / 2;  // kPa and hPa
    case 210:
      return level / 100;  // Pa
    default:
      return nothing;
  }
}

std::string type_of(const Message& message) {
  std::string type = message.text("typeOfLevel");
  if (type == "unknown" || type == "~") return {};
  if (type == "isobaricInPa") return "isobaricInhPa";
  if (type == "oceanSurface") return "depthBelowSea";
  constexpr std::string_view precise = "HighPrecision";
  constexpr std::string_view mixed = "MixedPrecision";
  for (const std::string_view end : {precise, mixed}) {
    if (type.ends_with(end)) type.resize(type.size() - end.size());
  }
  return type;
}

}  // namespace

double scaled(long value, long factor) {
  constexpr long value_max = 0x7ffffffe;  // beyond: missing, or negative
  constexpr long factor_max = 20;
  if (value < 0 || value > value_max || std::abs(factor) > factor_max) return nothing;
  const double power = std::pow(10.0, static_cast<double>(std::abs(factor)));
  return factor < 0 ? static_cast<double>(value) * power : static_cast<double>(value) / power;
}

Level read_level(const Message& message) {
  const double measured =
      message.whole("edition", 2) == 1 ? measured_1(message) : measured_2(message);
  return {type_of(message), std::isnan(measured) ? message.number("level") : measured};
}

FileVariable level_axis(const std::string& type) {
  FileVariable out;
  out.axis = "Z";
  if (type.starts_with("isobaric")) {
    out.standard_name = "air_pressure";
    out.units = "hPa";
  } else if (type.starts_with("heightAbove")) {
    out.standard_name = type.starts_with("heightAboveSea") ? "altitude" : "height";
    out.units = "m";
  } else if (type.starts_with("depthBelow")) {
    out.standard_name = "depth";
    out.units = "m";
    out.positive = "down";
  } else {
    out.standard_name = "model_level_number";
    // Numbered from the top, or 1 at the ground and 0 at the top.
    constexpr auto downward = std::to_array<std::string_view>(
        {"hybrid", "sigma", "eta", "generalVertical", "soil", "snow", "seaIce", "oceanModel"});
    const auto begins = [&](std::string_view start) { return type.starts_with(start); };
    const bool is_down =
        !begins("hybridHeight") && std::any_of(downward.begin(), downward.end(), begins);
    out.positive = is_down ? "down" : "";
  }
  return out;
}

}  // namespace windsplat::data::grib
