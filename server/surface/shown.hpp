// A surface as a scene shows it: triangles, colours, opacity.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "server/surface/mesh.hpp"
#include "server/surface/transmittances.hpp"

namespace windsplat::surface {

using Color = std::array<float, 3>;  // linear

// Lines of constant value, drawn on a surface that has values.
struct Contours {
  double step = 0;   // between values, multiples of it; 0: none
  double width = 1;  // pixels
  Color color{0, 0, 0};
  std::vector<double> levels;  // further values, ascending
};

// Sunlight on surfaces, which are matt (Lambert's law). The brightness of one is
//   ambient + (1 - ambient) min(1, strength T) max(0, cos)
// and at most 1. T is the transmittance from the sun to the place; cos that of the angle between
// the sun and the normal on the side that is seen.
struct Sun {
  glm::dvec3 direction{0, 0, 1};  // unit vector towards it
  double ambient = 0;
  double strength = 1;
  std::shared_ptr<const Transmittances> media;  // T; null: 1 everywhere
};

// A surface of a scene. Without a sun its brightness is ambient + (1 - ambient) |cos(normal, ray)|.
struct Shown {
  std::shared_ptr<const Mesh> mesh;
  double opacity = 1;
  double ambient = 1;
  std::vector<Color> colors;          // evenly over the range; one: constant
  std::array<double, 2> range{0, 1};  // values at both ends, ascending
  Contours contours;
  std::shared_ptr<const Sun> sun;  // null: lit from the eye
};

}  // namespace windsplat::surface
