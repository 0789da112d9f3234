// Polygons -> which points they contain.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace windsplat::scene {

using Ring = std::vector<std::array<double, 2>>;  // closed: the last point is the first
using Polygon = std::vector<Ring>;

// Whether points lie in at least one of some polygons. In a polygon, by the even-odd rule over all
// of its rings: the number of edges that a ray meets, an edge holding its lower end and not its
// upper one, so that a vertex counts once where the boundary passes it, and twice or not at all
// where it turns. Points on an edge are inside. Differences are taken in extended precision.
class Inside {
 public:
  explicit Inside(const std::vector<Polygon>& polygons);

  // O(edges of the polygons that reach the height of the point).
  [[nodiscard]] bool contains(double x, double y) const;
  // Lowest and highest coordinate along x of all points.
  [[nodiscard]] const std::array<double, 2>& extent() const { return extent_; }

 private:
  struct Edge {
    std::array<double, 2> low, high;  // ends, by y
    std::size_t polygon = 0;
  };
  std::size_t band_of(double y) const;

  std::size_t polygons_ = 0;
  std::array<double, 2> extent_{};
  double bottom_ = 0, top_ = 0;
  std::vector<std::vector<Edge>> bands_;  // of equal height: edges that reach into them, by polygon
};

}  // namespace windsplat::scene
