// Compares the pictures in one pass.
#include "server/frame/difference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/base/check.hpp"

namespace windsplat::frame {
namespace {

template <class Real>
Difference difference(std::span<const float> picture, std::span<const Real> truth) {
  WINDSPLAT_CHECK(!truth.empty() && picture.size() == truth.size());
  double squares = 0;
  double largest = 0;
  bool known = true;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double apart = std::abs(static_cast<double>(picture[i]) - truth[i]);
    known = known && !std::isnan(apart);
    squares += apart * apart;
    largest = std::max(largest, apart);
  }
  if (!known) {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    return {unknown, unknown, unknown};
  }
  const double rmse = std::sqrt(squares / static_cast<double>(truth.size()));
  return {rmse, largest, psnr_of(rmse)};
}

}  // namespace

Difference difference_of(std::span<const float> picture, std::span<const float> truth) {
  return difference(picture, truth);
}

Difference difference_of(std::span<const float> picture, std::span<const double> truth) {
  return difference(picture, truth);
}

double psnr_of(double rmse) { return -20 * std::log10(rmse); }

}  // namespace windsplat::frame
