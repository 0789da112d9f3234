// Units of length and pressure in files -> SI; ignores case and surrounding blanks.
#pragma once

#include <optional>
#include <string_view>

namespace windsplat::data {

std::optional<double> metres_in(std::string_view unit);   // nullopt: not a length
std::optional<double> pascals_in(std::string_view unit);  // nullopt: not a pressure
bool is_speed(std::string_view unit);                     // a known unit of speed; false if empty
std::optional<double> pascals_per_second_in(std::string_view unit);

// What a value in the unit `from` is multiplied by to be in `to`, for products of powers such as
// "kg m-2 s-1" or "m/s"; nullopt if they measure different quantities or a part is unknown and not
// common to both. Offsets (degrees Celsius) are not known.
std::optional<double> unit_ratio(std::string_view from, std::string_view to);

// The standard name of omega, in Pa s-1.
inline constexpr std::string_view omega_name = "lagrangian_tendency_of_air_pressure";

}  // namespace windsplat::data
