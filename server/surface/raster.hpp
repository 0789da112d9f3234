// Triangles of a cell of pixels -> the samples that they cover -> fragments.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "server/surface/pixels.hpp"

namespace windsplat::surface {

constexpr int pixel_parts = 256;  // positions of vertices are rounded to these parts of a pixel

struct RasterVertex {
  std::int32_t x = 0, y = 0;  // parts of a pixel, from the corner of the picture
  double depth = 0;
  glm::dvec3 normal{0};
  float value = 0;
};

class CellRaster {
 public:
  // (left, top): the first pixel of the cell; (middle_x, middle_y): the middle of the picture.
  CellRaster(const terrain::View& view, int left, int top, double middle_x, double middle_y,
             Cell& to);

  void add(const Shown& shown, std::uint16_t surface, std::array<RasterVertex, 3> corners);
  // The fragments of all triangles added.
  void finish();

 private:
  struct Triangle;
  void add_piece(const Shown& shown, std::uint16_t surface, const Triangle& triangle, int x, int y,
                 std::uint16_t mask);

  // (right, down): pixels from the middle of the picture. depth: view depth.
  [[nodiscard]] double brightness(const Shown& shown, const glm::dvec3& normal, double right,
                                  double down, double depth) const;

  const terrain::View& view_;
  int left_, top_;
  double middle_x_, middle_y_;
  Cell& to_;
  std::array<std::uint32_t, static_cast<std::size_t>(cell_side) * cell_side> heads_;
};

}  // namespace windsplat::surface
