// Boxes of the world -> the part of the picture where what stands in them may be seen.
#pragma once

#include <array>

#include "server/engine/plan.hpp"

namespace windsplat::engine {

// A rectangle of the picture in pixels; empty when first > last.
struct Rectangle {
  double x0 = 0, x1 = -1, y0 = 0, y1 = -1;
  [[nodiscard]] bool empty() const { return x0 > x1 || y0 > y1; }
};

// A brick's stops as a box of the world.
struct Box {
  std::array<double, 3> low{};
  std::array<double, 3> high{};
};

// Where kernels may be seen, and how far from the eye.
struct Projected {
  Rectangle seen;
  double depth_first = 0, depth_last = 0;  // view depths of the kernels' reach
  bool whole = false;                      // no part of it lies outside the picture
};

class Projector {
 public:
  explicit Projector(const RenderPlan& plan) : camera_(plan.camera), view_(*plan.view) {}

  // Of a pass' kernels whose stops stand in `box` and that reach so far beyond them along the
  // world's axes.
  [[nodiscard]] Projected operator()(const PassPlan& plan, const Box& box,
                                     const std::array<double, 3>& reach) const;

 private:
  const kernels::Camera& camera_;
  const scene::Camera& view_;
};

}  // namespace windsplat::engine
