// RenderPlan -> Bins: bricks in visibility order, culled against the picture, emptied of what is
// below tolerance, and listed for every tile that they may touch.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/kernels/table.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/work.hpp"

namespace windsplat::engine {

struct Bins {
  int tiles_x = 0;
  int tiles_y = 0;
  std::vector<kernels::Brick> bricks;  // that have something to draw, front to back
  // Tile t (row by row) draws bricks[entries[e]] for e in [first[t], first[t + 1]), ascending.
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> entries;
};

// Adds samples, culled and skipped counts to the report. An empty answer if cancelled.
Bins make_bins(const RenderPlan& plan, const kernels::Table& table, ThreadPool& pool,
               const CancelToken& cancel, WorkReport& work);

}  // namespace windsplat::engine
