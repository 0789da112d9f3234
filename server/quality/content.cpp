// Interpolation of logarithms.
#include "server/quality/content.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::quality {

double at_distance(const AtDistances& known, double distance, int order) {
  constexpr double least = 1e-7;
  if (distance <= distances.front()) {
    return known.front() * std::pow(distance / distances.front(), order);
  }
  std::size_t k = 1;
  while (k + 1 < distances_count && distances[k] < distance) ++k;
  const double from = std::log(distances[k - 1]);
  const double share =
      (std::log(std::min(distance, distances.back())) - from) / (std::log(distances[k]) - from);
  return std::exp((1 - share) * std::log(std::max(known[k - 1], least)) +
                  share * std::log(std::max(known[k], least)));
}

Content scaled(Content content, double times) {
  content.length *= times;
  content.cell *= times;
  content.finest_cell *= times;
  content.step_cell *= times;
  const AtDistances bends = content.bends;
  const AtDistances shifts = content.shifts;
  for (std::size_t k = 0; k < distances_count; ++k) {
    content.bends[k] = at_distance(bends, distances[k] / times, 2);
    content.shifts[k] = at_distance(shifts, distances[k] / times, 1);
  }
  return content;
}

}  // namespace windsplat::quality
