// Bins -> finished tiles: they are drawn on the pool, each by one thread, its bricks always in the
// same order, so that the number of threads cannot change a bit of the picture.
#pragma once

#include "server/base/aligned_vector.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/bins.hpp"
#include "server/engine/render.hpp"
#include "server/engine/sweep.hpp"

namespace windsplat::engine {

// A worker's own pixels, used for one tile after the other.
struct Workspace {
  AlignedVector<float> blocks;
  AlignedVector<float> rays;
  AlignedVector<float> rows;  // of a finished tile
  SweepSpace sweep;
};

// What a tile tells the report.
struct TileWork {
  kernels::Counters counters{};
  bool stopped = false;
  bool closed_blocks = false;
};

// What draw_tiles needs and a caller keeps between frames.
struct TileSpace {
  std::vector<std::uint32_t> order;
  std::vector<Workspace> workers;
  std::vector<TileWork> done;
};

// Every pixel of a tile with a brick goes to `sink` once. Counts go to `work`. Cancelled, it
// returns early and what was delivered is worthless.
void draw_tiles(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                ThreadPool& pool, const CancelToken& cancel, TileSpace& space, TileSink sink,
                WorkReport& work);

}  // namespace windsplat::engine
