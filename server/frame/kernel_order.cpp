// Bricks and sheets outward from the eye, as engine/plan orders them.
#include "server/frame/kernel_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace windsplat::frame {

KernelOrder::KernelOrder(const scene::Scene& scene, const engine::reference::LayerGroup& layers,
                         int number)
    : scene_(scene), layers_(layers), number_(number), inside_(scene.camera.perspective) {
  const scene::Camera& camera = scene.camera;
  double most = -1;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto along = static_cast<glm::length_t>(a);
    const auto& positions = scene.lattice.positions[a];
    const auto& axis = layers.axis[a];
    const auto place = [&](std::size_t i) {
      return positions[static_cast<std::size_t>(axis[i].sample)];
    };
    if (camera.perspective) {
      for (std::size_t i = 1; i < axis.size(); ++i) {
        if (camera.eye[along] >= (place(i - 1) + place(i)) / 2) eye_[a] = static_cast<int>(i);
      }
    } else if (camera.forward[along] < 0) {
      eye_[a] = static_cast<int>(axis.size()) - 1;
    }
    inside_ = inside_ && camera.eye[along] >= scene.lattice.box_min[along] &&
              camera.eye[along] <= scene.lattice.box_max[along];
    const auto& spacing = scene.lattice.spacing[a];
    const double mean =
        std::accumulate(spacing.begin(), spacing.end(), 0.0) / static_cast<double>(spacing.size());
    const double crossed = std::abs(camera.forward[along]) / mean;
    if (crossed > most * (1 + 1e-12)) {
      most = crossed;
      major_ = a;
    }
  }
}

// Bricks of eight outward from that of the eye, upper side first, and positions likewise in each.
KernelOrder::Rank KernelOrder::rank(std::size_t axis, int index) const {
  const int count = static_cast<int>(layers_.axis[axis].size());
  const int brick = index / 8 - eye_[axis] / 8;
  const int start = std::clamp(eye_[axis], index / 8 * 8, std::min(index / 8 * 8 + 7, count - 1));
  const int within = index - start;
  return {brick < 0 ? 1e6 - brick : brick, within < 0 ? 10.0 - within : within};
}

OrderKey KernelOrder::key(const std::array<int, 3>& index,
                          const engine::reference::KernelPosition& position) const {
  if (scene_.lattice.places) return {position.centre[2]};
  const auto& axis = layers_.axis[major_];
  const auto sample = [&](int i) { return axis[static_cast<std::size_t>(i)].sample; };
  const int ahead = sample(index[major_]) - sample(eye_[major_]);
  const double distance = std::abs(ahead);
  const bool upward = scene_.camera.forward[static_cast<glm::length_t>(major_)] >= 0;
  const bool in_front = upward ? ahead >= 0 : ahead <= 0;
  const std::size_t u = major_ == 0 ? 1 : 0;
  const std::size_t v = major_ == 2 ? 1 : 2;
  const Rank ru = rank(u, index[u]);
  const Rank rv = rank(v, index[v]);
  return {inside_ ? distance : static_cast<double>(ahead < 0),
          inside_ ? static_cast<double>(in_front) : distance,
          static_cast<double>(number_),
          rv.brick,
          ru.brick,
          rv.within,
          ru.within};
}

}  // namespace windsplat::frame
