// RenderPlan -> Bins: bricks in visibility order, culled against the picture, emptied of what is
// below tolerance, and listed for every tile that they may touch.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/kernels/table.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/summaries.hpp"
#include "server/engine/work.hpp"

namespace windsplat::engine {

struct Bins {
  int tiles_x = 0;
  int tiles_y = 0;
  std::vector<kernels::Brick> bricks;  // that have something to draw, front to back
  // Tile t (row by row) draws bricks[entries[e]] for e in [first[t], first[t + 1]), ascending.
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> entries;
  // About how long tile t takes, in kernels: what its bricks draw, shared among the tiles that each
  // may touch. Nought where there is no brick.
  std::vector<std::int64_t> load;
};

// Some bricks' share of the report.
struct BrickCounts {
  std::int64_t samples = 0;
  std::int64_t culled = 0;
  std::int64_t without_line = 0;
  std::int64_t without_splat = 0;
  std::int64_t without_both = 0;
  double left_out = 0;  // alphas of what tolerances left out, summed over pixels, at most

  BrickCounts& operator+=(const BrickCounts& other);
};

// Bricks of one slab of one pass.
struct SlabBricks {
  std::vector<kernels::Brick> bricks;
  std::vector<std::int32_t> kernels;  // of each: lines and splats
  BrickCounts counts;
};

// Slabs of all passes front to back: the eye's own and those above it upward, then those below it
// downward. Passes of different strides are interleaved by distance, lines first.
struct SlabKey {
  int side;      // 0 upward, 1 downward
  int distance;  // samples from the eye's
  int pass;
  int slab;
};

// What a pass' bricks share in one frame.
struct PassBins {
  PassSummaries* kept = nullptr;
  std::array<std::vector<int>, 3> in_order;  // stops as they stand in the lattice
  kernels::Pass pass{};                      // that visits them so
  double longest = 0;                        // half the longest line that the style allows
  std::array<double, 3> reach{};             // of kernels with that line
  std::vector<std::uint8_t> done;  // of PassSummaries' regions: 1, counted whole in this frame
};

// What make_bins needs and a caller keeps between frames: nothing is allocated once frames of the
// same kind have been made.
struct BinSpace {
  Bins bins;
  SummaryCache summaries;
  std::vector<PassBins> passes;
  std::vector<SlabKey> slabs;
  std::vector<SlabBricks> found;  // of each slab
  std::vector<BrickCounts> rows;  // of the regions done, by row
  struct Place {
    float depth;
    std::uint32_t brick;
  };
  std::vector<Place> by_depth;
  std::vector<kernels::Brick> sorted;
  std::vector<std::size_t> next;
};

// Adds samples, culled and skipped counts to the report. The answer is space.bins; worthless if
// cancelled.
const Bins& make_bins(const RenderPlan& plan, const kernels::Table& table, ThreadPool& pool,
                      const CancelToken& cancel, BinSpace& space, WorkReport& work);

}  // namespace windsplat::engine
