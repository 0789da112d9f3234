// Terrain -> depth, coverage, brightness and normal of the opaque surface at the pixels of a
// picture, the same for every rendering method.
#pragma once

#include <glm/vec3.hpp>

#include "server/terrain/terrain.hpp"

namespace windsplat::terrain {

// right, down and forward are orthonormal.
struct View {
  glm::dvec3 eye{0}, right{1, 0, 0}, down{0, 0, -1}, forward{0, 1, 0};
  double pixel = 1;  // size at unit distance (perspective) or in the world
  double near = 0;   // least view depth, perspective only
  bool perspective = true;
};

struct PixelSurface {
  double depth = 0;      // view depth
  double coverage = 0;   // part of the pixel that the surface covers
  double cosine = 0;     // between ray and normal, absolute
  double relief = 1;     // factor of its brightness, as relief_of()
  glm::dvec3 normal{0};  // of the terrain; 0: what is seen is not one
};

// Brightness of a slope in light from the north-west, halfway between level and straight down, over
// that of level ground: sqrt(2) (normal, light), within [0.5, 1.35]. On a map north is along y. The
// normal and `up` are unit vectors; up: on a globe the direction of the point, on a map z.
double relief_of(const glm::dvec3& normal, const glm::dvec3& up, Base base);

constexpr int side_max = 4;

// The terrain at side x side pixels; the left upper corner of the first is `right` and `down`
// pixels from the middle of the picture. A pixel of which the middle and the four corners see the
// terrain is covered, one of which none does is not; of others the covered part is that of 4 x 4
// rays. The rest is that in the middle, or, where it misses, the means of these rays.
void look(const Terrain& terrain, const View& view, double right, double down, int side,
          PixelSurface* pixels);

// A pixel that shows `front` and, where it is not covered, `behind`, as one surface.
PixelSurface combined(const PixelSurface& front, const PixelSurface& behind);

}  // namespace windsplat::terrain
