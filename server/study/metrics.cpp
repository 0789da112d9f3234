// Errors in linear light, and resampling of pictures for them.
#include "server/study/metrics.hpp"

#include <algorithm>
#include <cmath>

#include "server/base/check.hpp"
#include "server/study/srgb.hpp"

namespace windsplat::study {

bool within_unit(std::span<const float> rgba, double slack) {
  return std::all_of(rgba.begin(), rgba.end(),
                     [&](float v) { return v >= -slack && v <= 1 + slack; });
}

std::vector<float> resample(std::span<const float> rgba, int width, int height, int to_width,
                            int to_height) {
  WINDSPLAT_CHECK(rgba.size() == 4 * static_cast<std::size_t>(width) * height);
  struct Tap {
    int low, high;
    float high_weight;
  };
  const auto taps = [](int from, int to) {
    std::vector<Tap> out;
    for (int i = 0; i < to; ++i) {
      const double at = std::clamp((i + 0.5) * from / to - 0.5, 0.0, from - 1.0);
      const int low = static_cast<int>(at);
      out.push_back({low, std::min(low + 1, from - 1), static_cast<float>(at - low)});
    }
    return out;
  };
  const std::vector<Tap> columns = taps(width, to_width);
  std::vector<float> out;
  out.reserve(4 * static_cast<std::size_t>(to_width) * to_height);
  for (const Tap& row : taps(height, to_height)) {
    const float* const above = rgba.data() + 4 * static_cast<std::size_t>(row.low) * width;
    const float* const below = rgba.data() + 4 * static_cast<std::size_t>(row.high) * width;
    for (const Tap& column : columns) {
      for (int c = 0; c < 4; ++c) {
        const auto along = [&](const float* values) {
          const float low = values[4 * column.low + c];
          return low + column.high_weight * (values[4 * column.high + c] - low);
        };
        const float top = along(above);
        out.push_back(top + row.high_weight * (along(below) - top));
      }
    }
  }
  return out;
}

double linear_rmse(std::span<const std::uint8_t> rgb, std::span<const std::uint8_t> decoded) {
  WINDSPLAT_CHECK(rgb.size() == decoded.size() && !rgb.empty());
  double squares = 0;
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const double apart = linear_from_code(rgb[i]) - linear_from_code(decoded[i]);
    squares += apart * apart;
  }
  return std::sqrt(squares / static_cast<double>(rgb.size()));
}

}  // namespace windsplat::study
