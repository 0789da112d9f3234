// Bolton's formulas; NaN stays NaN.
#include "server/data/derived/moist_air.hpp"

#include <cmath>

namespace windsplat::data::derived {

namespace {

constexpr double zero_celsius = 273.15;
constexpr double reference_pascals = 100000;
constexpr double vapour_to_air = 0.622;  // ratio of the molar masses of water and dry air

}  // namespace

double temperature_of(double potential_kelvin, double pascals) {
  return potential_kelvin * std::pow(pascals / reference_pascals, kappa);
}

double saturation_pressure(double kelvin) {
  const double celsius = kelvin - zero_celsius;
  return 611.2 * std::exp(17.67 * celsius / (celsius + 243.5));
}

double vapour_pressure(double mixing_ratio, double pascals) {
  return pascals * mixing_ratio / (vapour_to_air + mixing_ratio);
}

double mixing_ratio_of(double specific_humidity) {
  return specific_humidity / (1 - specific_humidity);
}

}  // namespace windsplat::data::derived
