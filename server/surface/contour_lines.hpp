// Triangles with values -> the lines along which these have given values.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/surface/mesh.hpp"

namespace windsplat::surface {

struct ContourLine {
  double level = 0;
  std::vector<Point> places;   // world units, at least two; of a closed line the last is the first
  std::vector<Point> normals;  // of the mesh there, of any length
};

// How many segments, each across a triangle, the lines of each level have. levels: ascending.
std::vector<std::size_t> contour_segments(const Mesh& mesh, const std::vector<double>& levels);

// Values are linear along the edges of triangles, as they are drawn. Triangles with a masked corner
// have no lines. levels: ascending. Lines in the order of their levels; that of the lines of one
// level and their directions follow from the mesh alone. Incomplete if cancelled.
void each_contour_line(const Mesh& mesh, const std::vector<double>& levels,
                       const std::function<void(const ContourLine&)>& use,
                       const CancelToken& cancel = {});

// Memory that each_contour_line() needs besides, with the line that it shows, for a level of that
// many segments.
std::size_t contour_line_bytes(std::size_t segments);

}  // namespace windsplat::surface
