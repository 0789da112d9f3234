// Units of length and pressure in files -> SI; ignores case and surrounding blanks.
#pragma once

#include <optional>
#include <string_view>

namespace windsplat::data {

std::optional<double> metres_in(std::string_view unit);   // nullopt: not a length
std::optional<double> pascals_in(std::string_view unit);  // nullopt: not a pressure
bool is_speed(std::string_view unit);                     // a known unit of speed; false if empty
std::optional<double> pascals_per_second_in(std::string_view unit);

// The standard name of omega, in Pa s-1.
inline constexpr std::string_view omega_name = "lagrangian_tendency_of_air_pressure";

}  // namespace windsplat::data
