#include "server/scene/lines/reach.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::scene {

double widest_box(const VectorLayer& layer, std::size_t axis) {
  const auto& boxes = layer.group_box[axis];
  if (!boxes.empty()) {
    return std::max(1.0, static_cast<double>(*std::max_element(boxes.begin(), boxes.end())));
  }
  const int group = 1 << layer.halvings[axis];
  const int rest = layer.data_dims[axis] % group;
  const int least = rest == 0 ? group : rest;  // samples of the smallest group
  return std::max(1.0, static_cast<double>(layer.data_stride) / least);
}

double farthest_place(const VectorLayer& layer, std::size_t axis) {
  double most = 0.5;
  for (const float place : layer.group_place[axis]) {
    most = std::max(most, std::abs(static_cast<double>(place)));
  }
  return most;
}

std::array<double, 3> line_reach(const VectorLayer& layer, const std::array<double, 3>& cells) {
  const bool merged = layer.halvings != std::array{0, 0, 0};
  std::array<double, 3> reach{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double box = merged ? widest_box(layer, a) : 1;
    const double half_box = 0.5 * (layer.overlap ? layer.span : 1.0) * box;
    const double jitter = 0.5 * (layer.jitter_center + layer.jitter_stride) * box;
    const double shift = merged ? farthest_place(layer, a) + jitter : jitter;
    reach[a] = std::min(0.5 * layer.length, half_box * cells[a]) + shift * cells[a];
  }
  return reach;
}

}  // namespace windsplat::scene
