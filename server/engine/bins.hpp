// RenderPlan -> Bins: bricks in visibility order, culled against the picture and by tolerance, and
// listed for every tile that they may touch.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/kernels/table.hpp"
#include "server/engine/left_out.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/summaries.hpp"
#include "server/engine/work.hpp"

namespace windsplat::engine {

struct Bins {
  int tiles_x = 0;
  int tiles_y = 0;
  std::vector<kernels::Brick> bricks;  // bricks with something to draw, front to back
  // Tile t (row by row) draws bricks[entries[e]] for e in [first[t], first[t + 1]), ascending.
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> entries;
  // Estimated cost of tile t in kernels: the kernels of each brick, divided among the tiles that
  // the brick may touch. 0 for a tile without bricks.
  std::vector<std::int64_t> load;
};

// Counts of some bricks for the work report.
struct BrickCounts {
  std::int64_t samples = 0;
  std::int64_t culled = 0;
  std::int64_t without_line = 0;
  std::int64_t without_splat = 0;
  std::int64_t without_both = 0;
  double left_out = 0;  // upper bound on the alphas skipped by tolerances, summed over pixels

  BrickCounts& operator+=(const BrickCounts& other);
};

// The regions of a row along u that are counted as a whole.
struct RegionRow {
  BrickCounts counts;
  std::vector<BlockRange> left_out;  // as in SheetBricks
};

// Bricks of one sheet of one pass.
struct SheetBricks {
  std::vector<kernels::Brick> bricks;
  std::vector<std::int32_t> kernels;  // lines and splats of each brick
  std::vector<BlockRange> left_out;   // where bricks may show what tolerances skipped
  BrickCounts counts;
};

// Sort key of the sheets of all passes, front to back: the sheet of the eye and those above it in
// ascending order, then those below it in descending order. Passes of different strides are
// interleaved by distance, lines first.
struct SheetKey {
  std::int64_t rank;  // place in visibility order; equal for sheets of one sample
  int pass;
  int sheet;
};

// Data shared by the bricks of a pass during one frame.
struct PassBins {
  PassSummaries* kept = nullptr;
  std::array<std::vector<int>, 3> in_order;  // kernel positions in lattice order
  kernels::Pass pass{};                      // the pass with these visit lists
  double longest = 0;                        // half the longest line that the style allows
  std::array<double, 3> reach{};             // extent of kernels with that line
  std::vector<std::uint8_t> done;            // per region of PassSummaries; 1: counted as a whole
};

// Storage of make_bins that the caller keeps between frames: further frames of the same kind
// allocate nothing.
struct BinSpace {
  Bins bins;
  SummaryCache summaries;
  std::vector<PassBins> passes;
  std::vector<SheetKey> sheets;
  std::vector<SheetBricks> found;  // per sheet
  TouchedBlocks touched;           // by what tolerances skipped
  std::vector<RegionRow> rows;     // of every pass
  struct DepthKey {
    float depth;
    std::uint32_t brick;
  };
  std::vector<DepthKey> by_depth;
  std::vector<kernels::Brick> sorted;
  std::vector<std::size_t> next;
};

// Adds samples, culled and skipped counts to the report. Returns space.bins, which is invalid after
// cancellation.
const Bins& make_bins(const RenderPlan& plan, const kernels::Table& table, ThreadPool& pool,
                      const CancelToken& cancel, BinSpace& space, WorkReport& work);

}  // namespace windsplat::engine
