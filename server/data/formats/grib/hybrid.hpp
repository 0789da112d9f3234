// Coefficients of hybrid levels in messages -> pressures of full levels.
#pragma once

#include <optional>
#include <vector>

namespace windsplat::data::grib {

// p(level) = a(level) + b(level) * surface pressure, in Pa; one of each for a level.
struct HybridCoefficients {
  std::vector<double> a;
  std::vector<double> b;
};

// pv: of a message, a of all half levels from the top down, then b of them. levels: numbers of full
// levels, from 1 at the top. The pressure of a full level is the mean of those of the half levels
// around it, as ECMWF defines it (IFS documentation, part III, 2.2.1). nullopt if pv is of another
// kind (as in COSMO): b must rise from 0 to 1, a end at 0, and pressures rise downward.
std::optional<HybridCoefficients> at_full_levels(const std::vector<double>& pv,
                                                 const std::vector<double>& levels);

}  // namespace windsplat::data::grib
