// Dates as text, by which WRF and MPAS number their steps: "2005-08-28_00:00:00".
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/data/cf/contents.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::netcdf {

inline constexpr std::size_t date_length = 19;
inline constexpr std::size_t date_width_max = 64;  // characters of one entry
inline constexpr const char* date_units = "seconds since 1970-01-01 00:00:00";

// Seconds since 1970 in a calendar; NaN if the text is no date of it. After the seconds may follow
// a fraction of them, the letter Z and blanks.
double seconds_of_date(std::string_view text, cf::Calendar calendar);

// The calendar's name in CF of a value of config_calendar_type, by which MPAS names that of its
// dates: gregorian, gregorian_noleap, 360day, or a name of CF. Gregorian ones are proleptic, as is
// that of empty text. Empty: unknown.
std::string calendar_of_dates(std::string_view text);

// The variable of characters (time, characters), Times of WRF or xtime of MPAS, if its dimension of
// time has no other coordinate that counts from a date. -1: there is none.
int text_of_dates(const FileContents& contents);

// Makes that variable a coordinate in date_units of a calendar of CF.
void use_dates(FileContents& contents, int text, const std::string& calendar);

}  // namespace windsplat::data::netcdf
