// The compositing formulas for one homogeneous cell with a line in it, in double precision. Tests
// verify their convergence orders in one dimension and compare the engine with them.
#pragma once

#include <array>
#include <cmath>

#include "server/engine/reference/ray.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine::reference {

// tau: optical depth of the cell; x in [0, 1]: position of the line in it; colours not
// premultiplied.
struct Cell {
  double tau = 0;
  double x = 0.5;
  double opacity = 0;
  std::array<double, 3> medium{};
  std::array<double, 3> line{};
};

// Premultiplied.
struct CellLight {
  double alpha = 0;
  std::array<double, 3> rgb{};
};

inline CellLight cell_light(scene::Compositing compositing, const Cell& cell) {
  using scene::Compositing;
  const bool euler = compositing == Compositing::cd_euler;
  const double absorbed = euler ? cell.tau : -std::expm1(-cell.tau);
  const double passed = euler ? 1 - cell.tau : std::exp(-cell.tau);
  CellLight light;
  light.alpha = absorbed + cell.opacity * passed;
  // Transmittance in front of the line.
  double before = 1 - cell.x * absorbed;
  if (compositing == Compositing::analytic) {
    before = cell.x > 0 ? std::exp(-cell.tau * cell.x) : 1;
  }
  if (compositing == Compositing::simple) before = passed;
  for (int c = 0; c < 3; ++c) {
    const double own = cell.opacity * before;
    light.rgb[c] = cell.medium[c] * light.alpha + own * (cell.line[c] - cell.medium[c]);
    if (compositing == Compositing::cd_naive) {
      // The front part of the cell attenuates the line and the back part.
      const double glow = absorbed * cell.medium[c];
      const double behind = cell.opacity * cell.line[c] + (1 - cell.opacity) * (1 - cell.x) * glow;
      light.rgb[c] = cell.x * glow + before * behind;
      const double back = 1 - (1 - cell.x) * absorbed;
      light.alpha = 1 - before * (1 - cell.opacity) * back;
    }
    if (compositing == Compositing::simple) {
      light.rgb[c] = absorbed * cell.medium[c] + passed * cell.opacity * cell.line[c];
    }
  }
  return light;
}

// `over`, front to back.
inline void composite(const CellLight& cell, Light& light) {
  for (int c = 0; c < 3; ++c) light.rgb[c] += light.transmittance * cell.rgb[c];
  light.alpha += light.transmittance * cell.alpha;
  light.transmittance *= 1 - cell.alpha;
}

}  // namespace windsplat::engine::reference
