// Transmittances on a rectilinear grid -> the transmittance at a place.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

namespace windsplat::surface {

// positions: ascending, of the points along each axis, at least one. factors: of the points, x
// fastest; 65535 is 1.
struct Transmittances {
  std::array<std::vector<double>, 3> positions;
  std::shared_ptr<const std::vector<std::uint16_t>> factors;

  // Trilinear; beyond the outermost points that of the nearest ones.
  [[nodiscard]] double at(const glm::dvec3& place) const;
};

}  // namespace windsplat::surface
