// Two ascending lines -> the faces around each center, and their weights.
#include "server/data/cf/staggered/interleaved.hpp"

#include <cmath>
#include <limits>

namespace windsplat::data::cf {

namespace {

bool is_amid(double center, double below, double above, Interleaving how) {
  const double tolerance = how == Interleaving::between ? 0.5 : 0.2;  // of the cell
  return above > below && std::abs(center - (below + above) / 2) <= tolerance * (above - below);
}

// Whether a center with one face lies beyond it by at most one and a half cells.
bool is_near_end(double center, const std::vector<double>& faces, bool is_first) {
  constexpr double cells_max = 1.5;
  const std::size_t last = faces.size() - 1;
  const double cell = is_first ? faces[1] - faces[0] : faces[last] - faces[last - 1];
  const double beyond = is_first ? faces[0] - center : center - faces[last];
  return beyond > 0 && beyond <= cells_max * cell;
}

}  // namespace

std::optional<std::ptrdiff_t> interleaved(const std::vector<double>& faces,
                                          const std::vector<double>& centers, Interleaving how) {
  if (faces.size() < 3 || centers.size() < 3) return std::nullopt;
  const bool above = faces.front() < centers.front();
  const std::ptrdiff_t first = above ? 0 : -1;
  const auto count = static_cast<std::ptrdiff_t>(faces.size());
  const auto difference = count - static_cast<std::ptrdiff_t>(centers.size());
  const bool fits = difference == 0 || (above ? difference == 1 : difference == -1);
  if (!fits) return std::nullopt;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const std::ptrdiff_t low = static_cast<std::ptrdiff_t>(i) + first;
    const bool has_both = low >= 0 && low + 1 < count;
    const bool lies = has_both ? is_amid(centers[i], faces[static_cast<std::size_t>(low)],
                                         faces[static_cast<std::size_t>(low + 1)], how)
                               : is_near_end(centers[i], faces, low < 0);
    if (!lies) return std::nullopt;
  }
  return first;
}

std::vector<double> upper_weights(const std::vector<double>& faces,
                                  const std::vector<double>& centers, std::ptrdiff_t first) {
  std::vector<double> out(centers.size(), std::numeric_limits<double>::quiet_NaN());
  const auto count = static_cast<std::ptrdiff_t>(faces.size());
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const std::ptrdiff_t low = static_cast<std::ptrdiff_t>(i) + first;
    if (low < 0 || low + 1 >= count) continue;
    const double below = faces[static_cast<std::size_t>(low)];
    out[i] = (centers[i] - below) / (faces[static_cast<std::size_t>(low + 1)] - below);
  }
  return out;
}

}  // namespace windsplat::data::cf
