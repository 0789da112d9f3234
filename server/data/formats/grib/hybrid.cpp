#include "server/data/formats/grib/hybrid.hpp"

#include <cmath>
#include <cstddef>

namespace windsplat::data::grib {

namespace {

constexpr double usual_surface_pa = 101325;

// Whether the half levels are those of pressures between the top and the ground.
bool are_of_pressure(const std::vector<double>& pv) {
  const std::size_t half = pv.size() / 2;
  const auto pressure = [&](std::size_t n) { return pv[n] + pv[half + n] * usual_surface_pa; };
  constexpr double rounding = 1e-6;
  if (pv.size() < 4 || pv.size() % 2 != 0) return false;
  if (!(std::abs(pv[half]) < rounding && std::abs(pv.back() - 1) < rounding &&
        std::abs(pv[half - 1]) < 1 && pv.front() >= 0)) {
    return false;
  }
  for (std::size_t n = 1; n < half; ++n) {
    if (!(pv[half + n] >= pv[half + n - 1] && pressure(n) > pressure(n - 1))) return false;
  }
  return true;
}

}  // namespace

std::optional<HybridCoefficients> at_full_levels(const std::vector<double>& pv,
                                                 const std::vector<double>& levels) {
  if (!are_of_pressure(pv)) return std::nullopt;
  const std::size_t half = pv.size() / 2;
  HybridCoefficients out;
  for (const double level : levels) {
    if (!(level >= 1 && level < static_cast<double>(half)) || level != std::floor(level)) {
      return std::nullopt;
    }
    const auto below = static_cast<std::size_t>(level);
    out.a.push_back((pv[below - 1] + pv[below]) / 2);
    out.b.push_back((pv[half + below - 1] + pv[half + below]) / 2);
  }
  return out;
}

}  // namespace windsplat::data::grib
