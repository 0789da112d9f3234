#include "server/quality/detail_error.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::quality {
namespace {

// Second order is the highest of the method. Where differences hardly grow the coarser pictures
// show little of the data, and the ratio is no measure of finer ones.
constexpr double growth_least = 1.2;
constexpr double growth_most = 4;

}  // namespace

// With D the difference of pictures n and n + 1, q the growth and c the correlation of successive
// differences, that of pictures n - i and n - i + 1 is D / q^i, and those of i and j correlate by
// c^|i - j|. Their sum is the error.
DetailError detail_error(const LevelDifferences& differences, int finer) {
  const double near = std::sqrt(differences.near);
  const double far = std::sqrt(differences.far);
  DetailError out;
  if (near == 0) return out;
  out.growth = std::clamp(far / near, growth_least, growth_most);
  const double correlation =
      far > 0 ? std::clamp(differences.product / (near * far), -1.0, 1.0) : 1;
  double squares = 0;
  for (int i = 1; i <= finer; ++i) {
    for (int j = 1; j <= finer; ++j) {
      squares += std::pow(out.growth, -i - j) * std::pow(correlation, std::abs(i - j));
    }
  }
  out.error = near * std::sqrt(std::max(0.0, squares));
  return out;
}

double error_at(const DetailError& known, const std::array<int, 3>& halvings) {
  int apart = 0;
  for (std::size_t a = 0; a < 3; ++a) apart += halvings[a] - known.halvings[a];
  return std::min(1.0, known.error * std::pow(known.growth, apart / 3.0));
}

}  // namespace windsplat::quality
