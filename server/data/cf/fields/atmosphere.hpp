// The ICAO standard atmosphere (Doc 7488; the same as ISO 2533 and the US Standard Atmosphere 1976
// below 86 km) by pressure.
#pragma once

namespace windsplat::data::cf {

inline constexpr double standard_gravity = 9.80665;  // m s-2
inline constexpr double dry_air_constant = 287.05;   // J kg-1 K-1

// Geopotential height in metres and temperature in kelvin at a pressure in Pa. The highest layer is
// extrapolated above 71 km. NaN unless pascals > 0.
double standard_height(double pascals);
double standard_temperature(double pascals);

}  // namespace windsplat::data::cf
