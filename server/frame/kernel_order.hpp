// The order in which method `kernel` draws kernels, as keys.
#pragma once

#include <array>

#include "server/engine/reference/kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// Ascends in the order of drawing: docs/design/rendering-model.md#compositing-one-kernel.
using OrderKey = std::array<double, 9>;

// Kernel positions of layers of one stride. The scene and the layers must outlive it.
class KernelOrder {
 public:
  // `number`: of the layers among those of other strides.
  KernelOrder(const scene::Scene& scene, const engine::reference::LayerGroup& layers, int number);

  // `index` counts kernel positions along each axis.
  [[nodiscard]] OrderKey key(const std::array<int, 3>& index,
                             const engine::reference::KernelPosition& position) const;

 private:
  struct Rank {
    double brick = 0;
    double within = 0;
  };
  [[nodiscard]] Rank rank(std::size_t axis, int index) const;

  const scene::Scene& scene_;
  const engine::reference::LayerGroup& layers_;
  int number_ = 0;
  std::array<int, 3> eye_{};  // the kernel position whose cell contains the eye
  int eye_sample_ = 0;        // of all samples along the major axis, the one whose cell contains it
  std::size_t major_ = 0;
  bool inside_ = false;
};

}  // namespace windsplat::frame
