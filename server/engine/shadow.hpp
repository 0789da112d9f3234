// The spherical body of a scene -> which bricks of a curved lattice it hides entirely.
#pragma once

#include "server/engine/plan.hpp"

namespace windsplat::engine {

class Shadow {
 public:
  explicit Shadow(const RenderPlan& plan) : camera_(plan.camera), body_(plan.body) {}

  // Whether no pixel can show the kernels of a brick, with lines of half the length line_reach
  // (negative: without lines) and, if so, splats. Each kernel lies in a ball about its position,
  // and the balls in the cone (in orthographic views the cylinder) through the limb, beyond the
  // limb. False for rectilinear lattices.
  [[nodiscard]] bool hides(const PassPlan& pass, const kernels::Brick& brick, double line_reach,
                           bool splats) const;

 private:
  const kernels::Camera& camera_;
  const kernels::Body& body_;
};

}  // namespace windsplat::engine
