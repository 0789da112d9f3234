// Which statistics over time or over an ensemble a GRIB message holds, if any.
#pragma once

#include <string>

#include "server/data/formats/grib/message.hpp"

namespace windsplat::data::grib {

struct Product {
  std::string key;     // differs for different statistics; empty: neither of them
  std::string suffix;  // for names: "avg", "mean_max", "p90"
  std::string words;   // for descriptions: "average over time"
  // Whether the statistics of components are the components of a vector, as of averages.
  bool linear = true;
};

// Code tables 4.7, 4.9 and 4.10 and percentiles of edition 2; the time range of edition 1 (table 5)
// and means and spreads of ECMWF.
Product read_product(const Message& message);

}  // namespace windsplat::data::grib
