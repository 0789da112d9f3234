// The level of a GRIB message in the units of its kind, and the vertical axis of a kind of levels.
#pragma once

#include <string>

#include "server/data/cf/contents.hpp"
#include "server/data/formats/grib/message.hpp"

namespace windsplat::data::grib {

struct Level {
  std::string type;  // typeOfLevel of ecCodes; kinds that differ only in their unit have one name
  // Pressures in hPa, heights and depths in metres, sigma and eta as fractions, temperatures in K;
  // a layer by its middle. Numbers of other levels and layers as ecCodes gives them. NaN if absent.
  double value = 0;
};

// value * 10^-factor, as rounded once; NaN if missing or beyond limits.
double scaled(long value, long factor);

// Code table 4.5 of edition 2, code table 3 of edition 1.
Level read_level(const Message& message);

// Attributes of the coordinate variable of levels of that type.
FileVariable level_axis(const std::string& type);

}  // namespace windsplat::data::grib
