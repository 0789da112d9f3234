// Marching cubes (W. E. Lorensen, H. E. Cline: Marching Cubes, SIGGRAPH 1987): which corners of a
// cell lie inside -> the triangles of the surface between them, by the edges that it cuts.
//
// The table is made from one rule, by which neighbouring cells agree: where corners alternate
// around a face, those inside are separated. No triangle lies within a face, so that every edge of
// a triangle belongs to at most two of them: the surface is a manifold, without cracks.
#pragma once

#include <array>
#include <cstdint>

namespace windsplat::surface {

constexpr int cell_corners = 8;  // corner c lies at (c & 1, c >> 1 & 1, c >> 2)
constexpr int cell_edges = 12;  // edge e runs along the axis e / 4, from the corner cell_edge(e)[0]
constexpr int cell_triangles_max = 5;

struct CellCase {
  int triangles = 0;
  std::array<std::array<std::int8_t, 3>, cell_triangles_max> edges{};  // of each triangle
};

// Both corners of an edge, the one of the lower index first.
std::array<int, 2> cell_edge(int edge);

// inside: bit c is set if corner c lies inside.
const CellCase& cell_case(unsigned inside);

}  // namespace windsplat::surface
