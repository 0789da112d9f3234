#include "server/annotate/paint/compose.hpp"

#include <algorithm>
#include <cstddef>

namespace windsplat::annotate {
namespace {

constexpr int strip_rows = 32;  // whole MCU rows

std::size_t strips_of(const Overlay& overlay) {
  return static_cast<std::size_t>((overlay.height() + strip_rows - 1) / strip_rows);
}

bool covers(const Overlay& overlay, const image::Part& part) {
  for (int y = part.y; y < part.y + part.height; ++y) {
    if (overlay.covers(part.x, y, part.width)) return true;
  }
  return false;
}

}  // namespace

void put(const Overlay& overlay, const image::Part& part, image::YccPicture& planes) {
  if (!covers(overlay, part)) {
    planes.put(part);
    return;
  }
  const std::size_t width = 4 * static_cast<std::size_t>(part.width);
  std::vector<float> pixels(width * static_cast<std::size_t>(part.height));
  for (int row = 0; row < part.height; ++row) {
    const auto n = static_cast<std::size_t>(row);
    std::copy_n(part.rgba + n * part.stride, width, pixels.data() + n * width);
    overlay.composite(part.x, part.y + row, part.width, pixels.data() + n * width);
  }
  planes.put({part.x, part.y, part.width, part.height, pixels.data(), width});
}

void put_empty(const Overlay& overlay, ThreadPool& pool, image::YccPicture& planes) {
  pool.run(strips_of(overlay), [&](std::size_t n, unsigned) {
    const int y = static_cast<int>(n) * strip_rows;
    const int rows = std::min(strip_rows, overlay.height() - y);
    const image::Part whole{0, y, overlay.width(), rows, nullptr, 0};
    if (!covers(overlay, whole)) return;
    const std::size_t width = 4 * static_cast<std::size_t>(overlay.width());
    const std::vector<float> transparent(width * static_cast<std::size_t>(rows));
    put(overlay, {0, y, overlay.width(), rows, transparent.data(), width}, planes);
  });
}

void composite(const Overlay& overlay, ThreadPool& pool, std::vector<float>& rgba) {
  pool.run(strips_of(overlay), [&](std::size_t n, unsigned) {
    const int first = static_cast<int>(n) * strip_rows;
    for (int y = first; y < std::min(first + strip_rows, overlay.height()); ++y) {
      const std::size_t row =
          4 * static_cast<std::size_t>(y) * static_cast<std::size_t>(overlay.width());
      overlay.composite(0, y, overlay.width(), rgba.data() + row);
    }
  });
}

}  // namespace windsplat::annotate
