// Samples on a lattice -> the triangles of an isosurface, or of a section, with the values of a
// field at their vertices.
//
// A cell has eight neighbouring samples as its corners (cell_cases.hpp). Vertices lie on its edges,
// where the function, linear along them, has the value of the surface. A cell with a masked corner
// is left out, which leaves a hole; of a section along a layer of samples only those of the layer
// count. Samples that close a circle have cells between the last and the first. The same for any
// number of threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"

namespace windsplat::surface {

using Point = std::array<float, 3>;

struct Mesh {
  std::vector<Point> places;   // of vertices, world units
  std::vector<Point> normals;  // unit, towards larger values; zero where the gradient vanishes; of
                               // a layer of samples along its axis, to either side
  std::vector<float> values;   // of the second field, NaN where it is masked; empty: none
  std::vector<std::array<std::uint32_t, 3>> triangles;
  [[nodiscard]] std::size_t bytes() const;
};

// Positions of samples, x fastest, as scene::Lattice. Refers to the arrays of its owner.
struct Samples {
  std::array<int, 3> dims{1, 1, 1};
  std::array<const double*, 3> positions{};  // along each axis, of a rectilinear lattice
  const Point* places = nullptr;             // of a curved one; null: rectilinear
  int around = 0;                            // that many samples along x close a circle; 0: none
  [[nodiscard]] int width() const { return around > 0 ? around : dims[0]; }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(dims[1]) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(dims[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] glm::dvec3 place(int i, int j, int k) const;
};

// What is zero on the surface. `values` minus the level of an isosurface; the distance from a
// plane; or, of a layer, the index along an axis minus that of the layer. A plane closer than 1e-4
// cells to all samples of a layer is that layer, unless it cuts the lattice elsewhere too.
struct Cut {
  enum class Kind { isosurface, plane, layer };
  Kind kind = Kind::isosurface;
  double level = 0;
  glm::dvec3 point{0}, normal{0, 0, 1};  // of a plane; unit
  int axis = 2;                          // of a layer
  double index = 0;
  // Of the field that is cut; NaN: masked, also for a plane or a layer.
  const float* values = nullptr;
};

struct MeshSize {
  std::size_t vertices = 0, triangles = 0;
  [[nodiscard]] std::size_t bytes(bool valued) const;
};

// The size of the mesh that extract() makes. Takes one pass over the samples.
// Incomplete if cancelled.
MeshSize measure(const Samples& samples, const Cut& cut, ThreadPool& pool,
                 const CancelToken& cancel = {});

// second: values of the field at vertices, or null. At least two samples along every axis.
// Incomplete if cancelled.
Mesh extract(const Samples& samples, const Cut& cut, const float* second, ThreadPool& pool,
             const CancelToken& cancel = {});

}  // namespace windsplat::surface
