// A vector field on a grid -> its gradient in local axes at every sample.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <glm/mat3x3.hpp>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::derived {

// A vector field: arrays of components, masked in all of them at once, and factors to its unit.
struct VectorField {
  std::array<const float*, 3> component{};  // null: zero
  std::array<double, 3> factor{1, 1, 1};
};

// Heights of the samples in metres.
struct Heights {
  bool any = false;           // false: derivatives along the levels only, the vertical ones are 0
  std::vector<double> level;  // of each level; if empty, of each sample
  const float* sample = nullptr;
};

// What is known at a sample. Local axes: x and y of the grid (along x, perpendicular to it), up.
struct LocalGradient {
  std::size_t sample = 0;  // index in a volume
  glm::dmat3 gradient{0};  // gradient[d][c]: derivative of component c along d, per metre
  double side = 1;         // -1: the local axes are left-handed
  [[nodiscard]] glm::dvec3 curl() const;
  [[nodiscard]] double trace() const;
};

// Calls body for every sample where the gradient is known: the sample itself and, along each axis,
// one or two others are not masked, and neighbours are at least a centimetre apart on the sphere
// (they are not at a pole of longitudes). The grid has a known surface.
//
// Positions P and the field V are Cartesian vectors (on the sphere: about its centre, at radius
// earth_radius_m plus height), differentiated by the same differences D along the axes; the
// gradient is [DV] [DP]^-1. So it holds on curved, skewed and terrain-following grids, has every
// curvature term, and is exact where V is linear in space. Second order in the spacing. Uses memory
// for five rows, and 8 bytes for each column of a grid with columns.
void for_gradients(const Grid& grid, const VectorField& field, const Heights& heights,
                   const std::function<void(const LocalGradient&)>& body, const Progress& tell);

}  // namespace windsplat::data::derived
