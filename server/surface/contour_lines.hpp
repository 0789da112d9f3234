// Triangles with values -> the lines along which these have given values.
#pragma once

#include <vector>

#include "server/surface/mesh.hpp"

namespace windsplat::surface {

struct ContourLine {
  double level = 0;
  std::vector<Point> places;   // world units, at least two; of a closed line the last is the first
  std::vector<Point> normals;  // of the mesh there, of any length
};

// Values are linear along the edges of triangles, as they are drawn. Triangles with a masked corner
// have no lines. levels: ascending. Lines in the order of their levels; that of the lines of one
// level and their directions follow from the mesh alone.
std::vector<ContourLine> contour_lines(const Mesh& mesh, const std::vector<double>& levels);

}  // namespace windsplat::surface
