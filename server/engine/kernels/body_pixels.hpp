// Part of the kernel body: rays of the pixels of a tile, and its finished rows.
#pragma once

#include "server/engine/kernels/body_composite.hpp"
#include "server/engine/kernels/body_rows.hpp"

namespace windsplat::engine::kernels {
namespace {

// Lengths of the rays of pixels at unit depth.
void fill_rays(const Camera& camera, const Tile& tile, float* rays) {
  const Pixel pixel = all<Pixel>(camera.pixel);
  const Pixel one = all<Pixel>(1.0F);
  for (int row = 0; row < blocks_of(tile.height); ++row) {
    const float top = top_of(tile, row) - camera.half_height_px;
    for (int column = 0; column < blocks_of(tile.width); ++column) {
      const float left = left_of(tile, column) - camera.half_width_px;
      float* to = rays + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * block_pixels;
      for (int l = 0; l < block_pixels; l += pixel_lanes) {
        const Pixel x = (all<Pixel>(left) + load<Pixel>(lane_x + l)) * pixel;
        const Pixel y = (all<Pixel>(top) + load<Pixel>(lane_y + l)) * pixel;
        store(hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, one))), to + l);
      }
    }
  }
}

// alpha = 1 - transmittance. With forward Euler the transmittance may be negative; divergence is
// shown, not clamped.
void copy_row(const Tile& tile, int y, float* rgba) {
  const hn::CappedTag<float, block_side> tag;
  constexpr int lanes = static_cast<int>(hn::MaxLanes(tag));
  const auto one = hn::Set(tag, 1.0F);
  const std::ptrdiff_t row = std::ptrdiff_t{block_side} * (y % block_side);
  const float* block = block_at(tile, y / block_side, 0) + row;
  for (int column = 0; column < blocks_of(tile.width); ++column, block += block_floats) {
    for (int i = 0; i < block_side; i += lanes, rgba += std::ptrdiff_t{4} * lanes) {
      const auto channel = [&](std::ptrdiff_t c) {
        return hn::LoadU(tag, block + c * block_pixels + i);
      };
      hn::StoreInterleaved4(channel(1), channel(2), channel(3), one - channel(0), tag, rgba);
    }
  }
}

int count_open(const Tile& tile) {
  int open = 0;
  for (const std::uint32_t row : tile.open) open += __builtin_popcount(row);
  return open;
}

}  // namespace
}  // namespace windsplat::engine::kernels
