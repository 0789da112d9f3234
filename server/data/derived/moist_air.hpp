// Temperature and humidity of air.
#pragma once

namespace windsplat::data::derived {

// R / cp of dry air (Bolton, Monthly Weather Review 108, 1980).
inline constexpr double kappa = 0.2854;

// Kelvin, of a potential temperature in kelvin at a pressure: T = theta (p / 1000 hPa)^kappa.
double temperature_of(double potential_kelvin, double pascals);

// Pa, over water: 611.2 exp(17.67 t / (t + 243.5)), t in degrees Celsius (Bolton 1980, equation
// 10; error below 0.3 % from -35 to 35 degrees).
double saturation_pressure(double kelvin);

// Pa, from a mixing ratio of vapour to dry air: e = p r / (0.622 + r).
double vapour_pressure(double mixing_ratio, double pascals);

// Mixing ratio of a specific humidity q: q / (1 - q).
double mixing_ratio_of(double specific_humidity);

}  // namespace windsplat::data::derived
