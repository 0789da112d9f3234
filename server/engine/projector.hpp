// World-space boxes -> the rectangle of the picture that kernels within them may cover.
#pragma once

#include <array>

#include "server/engine/plan.hpp"

namespace windsplat::engine {

// A rectangle of the picture in pixels; empty when first > last.
struct Rectangle {
  double x0 = 0, x1 = -1, y0 = 0, y1 = -1;
  [[nodiscard]] bool empty() const { return x0 > x1 || y0 > y1; }
};

// World-space bounding box of the kernel positions of a brick.
struct Box {
  std::array<double, 3> low{};
  std::array<double, 3> high{};
};

// Rectangle of the picture and view depths of some kernels.
struct Projected {
  Rectangle seen;
  double depth_first = 0, depth_last = 0;  // including the reach of the kernels
  bool whole = false;                      // lies entirely within the picture
};

class Projector {
 public:
  explicit Projector(const RenderPlan& plan) : camera_(plan.camera), view_(*plan.view) {}

  // Projects kernels of a pass whose positions lie in `box` and which extend by `reach` along the
  // world axes.
  [[nodiscard]] Projected operator()(const PassPlan& plan, const Box& box,
                                     const std::array<double, 3>& reach) const;

 private:
  const kernels::Camera& camera_;
  const scene::Camera& view_;
};

}  // namespace windsplat::engine
