// Dates as text, by which WRF numbers its steps: "2005-08-28_00:00:00".
#pragma once

#include <cstddef>
#include <string_view>

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

inline constexpr std::size_t date_length = 19;
inline constexpr std::size_t date_width_max = 64;  // characters of one entry of Times
inline constexpr const char* date_units = "seconds since 1970-01-01 00:00:00";

// Seconds since 1970 in the proleptic Gregorian calendar; NaN if the text is no date. After the
// seconds may follow a fraction of them, the letter Z and blanks.
double seconds_of_date(std::string_view text);

// The variable Times of characters (time, characters), if its dimension of time has no other
// coordinate that counts from a date: its index, and the variable becomes a coordinate in
// date_units. -1: there is none.
int name_dates_of_wrf(FileContents& contents);

}  // namespace windsplat::data::netcdf
