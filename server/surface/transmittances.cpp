#include "server/surface/transmittances.hpp"

#include <algorithm>
#include <cstddef>

namespace windsplat::surface {

double Transmittances::at(const glm::dvec3& place) const {
  constexpr double whole = 65535;
  std::array<std::size_t, 3> low{};
  std::array<std::size_t, 3> next{};
  std::array<double, 3> part{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::vector<double>& along = positions[a];
    const double x = place[static_cast<glm::length_t>(a)];
    const auto above =
        static_cast<std::size_t>(std::upper_bound(along.begin(), along.end(), x) - along.begin());
    low[a] = above == 0 ? 0 : above - 1;
    next[a] = std::min(above, along.size() - 1);
    if (next[a] > low[a]) part[a] = (x - along[low[a]]) / (along[next[a]] - along[low[a]]);
  }
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double share = 1;
    std::size_t n = 0;
    for (std::size_t a = 3; a-- > 0;) {
      const bool far = (corner >> a & 1U) != 0;
      share *= far ? part[a] : 1 - part[a];
      n = n * positions[a].size() + (far ? next[a] : low[a]);
    }
    sum += share * static_cast<double>((*factors)[n]);
  }
  return sum / whole;
}

}  // namespace windsplat::surface
