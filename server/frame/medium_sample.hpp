// The medium at a sample: value -> extinction and colour by the transfer functions of the layers.
#pragma once

#include <cmath>
#include <glm/vec3.hpp>

#include "server/engine/reference/kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

inline double extinction_at(const scene::ScalarLayer& layer, double value) {
  if (layer.extinction.empty() || std::isnan(value)) return 0;
  return engine::reference::table_extinction(layer, value);
}

inline glm::dvec3 color_at(const scene::ColorTable& table, double value) {
  if (table.entries.empty() || std::isnan(value)) return {0, 0, 0};
  const auto c = engine::reference::table_color(table, value);
  return {c[0], c[1], c[2]};
}

struct Medium {
  double extinction = 0;
  glm::dvec3 emission{0, 0, 0};  // extinction times colour
  [[nodiscard]] glm::dvec3 color() const {
    return extinction > 0 ? emission / extinction : emission;
  }
  void add(const scene::ScalarLayer& layer, double value, double share) {
    const double rho = share * extinction_at(layer, value);
    extinction += rho;
    emission += rho * color_at(layer.color, value);
  }
};

}  // namespace windsplat::frame
