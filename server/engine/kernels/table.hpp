// The hot loops of one instruction set as a table of functions. They take plain data and cannot
// fail. Targets differ only by rounding: those without fused multiply-add round twice. No other
// includes; see frame_data.hpp.
#pragma once

#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine::kernels {

struct Table {
  const char* name;  // "portable", "sse4", "avx2" or "avx512"

  // Summarises the contents of a brick without samples below the tolerances.
  // scale: pixels per world unit at the nearest depth of the brick.
  void (*summarise)(const Pass& pass, const Brick& brick, float scale, BrickSummary& summary);

  // Composites the kernels of a brick into the open blocks of the tile, front to back.
  void (*draw)(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile);

  // The first half of draw: prepares the kernels that may touch open blocks of the tile.
  void (*prepare)(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                  Prepared& prepared);

  // The second half, for one kernel position with a line or a splat.
  void (*draw_prepared)(const Camera& camera, const Prepared& prepared, int position, Tile& tile);

  // Slab method: copies the splats of a brick to records. Returns their number, at most
  // brick_kernels.
  int (*pack_splats)(const Camera& camera, const Prepared& prepared, SplatRecord* out);

  // Copies the lines of a brick to records and lists their hits with open blocks of the tile, at
  // most hits_of_brick_max. Returns the number of lines. Line n becomes records[slots[n]] and has
  // the next counts[n] hits. slab_depth, in world units, scales the margin for rounding.
  int (*pack_lines)(const Camera& camera, const Prepared& prepared, float slab_depth,
                    const std::uint32_t* slots, const Tile& tile, RibbonRecord* records, Hit* hits,
                    int* counts);

  // Adds to each of slabs_ahead slabs the part of the splat that lies in it. The nearest slab is
  // slabs[first]; the others follow, modulo slabs_ahead.
  void (*gather)(const Camera& camera, const SplatRecord& record, Slab* slabs, int first,
                 Tile& tile);

  // Composites one open block of the slab: its accumulated medium with `count` lines, which must be
  // sorted by depth if there are more than met_lines_sorted_max. compositing: scene::Compositing.
  void (*close_slab)(const Camera& camera, int compositing, const Slab& slab,
                     const RibbonRecord* lines, const MetLine* met, int count, int block,
                     Tile& tile);

  // Prefetches the samples of a brick into the cache.
  void (*prefetch)(const Pass& pass, const Brick& brick);

  // The length of the ray of each pixel at forward component 1, in the block layout of the tile.
  void (*fill_rays)(const Camera& camera, const Tile& tile, float* rays);

  // The body at the pixels of a tile. Returns whether any pixel sees it. to.blocks must have room
  // for the blocks of a whole tile.
  bool (*open_body)(const Camera& camera, const Body& body, const Tile& tile, TileBody& to);

  // Adds the light of the body to the pixels that still wait for it.
  void (*close_body)(Tile& tile);

  // A row of pixels of the tile as linear premultiplied RGBA, 4 floats each, rounded up to a
  // multiple of block_side pixels.
  void (*copy_row)(const Tile& tile, int y, float* rgba);

  // Number of open blocks of the tile.
  int (*count_open)(const Tile& tile);

  // absorbed = -expm1(-tau) and transmitted = exp(-tau), tau in [0, inf], error about 1e-7.
  void (*attenuate)(int count, const float* tau, float* absorbed, float* transmitted);

  // The fraction of a splat before a point: see body_partial.hpp; r2 in [0, t^2], v in [-1, 1].
  void (*partial)(int count, const float* r2, const float* v, float* before);

  // Six random numbers in [0, 1) for the kernel at sample (i, j, k): the displacement of the kernel
  // along x, y, z, then that of the centre of its line (pcg3d, Jarzynski & Olano 2020).
  void (*jitter)(std::uint32_t seed, std::uint32_t epoch, int i, int j, int k, float* six);
};

const Table& portable_table();
const Table& sse4_table();
const Table& avx2_table();
const Table& avx512_table();
const Table& neon_table();

}  // namespace windsplat::engine::kernels
