// A surface as a scene shows it: triangles, colours, opacity.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/surface/mesh.hpp"

namespace windsplat::surface {

using Color = std::array<float, 3>;  // linear

// Lines of constant value, drawn on a surface that has values.
struct Contours {
  double step = 0;   // between values, multiples of it; 0: none
  double width = 1;  // pixels
  Color color{0, 0, 0};
};

// A surface of a scene. Its brightness is ambient + (1 - ambient) |cos(normal, ray)|.
struct Shown {
  std::shared_ptr<const Mesh> mesh;
  double opacity = 1;
  double ambient = 1;
  std::vector<Color> colors;          // evenly over the range; one: constant
  std::array<double, 2> range{0, 1};  // values at both ends, ascending
  Contours contours;
};

}  // namespace windsplat::surface
