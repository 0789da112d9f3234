#include "server/scene/region/polygon.hpp"

#include <algorithm>
#include <limits>

namespace windsplat::scene {

namespace {

constexpr std::size_t bands_max = 512;

}  // namespace

Inside::Inside(const std::vector<Polygon>& polygons) : polygons_(polygons.size()) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  extent_ = {infinity, -infinity};
  bottom_ = infinity;
  top_ = -infinity;
  std::size_t points = 0;
  for (const Polygon& polygon : polygons) {
    for (const Ring& ring : polygon) {
      points += ring.size();
      for (const auto& [x, y] : ring) {
        extent_ = {std::min(extent_[0], x), std::max(extent_[1], x)};
        bottom_ = std::min(bottom_, y);
        top_ = std::max(top_, y);
      }
    }
  }
  bands_.resize(std::clamp(points, std::size_t{1}, bands_max));
  for (std::size_t p = 0; p < polygons.size(); ++p) {
    for (const Ring& ring : polygons[p]) {
      for (std::size_t n = 1; n < ring.size(); ++n) {
        Edge edge{ring[n - 1], ring[n], p};
        if (edge.low[1] > edge.high[1]) std::swap(edge.low, edge.high);
        for (std::size_t b = band_of(edge.low[1]); b <= band_of(edge.high[1]); ++b) {
          bands_[b].push_back(edge);
        }
      }
    }
  }
}

std::size_t Inside::band_of(double y) const {
  if (!(top_ > bottom_)) return 0;
  const double share = (y - bottom_) / (top_ - bottom_);
  const auto band = static_cast<std::size_t>(share * static_cast<double>(bands_.size()));
  return std::min(band, bands_.size() - 1);
}

bool Inside::contains(double x, double y) const {
  if (!(y >= bottom_ && y <= top_ && x >= extent_[0] && x <= extent_[1])) return false;
  std::size_t polygon = polygons_;
  bool odd = false;
  for (const Edge& edge : bands_[band_of(y)]) {
    if (edge.polygon != polygon) {
      if (odd) return true;
      polygon = edge.polygon;
    }
    if (y < edge.low[1] || y > edge.high[1]) continue;
    const long double across = static_cast<long double>(edge.high[0]) - edge.low[0];
    const long double up = static_cast<long double>(edge.high[1]) - edge.low[1];
    // Positive to the left of the edge, which goes upwards.
    const long double side = across * (static_cast<long double>(y) - edge.low[1]) -
                             up * (static_cast<long double>(x) - edge.low[0]);
    const auto [left, right] = std::minmax(edge.low[0], edge.high[0]);
    if (side == 0 && x >= left && x <= right) return true;
    if (y < edge.high[1] && side > 0) odd = !odd;
  }
  return odd;
}

}  // namespace windsplat::scene
