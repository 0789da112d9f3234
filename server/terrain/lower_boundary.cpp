// Heights of the ground, or lowest samples and the faces below them -> half a cell beyond the
// edges.
#include "server/terrain/lower_boundary.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>

namespace windsplat::terrain {

namespace {

using Point = glm::dvec3;

Point direction_of(const Point& way, const Point& otherwise) {
  const double length = glm::length(way);
  return length > 0 ? way / length : otherwise;
}

class Bottom {
 public:
  Bottom(const Samples& samples, Base base) : samples_(samples), base_(base) {}

  // The ground at column i, j or, where x or y differ from them, half a cell beyond it.
  [[nodiscard]] Point vertex(int i, int j, int x, int y) const {
    Point beside(0);
    if (x != i) beside += beyond(i, j, 0, x < i ? -1 : 1);
    if (y != j) beside += beyond(i, j, 1, y < j ? -1 : 1);
    if (samples_.ground == nullptr) return face(i, j) + beside;
    const Point at = place(i, j, 0) + beside;
    const double height = (*samples_.ground)[column(i, j)];
    if (base_ == Base::map) return {at.x, at.y, height};
    return height * direction_of(at, Point(0, 0, 1));
  }

 private:
  [[nodiscard]] std::size_t column(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(samples_.dims[0]) +
           static_cast<std::size_t>(i);
  }

  // The middle of the lowest face of a column; NaN: it is open.
  [[nodiscard]] Point face(int i, int j) const {
    const int level = samples_.lowest == nullptr ? 0 : (*samples_.lowest)[column(i, j)];
    if (level < 0) return Point(std::numeric_limits<double>::quiet_NaN());
    return place(i, j, level) - 0.5 * rise(i, j, level);
  }

  // From a column at the end of an axis to the end of its cell, away from the column before;
  // nothing where the columns of the row coincide at a pole.
  [[nodiscard]] Point beyond(int i, int j, int axis, int sign) const {
    const auto a = static_cast<std::size_t>(axis);
    if (samples_.dims[a] > 1) {
      if (axis == 1 && is_pole(j)) return Point(0);
      const int before_i = axis == 0 ? i - sign : i;
      const int before_j = axis == 0 ? j : j - sign;
      const Point way = face(i, j) - face(before_i, before_j);
      const bool level = samples_.ground != nullptr || std::isnan(way.x);
      return 0.5 * (level ? place(i, j, 0) - place(before_i, before_j, 0) : way);
    }
    return 0.5 * sign * samples_.spacing[a] * across(i, j, axis);
  }

  [[nodiscard]] Point place(int i, int j, int k) const {
    const auto& dims = samples_.dims;
    const auto& p =
        samples_.places[(static_cast<std::size_t>(k) * static_cast<std::size_t>(dims[1]) +
                         static_cast<std::size_t>(j)) *
                            static_cast<std::size_t>(dims[0]) +
                        static_cast<std::size_t>(i)];
    return {p[0], p[1], p[2]};
  }

  [[nodiscard]] Point up(int i, int j) const {
    const Point vertical(0, 0, 1);
    return base_ == Base::map ? vertical : direction_of(place(i, j, 0), vertical);
  }

  // From the lowest sample to the one above it, or to it from the one below.
  [[nodiscard]] Point rise(int i, int j, int level) const {
    const int below = std::min(level, samples_.dims[2] - 2);
    if (below >= 0) return place(i, j, below + 1) - place(i, j, below);
    return samples_.spacing[2] * up(i, j);
  }

  // The direction of an axis of one sample: perpendicular to the vertical and the other axis.
  [[nodiscard]] Point across(int i, int j, int axis) const {
    const Point upward = up(i, j);
    const Point east = direction_of(glm::cross(Point(0, 0, 1), upward), Point(1, 0, 0));
    const int other = 1 - axis;
    Point along = other == 0 ? east : glm::cross(upward, east);
    const int count = samples_.dims[static_cast<std::size_t>(other)];
    if (count > 1) {
      const int at = other == 0 ? i : j;
      const int last = std::min(at + 1, count - 1);
      along = other == 0 ? place(last, j, 0) - place(last - 1, j, 0)
                         : place(i, last, 0) - place(i, last - 1, 0);
    }
    const Point way = axis == 0 ? glm::cross(along, upward) : glm::cross(upward, along);
    return direction_of(way, axis == 0 ? Point(1, 0, 0) : Point(0, 1, 0));
  }

  [[nodiscard]] bool is_pole(int j) const {
    return base_ == Base::globe && samples_.dims[0] > 1 && place(0, j, 0) == place(1, j, 0);
  }

  const Samples& samples_;
  Base base_;
};

}  // namespace

std::shared_ptr<const Terrain> surface_of(const Samples& samples, Base base) {
  const Bottom bottom(samples, base);
  const bool closed = samples.around > 0;
  const int columns = closed ? samples.around : samples.dims[0];
  const int rows = samples.dims[1];
  const int width = closed ? columns + 1 : columns + 2;
  std::vector<Terrain::Vertex> vertices;
  vertices.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows + 2));
  for (int y = -1; y <= rows; ++y) {
    const int j = std::clamp(y, 0, rows - 1);
    for (int x = closed ? 0 : -1; x <= columns; ++x) {
      const int i = closed ? x % columns : std::clamp(x, 0, columns - 1);
      const Point at = bottom.vertex(i, j, closed ? i : x, y);
      vertices.push_back(
          {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)});
    }
  }
  return std::make_shared<const Terrain>(std::move(vertices), width, base);
}

}  // namespace windsplat::terrain
