// The oracle of the engine: every kernel in visibility order, every pixel of its bounding box, the
// formulas as docs/design/rendering-model.md states them. No tiles, no bricks, no tables of its
// own, no early stop.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::naive {

template <class Real>
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Real> rgba;  // linear premultiplied, row 0 on top
};

// Instantiated for double (the oracle) and float (what the benchmark measures against).
template <class Real>
Picture<Real> render(const scene::Scene& scene);

}  // namespace windsplat::naive
