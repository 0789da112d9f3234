// Counts by 2-D differences, which costs the same for large boxes as for small ones, then fills the
// lists.
#include "server/engine/reference/screen_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace windsplat::engine::reference {
namespace {

constexpr int tile_side = 8;  // pixels

// Pixels of [0, size) whose centres may lie within [low, high], both ends included.
std::pair<int, int> pixels_between(double low, double high, int size) {
  const double first = std::clamp(std::floor(low - 0.5), 0.0, static_cast<double>(size));
  const double last = std::clamp(std::ceil(high - 0.5), -1.0, size - 1.0);
  return {static_cast<int>(first), static_cast<int>(last)};
}

std::size_t tiles_along(int pixels) {
  return static_cast<std::size_t>((pixels + tile_side - 1) / tile_side);
}

}  // namespace

// Half-open ranges of tiles; all 0 if empty.
struct ScreenGrid::Tiles {
  std::size_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
};

ScreenGrid::ScreenGrid(int width, int height)
    : width_(width), height_(height), columns_(tiles_along(width)), rows_(tiles_along(height)) {}

ScreenGrid::Tiles ScreenGrid::tiles_of(const ScreenBox& box) const {
  const auto [x0, x1] = pixels_between(box.x0, box.x1, width_);
  const auto [y0, y1] = pixels_between(box.y0, box.y1, height_);
  if (x1 < x0 || y1 < y0) return {};
  return {static_cast<std::size_t>(x0 / tile_side), static_cast<std::size_t>(x1 / tile_side) + 1,
          static_cast<std::size_t>(y0 / tile_side), static_cast<std::size_t>(y1 / tile_side) + 1};
}

bool ScreenGrid::count(std::size_t boxes, const BoxOf& box_of, const CancelToken& cancel) {
  // 2-D differences of the list lengths. Unsigned wrap-around cancels in the sums.
  const std::size_t stride = columns_ + 1;
  std::vector<std::uint64_t> lengths(stride * (rows_ + 1));
  for (std::size_t id = 0; id < boxes; ++id) {
    if (cancel.cancelled()) return false;
    const Tiles tiles = tiles_of(box_of(id));
    ++lengths[tiles.y0 * stride + tiles.x0];
    --lengths[tiles.y0 * stride + tiles.x1];
    --lengths[tiles.y1 * stride + tiles.x0];
    ++lengths[tiles.y1 * stride + tiles.x1];
  }
  starts_.assign(columns_ * rows_ + 1, 0);
  total_ = 0;
  longest_ = 0;
  for (std::size_t y = 0; y < rows_; ++y) {
    std::uint64_t in_row = 0;
    for (std::size_t x = 0; x < columns_; ++x) {
      in_row += lengths[y * stride + x];
      std::uint64_t& length = lengths[y * stride + x];
      length = in_row + (y > 0 ? lengths[(y - 1) * stride + x] : 0);
      starts_[y * columns_ + x] = total_;
      total_ += length;
      longest_ = std::max<std::size_t>(longest_, length);
    }
  }
  starts_.back() = total_;
  return true;
}

bool ScreenGrid::fill(std::size_t boxes, const BoxOf& box_of, const CancelToken& cancel) {
  ids_ = std::make_unique_for_overwrite<std::uint32_t[]>(total_);
  std::vector<std::uint64_t> next = starts_;
  for (std::size_t id = 0; id < boxes; ++id) {
    // Checked for each box, because one may cover the whole screen.
    if (cancel.cancelled()) return false;
    const Tiles tiles = tiles_of(box_of(id));
    for (std::size_t y = tiles.y0; y < tiles.y1; ++y) {
      for (std::size_t x = tiles.x0; x < tiles.x1; ++x) {
        ids_[next[y * columns_ + x]++] = static_cast<std::uint32_t>(id);
      }
    }
  }
  return true;
}

std::span<const std::uint32_t> ScreenGrid::at(int x, int y) const {
  const std::size_t tile =
      static_cast<std::size_t>(y / tile_side) * columns_ + static_cast<std::size_t>(x / tile_side);
  return {ids_.get() + starts_[tile], ids_.get() + starts_[tile + 1]};
}

}  // namespace windsplat::engine::reference
