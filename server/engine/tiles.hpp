// Bins -> finished tiles, drawn by the thread pool: each tile by one thread and its bricks in a
// fixed order, so that the picture does not depend on the number of threads.
#pragma once

#include "server/base/aligned_vector.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/bins.hpp"
#include "server/engine/layers/surfaces.hpp"
#include "server/engine/render.hpp"
#include "server/engine/sweep.hpp"

namespace windsplat::engine {

// Pixels of one worker, reused for every tile.
struct Workspace {
  AlignedVector<float> blocks;
  AlignedVector<float> rays;
  AlignedVector<float> rows;  // rows of a finished tile
  AlignedVector<kernels::BodyBlock> body;
  SurfaceSpace surfaces;
  SweepSpace sweep;
};

// Results of a tile for the work report.
struct TileWork {
  kernels::Counters counters{};
  bool drawn = false;
  bool stopped = false;
  bool closed_blocks = false;
};

// Storage of draw_tiles that the caller keeps between frames.
struct TileSpace {
  std::vector<std::uint32_t> order;
  std::vector<Workspace> workers;
  std::vector<TileWork> done;
};

// Delivers every pixel of a tile with bricks, the body or a surface to `sink` once and adds the
// counts to `work`. After cancellation the delivered pixels are invalid. surfaces: null, or those
// of the scene.
void draw_tiles(const RenderPlan& plan, const Bins& bins, const surface::Pixels* surfaces,
                const kernels::Table& table, ThreadPool& pool, const CancelToken& cancel,
                TileSpace& space, TileSink sink, WorkReport& work);

}  // namespace windsplat::engine
