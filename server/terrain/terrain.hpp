// A surface over the columns of a grid, as triangles -> where rays first meet it.
//
// Cells of four neighbouring vertices are two triangles each, divided from the corner of the lowest
// indices to that of the highest, so that the surface is continuous and a ray meets it exactly. A
// pyramid of bounding boxes over blocks of cells finds the triangles near a ray.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <vector>

namespace windsplat::terrain {

// The points from + t along, t >= first.
struct Ray {
  glm::dvec3 from{0};
  glm::dvec3 along{0, 0, 1};
  double first = 0;
};

// t at which a ray first meets the surface (infinity: it does not), and the unit normal there, on
// the upper side.
struct Hit {
  double along = std::numeric_limits<double>::infinity();
  glm::dvec3 normal{0};
};

// On a map up is along z, and the surface is met from either side. On a globe about the origin up
// is away from it, and the surface is met from above only, like the sphere.
enum class Base { map, globe };

// Rays of one call.
constexpr int rays_max = 64;

class Terrain {
 public:
  using Vertex = std::array<float, 3>;  // world units

  // vertices: x fastest, at least 2 x 2, `width` of them in a row; NaN: missing, and so are the
  // cells beside it.
  Terrain(std::vector<Vertex> vertices, int width, Base base);

  // Where each of at most rays_max rays first meets the surface. Fastest for rays that are close to
  // each other. The result of a ray does not depend on the others but for rounding.
  void meet(const Ray* rays, int count, Hit* hits) const;

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] Base base() const { return base_; }
  [[nodiscard]] glm::dvec3 vertex(int x, int y) const { return at(vertices_, x, y); }
  // The unit normal at a vertex, by central differences; interpolated over triangles.
  [[nodiscard]] glm::dvec3 normal(int x, int y) const { return at(normals_, x, y); }
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Box {
    std::array<float, 3> low{}, high{};
  };
  struct Level {
    int width = 0, height = 0;
    std::vector<Box> boxes;
  };
  class Search;

  [[nodiscard]] glm::dvec3 at(const std::vector<Vertex>& of, int x, int y) const {
    const Vertex& v = of[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                         static_cast<std::size_t>(x)];
    return {v[0], v[1], v[2]};
  }
  [[nodiscard]] glm::dvec3 up(const glm::dvec3& place) const;
  void set_normals();
  [[nodiscard]] Box box_of_cells(int x, int y) const;
  void set_levels();

  std::vector<Vertex> vertices_, normals_;
  int width_, height_;
  Base base_;
  std::vector<Level> levels_;  // the finest first: blocks of 2 x 2 cells; each next of 2 x 2 blocks
};

// What a terrain of that many vertices takes: about 32 bytes for each.
std::size_t bytes_of(int width, int height);

}  // namespace windsplat::terrain
