// Fragments of pixels -> blocks of layers. In every pixel the body takes its place among them by
// depth; the first that is opaque becomes the body.
#include "server/engine/layers/surfaces.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace windsplat::engine {

namespace {

using kernels::block_pixels;
using kernels::block_side;
using kernels::BodyBlock;
using kernels::layers_max;
using kernels::tile_blocks;
using kernels::TileBody;
using surface::Fragment;

constexpr std::size_t blocks_of_layer = static_cast<std::size_t>(tile_blocks) * tile_blocks;
static_assert(surface::fragments_max == layers_max);

struct PixelInTile {
  int row, column;  // of the block in the tile
  int pixel;        // in the block
};

void clear_pixel(BodyBlock& block, int l) {
  block.depth[l] = kernels::body_nowhere;
  block.opacity[l] = 0;
  block.behind[l] = 1;
  for (int c = 0; c < 3; ++c) block.rgb[c][l] = block.light[c][l] = 0;
}

void set_pixel(const Fragment& from, double depth_origin, BodyBlock& block, int l) {
  block.depth[l] = static_cast<float>(from.depth - depth_origin);
  block.opacity[l] = from.opacity;
  block.behind[l] = 1.0F - from.opacity;
  for (int c = 0; c < 3; ++c) {
    block.rgb[c][l] = from.rgb[static_cast<std::size_t>(c)];
    block.light[c][l] = 0;
  }
}

// The block of a layer or of the body; without what it may hold from another tile.
BodyBlock& block_of(TileBody& body, int row, int column) {
  BodyBlock& block = body.blocks[row * tile_blocks + column];
  const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
  if ((body.seen[row] & bit) == 0) {
    body.seen[row] |= bit;
    for (int l = 0; l < block_pixels; ++l) clear_pixel(block, l);
  }
  return block;
}

// Nearest and farthest depths, and which blocks see a surface and are covered by it.
void finish_blocks(TileBody& body) {
  body.nearest = kernels::body_nowhere;
  for (int row = 0; row < tile_blocks; ++row) {
    body.opaque[row] = 0;
    for (std::uint32_t left = body.seen[row]; left != 0; left &= left - 1U) {
      const int column = std::countr_zero(left);
      const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
      BodyBlock& block = body.blocks[row * tile_blocks + column];
      block.nearest = kernels::body_nowhere;
      block.farthest = -kernels::body_nowhere;
      int covered = 0;
      for (int l = 0; l < block_pixels; ++l) {
        if (!(block.opacity[l] > 0)) continue;
        block.nearest = std::min(block.nearest, block.depth[l]);
        block.farthest = std::max(block.farthest, block.depth[l]);
        covered += block.opacity[l] >= 1 ? 1 : 0;
      }
      if (!(block.nearest < kernels::body_nowhere)) body.seen[row] &= ~bit;
      if (covered == block_pixels) body.opaque[row] |= bit;
      body.nearest = std::min(body.nearest, block.nearest);
    }
  }
}

class LayerSetter {
 public:
  LayerSetter(double depth_origin, SurfaceSpace& space, TileBody& body)
      : depth_origin_(depth_origin), space_(space), body_(body) {}

  void add(const PixelInTile& at, const Fragment* fragments, std::size_t count) {
    BodyBlock& body = block_of(body_, at.row, at.column);
    const int l = at.pixel;
    Fragment own{static_cast<double>(body.depth[l]) + depth_origin_,
                 body.opacity[l],
                 {body.rgb[0][l], body.rgb[1][l], body.rgb[2][l]}};
    bool waits = own.opacity > 0;
    clear_pixel(body, l);
    int layer = 0;
    const auto put = [&](const Fragment& from) {
      const bool opaque = from.opacity >= 1;
      if (!opaque && layer == layers_max) return false;
      set_pixel(from, depth_origin_, opaque ? body : block_in(layer++, at), l);
      return opaque;
    };
    for (std::size_t n = 0; n < count; ++n) {
      if (waits && own.depth <= fragments[n].depth) {
        waits = false;
        if (put(own)) return;
      }
      if (put(fragments[n])) return;
    }
    if (waits) put(own);
  }

  void finish_all(kernels::Tile& tile) {
    for (int n = 0; n < count_; ++n) {
      TileBody& layer = space_.layers.at(static_cast<std::size_t>(n));
      layer.blocks = space_.blocks.data() + static_cast<std::size_t>(n) * blocks_of_layer;
      finish_blocks(layer);
    }
    finish_blocks(body_);
    tile.body = &body_;
    tile.layer = space_.layers.data();
    tile.layers = count_;
  }

 private:
  BodyBlock& block_in(int n, const PixelInTile& at) {
    const auto index = static_cast<std::size_t>(n);
    if (space_.blocks.size() < (index + 1) * blocks_of_layer) {
      space_.blocks.resize((index + 1) * blocks_of_layer);
    }
    TileBody& layer = space_.layers.at(index);
    if (n == count_) {
      ++count_;
      layer = {};
    }
    layer.blocks = space_.blocks.data() + index * blocks_of_layer;
    return block_of(layer, at.row, at.column);
  }

  double depth_origin_;
  SurfaceSpace& space_;
  TileBody& body_;
  int count_ = 0;
};

}  // namespace

terrain::View surface_view(const scene::Camera& camera) {
  return {camera.eye,
          camera.right,
          -camera.up,
          camera.forward,
          2.0 * camera.half_height / camera.height,
          camera.near,
          camera.perspective};
}

void add_surfaces(const surface::Pixels& pixels, const kernels::Camera& camera, SurfaceSpace& space,
                  TileBody& body, kernels::Tile& tile) {
  constexpr int side = surface::cell_side;
  bool any = false;
  const auto each_cell = [&](const auto& visit) {
    for (int row = tile.y / side; row * side < tile.y + tile.height; ++row) {
      for (int column = tile.x / side; column * side < tile.x + tile.width; ++column) {
        if (pixels.any(column, row)) visit(column, row);
      }
    }
  };
  each_cell([&](int, int) { any = true; });
  if (!any) return;
  if (tile.body == nullptr) {
    std::fill(std::begin(body.seen), std::end(body.seen), 0U);
    std::fill(std::begin(body.opaque), std::end(body.opaque), 0U);
  }
  LayerSetter layers(camera.depth_origin, space, body);
  each_cell([&](int column, int row) {
    pixels.look(column, row, space.cell);
    const surface::Cell& cell = space.cell;
    for (int n = 0; n < side * side; ++n) {
      const auto index = static_cast<std::size_t>(n);
      const std::size_t first = cell.first.at(index);
      const std::size_t count = cell.first.at(index + 1) - first;
      const int x = column * side + n % side - tile.x;
      const int y = row * side + n / side - tile.y;
      if (count == 0 || x >= tile.width || y >= tile.height) continue;
      layers.add({y / block_side, x / block_side, y % block_side * block_side + x % block_side},
                 cell.fragments.data() + first, count);
    }
  });
  layers.finish_all(tile);
}

}  // namespace windsplat::engine
