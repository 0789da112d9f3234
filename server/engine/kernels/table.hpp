// The hot loops of one instruction set as a table of functions. They take plain data and cannot
// fail. Targets differ by roundings alone: those without fused multiply-add round twice. Plain
// includes only: see frame_data.hpp.
#pragma once

#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine::kernels {

struct Table {
  const char* name;  // "portable", "sse4", "avx2" or "avx512"

  // What a brick holds once samples below their tolerances are left out.
  // scale: pixels a world unit where the brick is nearest.
  void (*summarise)(const Pass& pass, const Brick& brick, float scale, BrickSummary& summary);

  // Composites a brick's kernels into the tile's blocks that are still open, front to back.
  void (*draw)(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile);

  // The first half of draw: what of the brick may touch the tile's open blocks.
  void (*prepare)(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                  Prepared& prepared);

  // The second half, for one stop that has a line or a splat.
  void (*draw_prepared)(const Camera& camera, const Prepared& prepared, int stop, Tile& tile);

  // The slab method: a brick's splats by themselves, at most brick_stops; how many.
  int (*pack_splats)(const Camera& camera, const Prepared& prepared, SplatRecord* out);

  // A brick's lines by themselves and their meetings with the tile's open blocks, at most
  // hits_of_brick_max; how many lines there are. The n-th becomes records[slots[n]] and has the
  // next counts[n] of the hits; slab_depth, world units, is what roundings are measured against.
  int (*pack_lines)(const Camera& camera, const Prepared& prepared, float slab_depth,
                    const std::uint32_t* slots, const Tile& tile, RibbonRecord* records, Hit* hits,
                    int* counts);

  // Adds to each of slabs_ahead slabs the part of the splat that lies in it. The nearest is
  // slabs[first], those behind it follow, modulo slabs_ahead.
  void (*gather)(const Camera& camera, const SplatRecord& record, Slab* slabs, int first,
                 Tile& tile);

  // Composites one open block of the slab: its gathered medium with `count` lines, in any order if
  // they are at most met_lines_sorted_max, else by their depths. compositing is scene::Compositing.
  void (*close_slab)(const Camera& camera, int compositing, const Slab& slab,
                     const RibbonRecord* lines, const MetLine* met, int count, int block,
                     Tile& tile);

  // Tells the processor that this brick's samples are wanted soon.
  void (*prefetch)(const Pass& pass, const Brick& brick);

  // The length of each pixel's ray whose forward component is 1, in blocks as the tile's are.
  void (*fill_rays)(const Camera& camera, const Tile& tile, float* rays);

  // A row of the tile's pixels as linear premultiplied RGBA, 4 floats each, up to a multiple of
  // block_side pixels.
  void (*copy_row)(const Tile& tile, int y, float* rgba);

  // How many of the tile's blocks are still open.
  int (*count_open)(const Tile& tile);

  // absorbed = -expm1(-tau) and transmitted = exp(-tau), tau in [0, inf], to about 1e-7.
  void (*attenuate)(int count, const float* tau, float* absorbed, float* transmitted);

  // Six numbers in [0, 1) for the stop at sample (i, j, k): how its kernel is moved along x, y, z,
  // then how its line's centre is (Jarzynski & Olano 2020: pcg3d).
  void (*jitter)(std::uint32_t seed, std::uint32_t epoch, int i, int j, int k, float* six);
};

const Table& portable_table();
const Table& sse4_table();
const Table& avx2_table();
const Table& avx512_table();

}  // namespace windsplat::engine::kernels
