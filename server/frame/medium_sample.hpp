// The medium at a sample: value -> extinction and colour by the transfer functions of the layers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>

#include "server/scene/scene.hpp"

namespace windsplat::frame {

inline double extinction_at(const scene::ScalarLayer& layer, double value) {
  constexpr double most = 1e30;
  const auto& points = layer.extinction;
  if (points.empty() || std::isnan(value)) return 0;
  if (value <= points.front()[0]) return std::min(points.front()[1], most);
  for (std::size_t p = 1; p < points.size(); ++p) {
    if (value > points[p][0]) continue;
    const double step = points[p][0] - points[p - 1][0];
    const double share = step > 0 ? (value - points[p - 1][0]) / step : 1;
    const double low = std::min(points[p - 1][1], most);
    return low + share * (std::min(points[p][1], most) - low);
  }
  return std::min(points.back()[1], most);
}

inline glm::dvec3 color_at(const scene::ColorTable& table, double value) {
  if (table.entries.empty() || std::isnan(value)) return {0, 0, 0};
  const double width = table.range[1] - table.range[0];
  const double at = width > 0 ? std::clamp((value - table.range[0]) / width, 0.0, 1.0) : 0.5;
  const auto& c =
      table.entries[static_cast<std::size_t>(at * static_cast<double>(table.entries.size() - 1))];
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
