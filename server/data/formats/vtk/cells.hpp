// The cells' shape functions and their inverse: a place in space -> a cell's own coordinates ->
// weights of its corners. Pure. Orders of corners are VTK's (hexahedron, not voxel).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace windsplat::data::vtk {

enum class Shape : std::uint8_t { none, triangle, quad, tetra, pyramid, wedge, hexahedron };

using Point = std::array<double, 3>;
using Corners = std::array<Point, 8>;

// How many corners a shape has, and how many dimensions.
int corners_of(Shape shape);
int dimension_of(Shape shape);

// Where in a cell a place is: the cell's coordinates r, s, t, each from 0 to 1, or, where the
// cell is so distorted that it has none there, those within one of the simplices that it splits
// into.
struct CellPlace {
  std::array<float, 3> rst{};
  std::uint8_t split = 0;  // 0: of the whole cell; otherwise simplex split - 1
};

// Finds `place` in the cell; false if it is outside, by more than a millionth of the cell. Shapes
// of two dimensions are sought by x and y alone. `steps` grows by the linear systems solved: 1 of a
// tetrahedron or triangle, some 3 of a good cell, 22 at most.
bool find_in_cell(Shape shape, const Corners& corners, const Point& place, CellPlace& out,
                  std::uint64_t& steps);

// A slanted box around a cell: between planes parallel to what its mean edges span. All that
// find_in_cell can find lies in it, of slivers and slanted cells little else.
class SlantedBox {
 public:
  SlantedBox(Shape shape, const Corners& corners);

  // Of the places `from + (step * i, 0, 0)`, i < count: the first that lies within, and one past
  // the last.
  [[nodiscard]] std::array<std::size_t, 2> along_row(const Point& from, double step,
                                                     std::size_t count) const;

 private:
  struct Slab {
    Point normal{0, 0, 0};
    double low = 0;  // of the product with the normal, counted from origin_
    double high = 0;
  };
  Point origin_;
  std::array<Slab, 3> slabs_;
  std::size_t count_;  // as many as the shape has dimensions
};

// One a corner; they sum to 1.
std::array<double, 8> corner_weights(Shape shape, const CellPlace& place);

// Volume, or area in x and y, of the simplices that the cell splits into; 0 if degenerate.
double measure(Shape shape, const Corners& corners);

}  // namespace windsplat::data::vtk
