// Polygons of an unstructured mesh, and a cell's outline in the plane of the lattice or in a chart
// in which it is a simple polygon.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace windsplat::data::cf {

using PlanePoint = std::array<double, 2>;

// Cells are polygons of any degree, whose corners follow one another around the cell. On the sphere
// x is a longitude and y a latitude, in degrees; elsewhere both are lengths of one plane.
struct Mesh {
  bool on_sphere = false;
  std::vector<double> x;  // of the nodes
  std::vector<double> y;
  std::vector<std::uint32_t> corners;  // nodes of each cell, cell after cell
  std::vector<std::uint32_t> first;    // of each cell in `corners`, and the end of the last
  // Nodes that are one place: the one that is a corner, and one that is none, whose value stands in
  // where that of the corner is missing. Applied in this order.
  std::vector<std::array<std::uint32_t, 2>> twins;

  [[nodiscard]] std::size_t cells() const { return first.empty() ? 0 : first.size() - 1; }
  [[nodiscard]] std::size_t nodes() const { return x.size(); }
  // From node a to b in x, on the sphere the shorter way around. The opposite of the way back.
  [[nodiscard]] double way(std::uint32_t a, std::uint32_t b) const;
  [[nodiscard]] bool is_pole(std::uint32_t node) const;
};

// An edge of a cell in the plane of x and y. Both cells at an edge have the same numbers, so that
// every position belongs to one of them; `turns` times 360 degrees lead from there to the cell.
struct OutlineEdge {
  PlanePoint from{};
  PlanePoint to{};
  int turns = 0;
};

// A cell in the plane. One that contains a pole is closed along its latitude, and at a corner on
// the pole two meridians meet that row.
struct Outline {
  std::vector<PlanePoint> points;  // longitudes continue beyond 360
  std::vector<OutlineEdge> edges;
  bool polar = false;  // contains a pole, or has a corner there
};

// False for a cell without an outline: its longitudes close neither on themselves nor on a circle.
bool outline_of(const Mesh& mesh, std::size_t cell, Outline& out);

// Twice the signed area of a polygon.
double doubled_area(const std::vector<PlanePoint>& points);

// A cell as a simple polygon: in longitude and latitude, or if it is polar by the angle from the
// pole (azimuthal equidistant).
struct ChartCell {
  std::vector<PlanePoint> points;  // one per corner
  std::vector<std::uint32_t> nodes;
  bool polar = false;
  double pole = 90;  // or -90, if polar

  [[nodiscard]] PlanePoint in_chart(double x, double y) const;
  [[nodiscard]] PlanePoint in_plane(const PlanePoint& point) const;
  [[nodiscard]] PlanePoint centroid() const;  // of the area, in the chart
  [[nodiscard]] PlanePoint mean() const;      // of the corners
  bool on_sphere = false;
};

void chart_of(const Mesh& mesh, std::size_t cell, bool polar, ChartCell& out);

}  // namespace windsplat::data::cf
