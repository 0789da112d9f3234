// Shape functions of cells and their inverse: position -> parametric coordinates of a cell ->
// weights of its corners. Corners are in the order of VTK (hexahedron, not voxel).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace windsplat::data::vtk {

enum class Shape : std::uint8_t { none, triangle, quad, tetra, pyramid, wedge, hexahedron };

using Point = std::array<double, 3>;
using Corners = std::array<Point, 8>;

// Numbers of corners and dimensions of a shape.
int corners_of(Shape shape);
int dimension_of(Shape shape);

// A position in a cell: parametric coordinates r, s, t from 0 to 1, or, if the cell is too
// distorted, those in one of the simplices into which it is divided.
struct CellPlace {
  std::array<float, 3> rst{};
  std::uint8_t split = 0;  // 0: coordinates of the cell; otherwise of simplex split - 1
};

// Computes the coordinates of `place` in the cell; false if it is outside by more than a millionth
// of the cell. Two-dimensional shapes use x and y only. Adds the number of linear systems solved to
// `steps`: 1 for a tetrahedron or triangle, about 3 for a regular cell, at most 22.
bool find_in_cell(Shape shape, const Corners& corners, const Point& place, CellPlace& out,
                  std::uint64_t& steps);

// An oblique bounding box of a cell, with faces parallel to its mean edges. Contains every position
// accepted by find_in_cell, and fits thin and sheared cells tightly.
class SlantedBox {
 public:
  SlantedBox(Shape shape, const Corners& corners);

  // The half-open range of the i < count for which `from + (step * i, 0, 0)` lies within.
  [[nodiscard]] std::array<std::size_t, 2> along_row(const Point& from, double step,
                                                     std::size_t count) const;

 private:
  struct Slab {
    Point normal{0, 0, 0};
    double low = 0;  // range of the product with the normal, relative to origin_
    double high = 0;
  };
  Point origin_;
  std::array<Slab, 3> slabs_;
  std::size_t count_;  // number of dimensions of the shape
};

// Weights of the corners, one per corner; their sum is 1.
std::array<double, 8> corner_weights(Shape shape, const CellPlace& place);

// Volume, or area in x and y, of the simplices of the cell; 0 if degenerate.
double measure(Shape shape, const Corners& corners);

}  // namespace windsplat::data::vtk
