// Reference implementation for the engine: every kernel in visibility order, every pixel of its
// bounding box, the formulas of docs/design/rendering-model.md. No tiles, bricks, tables or early
// termination.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::naive {

template <class Real>
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Real> rgba;  // linear premultiplied, top row first
};

// Instantiated for double (the oracle) and float (the baseline of the benchmark).
template <class Real>
Picture<Real> render(const scene::Scene& scene);

}  // namespace windsplat::naive
