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

  // The slab method: a brick's splats and lines by themselves, at most brick_stops of each; how
  // many.
  int (*pack_splats)(const Camera& camera, const Prepared& prepared, SplatRecord* out);
  int (*pack_ribbons)(const Prepared& prepared, RibbonRecord* out);

  // Adds the part of the splat that lies in the slab.
  void (*gather)(const Camera& camera, const SplatRecord& record, Slab& slab, Tile& tile);

  // Lists the blocks that the line may touch within the slab; how many. Room for hits_of_line_max.
  int (*list_hits)(const Camera& camera, const RibbonRecord& line, const Slab& slab,
                   const Tile& tile, Hit* hits);

  // Composites one block of the slab: its gathered medium with `count` lines, nearest first.
  // compositing is scene::Compositing.
  void (*close_slab)(const Camera& camera, int compositing, const Slab& slab, const Hit* hits,
                     int count, int block, Tile& tile);

  // Tells the processor that this brick's samples are wanted soon.
  void (*prefetch)(const Pass& pass, const Brick& brick);

  // The length of each pixel's ray whose forward component is 1, in blocks as the tile's are.
  void (*fill_rays)(const Camera& camera, const Tile& tile, float* rays);

  // How many of the tile's blocks are still open.
  int (*count_open)(const Tile& tile);

  // The slab method: closes the blocks that let no more than the tile's stop through; how many
  // remain open.
  int (*refresh_open)(Tile& tile);

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
