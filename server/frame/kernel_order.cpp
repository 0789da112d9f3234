// Bricks and sheets outward from the eye, as engine/plan orders them.
#include "server/frame/kernel_order.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/engine/plan.hpp"

namespace windsplat::frame {

KernelOrder::KernelOrder(const scene::Scene& scene, const engine::reference::LayerGroup& layers,
                         int number)
    : scene_(scene), layers_(layers), number_(number), inside_(scene.camera.perspective) {
  const scene::Camera& camera = scene.camera;
  const scene::Lattice& lattice = scene.lattice;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> places;
    for (const auto& position : layers.axis[a]) {
      places.push_back(lattice.positions[a][static_cast<std::size_t>(position.sample)]);
    }
    eye_[a] = engine::eye_index(camera, static_cast<int>(a), places);
    const double at = camera.eye[static_cast<glm::length_t>(a)];
    inside_ = inside_ && at >= lattice.box_min[static_cast<glm::length_t>(a)] &&
              at <= lattice.box_max[static_cast<glm::length_t>(a)];
  }
  const int major = engine::major_axis(camera, lattice);
  major_ = static_cast<std::size_t>(major);
  eye_sample_ = engine::eye_index(camera, major, lattice.positions[major_]);
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
  const bool by_depth = scene_.lattice.places || (scene_.vector && scene_.vector->streamlets);
  if (by_depth) return {position.centre[2]};
  const auto& axis = layers_.axis[major_];
  const int ahead = axis[static_cast<std::size_t>(index[major_])].sample - eye_sample_;
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
