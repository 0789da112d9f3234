// Projection and culling of bricks, and their lists by tile.
#include "server/engine/bins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "server/engine/flush_denormals.hpp"
#include "server/engine/places.hpp"
#include "server/engine/projector.hpp"
#include "server/engine/shadow.hpp"

namespace windsplat::engine {

namespace {

using kernels::Brick;
using kernels::Pass;

// Index of the first kernel position of the brick that contains a position.
int brick_start(int index) { return index / kernels::brick_side * kernels::brick_side; }

// Curved lattices: the bounding box of the actual kernel positions.
Box curved_box(const Pass& pass, const Brick& brick) {
  Box box;
  box.low.fill(1e300);
  box.high.fill(-1e300);
  all_places(pass, brick, [&](const float* position) {
    for (int c = 0; c < 3; ++c) {
      box.low[c] = std::min<double>(box.low[c], position[c]);
      box.high[c] = std::max<double>(box.high[c], position[c]);
    }
    return true;
  });
  return box;
}

// Bounding box of the kernel positions of a brick.
Box positions_box(const PassPlan& plan, const Brick& brick) {
  const Pass& pass = plan.kernel;
  if (pass.places != nullptr) return curved_box(pass, brick);
  Box box;
  const auto extend = [&](int a, int first, int count) {
    const AxisArrays& axis = plan.axis[a];
    const int low = count > 1 ? brick_start(axis.visit[first]) : axis.visit[first];
    box.low[a] = axis.position[low];
    box.high[a] = axis.position[low + count - 1];
  };
  extend(pass.major, brick.sheet, 1);
  extend(pass.u, brick.u_first, brick.u_count);
  extend(pass.v, brick.v_first, brick.v_count);
  return box;
}

// Extent of kernels beyond their positions along each world axis.
std::array<double, 3> kernel_reach(const Pass& pass, double line_reach, bool splats) {
  std::array<double, 3> reach{};
  for (int a = 0; a < 3; ++a) {
    const double cell = pass.cell_max[a];
    const double moved = pass.line.shift[a] * cell;
    // Lines are clipped to the boxes of their kernels.
    const double inside = std::min<double>(line_reach, pass.line.half_box[a] * cell);
    const double line = pass.has_lines != 0 && line_reach >= 0 ? inside + moved : 0;
    const double splat = splats ? kernels::footprint_radius * cell : 0;
    reach[a] = std::max(line, splat) * 1.0001;
  }
  return reach;
}

void set_blocks(const Rectangle& r, const kernels::Camera& camera, Brick& brick) {
  const BlockRange blocks = block_range(r, camera);
  brick.block_x = blocks.x;
  brick.block_x_last = blocks.x_last;
  brick.block_y = blocks.y;
  brick.block_y_last = blocks.y_last;
}

// Selects the bricks that a frame draws.
class Binner {
 public:
  Binner(const RenderPlan& plan, const kernels::Table& table, BinSpace& space)
      : plan_(plan), table_(table), space_(space), project_(plan), shadow_(plan) {}

  void begin() {
    const std::size_t count = plan_.passes.size();
    if (space_.passes.size() < count) space_.passes.resize(count);
    space_.summaries.begin_frame();
    for (std::size_t p = 0; p < count; ++p) {
      begin_pass(plan_.passes[p], space_.passes[p]);
    }
    order_sheets();
  }

  // Counts the regions of a row along u whose bricks need no individual test: entirely visible
  // without anything to draw, or entirely invisible.
  [[nodiscard]] std::size_t rows() const {
    std::size_t sum = 0;
    for (std::size_t p = 0; p < plan_.passes.size(); ++p) sum += rows_of(p);
    return sum;
  }
  void count_regions(std::size_t row, RegionRow& out);

  void add_sheet(const SheetKey& key, SheetBricks& out);

 private:
  void begin_pass(const PassPlan& pass, PassBins& to);
  void order_sheets();
  void add_brick(const PassPlan& pass, PassBins& shared, const Brick& brick, SheetBricks& out);
  void read_summary(const PassPlan& pass, const PassBins& shared, const Brick& brick,
                    KeptSummary& kept);
  // Reads the summaries of a region until a brick has something to draw. Returns whether none has,
  // with what tolerances left out of all.
  bool draws_nothing(const PassBins& shared, const LatticeRange& region, LeftOut& left_out);
  [[nodiscard]] std::size_t rows_of(std::size_t p) const {
    if (plan_.passes[p].kernel.places != nullptr) return 0;
    const PassSummaries& kept = *space_.passes[p].kept;
    return static_cast<std::size_t>(kept.regions) * kept.v_bricks;
  }

  const RenderPlan& plan_;
  const kernels::Table& table_;
  BinSpace& space_;
  const Projector project_;
  const Shadow shadow_;
};

void Binner::begin_pass(const PassPlan& pass, PassBins& to) {
  to.kept = &space_.summaries.of(pass, table_);
  to.pass = pass.kernel;
  for (int a = 0; a < 3; ++a) {
    to.in_order[a].resize(pass.axis[a].visit.size());
    std::iota(to.in_order[a].begin(), to.in_order[a].end(), 0);
    to.pass.axis[a].visit = to.in_order[a].data();
  }
  to.longest = pass.kernel.has_lines != 0 ? 0.5 * pass.kernel.line.length : -1;
  to.reach = kernel_reach(pass.kernel, to.longest, pass.kernel.has_medium != 0);
  to.done.assign(to.kept->blank_regions.size(), 0);
}

// Rank of a sheet `ahead` samples from that of the eye. No ray from the eye crosses cells on both
// sides of its own, so all sheets above may precede those below. But kernels are wider than cells:
// around an eye within the box some reach across it, so nearer sheets come first, and of two
// equally near ones that behind the eye.
std::int64_t rank_of(const RenderPlan& plan, int axis, int ahead) {
  const std::int64_t distance = std::abs(ahead);
  if (!plan.eye_inside) return ahead >= 0 ? distance : distance + (std::int64_t{1} << 32U);
  const bool behind = plan.view->forward[axis] >= 0 ? ahead < 0 : ahead > 0;
  return 2 * distance + (behind ? 0 : 1);
}

void Binner::order_sheets() {
  std::vector<SheetKey>& keys = space_.sheets;
  keys.clear();
  for (int p = 0; p < static_cast<int>(plan_.passes.size()); ++p) {
    const PassPlan& pass = plan_.passes[p];
    const AxisArrays& axis = pass.axis[pass.kernel.major];
    for (int s = 0; s < static_cast<int>(axis.visit.size()); ++s) {
      const int ahead = axis.sample[axis.visit[s]] - plan_.eye_sample;
      keys.push_back({rank_of(plan_, pass.kernel.major, ahead), p, s});
    }
  }
  // Keys are unique, so the order is deterministic.
  std::sort(keys.begin(), keys.end(), [](const SheetKey& a, const SheetKey& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.pass < b.pass;
  });
}

// Whether a region is counted as a whole depends on its contents and place alone, not on what
// earlier frames read, so that every frame has the same bound.
bool Binner::draws_nothing(const PassBins& shared, const LatticeRange& region, LeftOut& left_out) {
  const Pass& pass = shared.pass;
  Brick brick{};
  brick.u_first = region.first[pass.u];
  brick.u_count = region.count[pass.u];
  brick.v_first = region.first[pass.v];
  brick.v_count = region.count[pass.v];
  const int first = region.first[pass.major];
  for (int layer = first; layer < first + region.count[pass.major]; ++layer) {
    KeptSummary& kept = shared.kept->bricks[shared.kept->brick(
        layer, brick.v_first / kernels::brick_side, brick.u_first / kernels::brick_side)];
    brick.sheet = layer;
    if (!kept.known()) kept = summarise(table_, pass, brick);
    if (kept.holds_any()) return false;
    left_out.add(kept);
  }
  return true;
}

void Binner::count_regions(std::size_t row, RegionRow& out) {
  BrickCounts& counts = out.counts;
  std::size_t p = 0;
  for (; row >= rows_of(p); ++p) row -= rows_of(p);
  const PassPlan& pass = plan_.passes[p];
  const Pass& kernel = pass.kernel;
  PassBins& shared = space_.passes[p];
  PassSummaries& kept = *shared.kept;
  const int layer = static_cast<int>(row / kept.v_bricks);
  const int v = static_cast<int>(row % kept.v_bricks);
  Box box;
  LatticeRange bounds;
  const auto extend = [&](int a, int brick) {
    const int first = brick * kernels::brick_side;
    const int last = std::min(first + kernels::brick_side, kernel.axis[a].count);
    box.low[a] = pass.axis[a].position[first];
    box.high[a] = pass.axis[a].position[last - 1];
    bounds.first[a] = first;
    bounds.count[a] = last - first;
  };
  extend(kernel.major, layer);
  extend(kernel.v, v);
  for (int u = 0; u < kept.u_bricks; ++u) {
    extend(kernel.u, u);
    const std::int64_t positions = bounds.positions();
    const std::size_t region = kept.region(layer * kernels::brick_side, v, u);
    if (kept.is_left_out(layer * kernels::brick_side, v, u)) {
      shared.done[region] = 1;
      counts.samples += positions;
      counts.culled += positions;
      continue;
    }
    const bool blank = kept.blank_regions[region] != 0 || kept.find_blank(layer, v, u);
    const Projected found = project_(pass, box, shared.reach);
    const bool unseen = found.seen.empty();
    LeftOut left_out;
    const bool empty = blank || (!unseen && found.whole && draws_nothing(shared, bounds, left_out));
    if (!unseen && !(empty && found.whole)) continue;
    shared.done[region] = 1;
    counts.samples += positions;
    if (unseen) {
      counts.culled += positions;
      continue;
    }
    if (left_out.lines > 0 || left_out.medium > 0) {
      add_left_out(plan_, pass, widest_cells(kernel, bounds), left_out, found, counts.left_out,
                   out.left_out);
    }
    if (kernel.has_lines != 0) counts.without_line += positions;
    if (kernel.has_medium != 0) counts.without_splat += positions;
    counts.without_both += positions;
  }
}

// The same brick with indices in lattice order instead of visit order.
Brick in_lattice(const PassPlan& pass, const Brick& brick) {
  const Pass& kernel = pass.kernel;
  Brick in_lattice = brick;
  in_lattice.sheet = pass.axis[kernel.major].visit[brick.sheet];
  in_lattice.u_first = brick_start(pass.axis[kernel.u].visit[brick.u_first]);
  in_lattice.v_first = brick_start(pass.axis[kernel.v].visit[brick.v_first]);
  return in_lattice;
}

LatticeRange range_of(const PassPlan& pass, const Brick& brick) {
  const Brick own = in_lattice(pass, brick);
  LatticeRange region;
  const auto set = [&](int a, int first, int count) {
    region.first[a] = first;
    region.count[a] = count;
  };
  set(pass.kernel.major, own.sheet, 1);
  set(pass.kernel.u, own.u_first, own.u_count);
  set(pass.kernel.v, own.v_first, own.v_count);
  return region;
}

KeptSummary& summary_at(const PassPlan& pass, PassBins& shared, const Brick& brick) {
  const Brick own = in_lattice(pass, brick);
  return shared.kept->bricks[shared.kept->brick(own.sheet, own.v_first / kernels::brick_side,
                                                own.u_first / kernels::brick_side)];
}

// Half the longest line of a brick in world units; negative if it has none.
double line_reach(const Pass& pass, const PassBins& shared, const KeptSummary& kept) {
  if (kept.lines == 0) return -1;
  const double part = std::min(1.0F, kept.magnitude_max * pass.line.inverse_full_magnitude);
  return shared.longest * part * 1.00001;
}

std::array<double, 3> reach_of(const Pass& pass, const PassBins& shared, const KeptSummary& kept) {
  return kernel_reach(pass, line_reach(pass, shared, kept), kept.splats > 0);
}

// Reads in lattice order, so that floating-point sums do not depend on the camera of the first
// frame.
void Binner::read_summary(const PassPlan& pass, const PassBins& shared, const Brick& brick,
                          KeptSummary& kept) {
  kept = summarise(table_, shared.pass, in_lattice(pass, brick));
}

void Binner::add_brick(const PassPlan& pass, PassBins& shared, const Brick& from,
                       SheetBricks& out) {
  Brick brick = from;
  const std::int64_t positions = static_cast<std::int64_t>(brick.u_count) * brick.v_count;
  const Box box = positions_box(pass, brick);
  out.counts.samples += positions;
  if (shadow_.hides(pass, from, shared.longest, pass.kernel.has_medium != 0)) {
    out.counts.culled += positions;
    return;
  }
  // A brick without summary is first culled by the longest line that the style allows, before any
  // sample is read; one with a summary by its actual contents.
  KeptSummary& kept = summary_at(pass, shared, brick);
  const bool known = kept.known() && !kept.left_out_any() && kept.holds_any();
  Projected found;
  if (known) found = project_(pass, box, reach_of(pass.kernel, shared, kept));
  if (!known || found.seen.empty()) {
    const Projected most = project_(pass, box, shared.reach);
    if (most.seen.empty()) {
      out.counts.culled += positions;
      return;
    }
    if (!kept.known()) read_summary(pass, shared, brick, kept);
    if (kept.left_out_any()) {
      LeftOut left_out;
      left_out.add(kept);
      const auto edges = widest_cells(pass.kernel, range_of(pass, brick));
      add_left_out(plan_, pass, edges, left_out, most, out.counts.left_out, out.left_out);
    }
    if (!known && kept.holds_any())
      found = project_(pass, box, reach_of(pass.kernel, shared, kept));
  }
  if (pass.kernel.has_lines != 0) out.counts.without_line += positions - kept.lines;
  if (pass.kernel.has_medium != 0) out.counts.without_splat += positions - kept.splats;
  out.counts.without_both += kept.without_both;
  if (!kept.holds_any() || found.seen.empty()) return;
  if (shadow_.hides(pass, from, line_reach(pass.kernel, shared, kept), kept.splats > 0)) return;
  brick.lines = kept.lines;
  brick.splats = kept.splats;
  brick.line_reach = static_cast<float>(std::max(line_reach(pass.kernel, shared, kept), 0.0));
  set_blocks(found.seen, plan_.camera, brick);
  brick.depth_first = static_cast<float>(found.depth_first - plan_.camera.depth_origin);
  brick.depth_last = static_cast<float>(found.depth_last - plan_.camera.depth_origin);
  out.bricks.push_back(brick);
  out.kernels.push_back(kept.lines + kept.splats);
}

void Binner::add_sheet(const SheetKey& key, SheetBricks& out) {
  const PassPlan& pass = plan_.passes[key.pass];
  const Pass& kernel = pass.kernel;
  PassBins& shared = space_.passes[key.pass];
  out.bricks.clear();
  out.kernels.clear();
  out.left_out.clear();
  out.counts = {};
  const int layer = pass.axis[kernel.major].visit[key.sheet];
  const AxisArrays& along_u = pass.axis[kernel.u];
  const AxisArrays& along_v = pass.axis[kernel.v];
  for (const auto& v : along_v.bricks) {
    const int v_brick = along_v.visit[v[0]] / kernels::brick_side;
    for (const auto& u : along_u.bricks) {
      const int u_brick = along_u.visit[u[0]] / kernels::brick_side;
      if (shared.done[shared.kept->region(layer, v_brick, u_brick)] != 0) continue;
      Brick brick{};
      brick.pass = key.pass;
      brick.sheet = key.sheet;
      brick.u_first = u[0];
      brick.u_count = u[1];
      brick.v_first = v[0];
      brick.v_count = v[1];
      add_brick(pass, shared, brick, out);
    }
  }
}

// Range of the tiles that a brick may touch, both ends included.
struct TileRange {
  int x0, x1, y0, y1;
};

TileRange tiles_of(const RenderPlan& plan, const Brick& brick) {
  const int side = plan.tile_pixels / kernels::block_side;
  return {brick.block_x / side, brick.block_x_last / side, brick.block_y / side,
          brick.block_y_last / side};
}

template <class Visit>
void each_tile(const Bins& bins, const TileRange& range, const Visit& visit) {
  for (int y = range.y0; y <= range.y1; ++y) {
    for (int x = range.x0; x <= range.x1; ++x) {
      visit(static_cast<std::size_t>(y) * bins.tiles_x + x);
    }
  }
}

// The lists are invalid after cancellation.
void list_by_tile(const RenderPlan& plan, const CancelToken& cancel, BinSpace& space) {
  constexpr std::size_t bricks_between_checks = 1024;
  Bins& bins = space.bins;
  const std::size_t tiles = static_cast<std::size_t>(bins.tiles_x) * bins.tiles_y;
  bins.first.assign(tiles + 1, 0);
  for (const Brick& brick : bins.bricks) {
    each_tile(bins, tiles_of(plan, brick), [&](std::size_t tile) { ++bins.first[tile + 1]; });
  }
  for (std::size_t t = 0; t < tiles; ++t) bins.first[t + 1] += bins.first[t];
  bins.entries.resize(bins.first[tiles]);
  space.next.assign(bins.first.begin(), bins.first.end() - 1);
  for (std::size_t b = 0; b < bins.bricks.size(); ++b) {
    if (b % bricks_between_checks == 0 && cancel.cancelled()) return;
    each_tile(bins, tiles_of(plan, bins.bricks[b]), [&](std::size_t tile) {
      bins.entries[space.next[tile]++] = static_cast<std::uint32_t>(b);
    });
  }
}

void add_load(const RenderPlan& plan, Bins& bins, const SheetBricks& sheet) {
  constexpr std::int64_t brick_overhead = 8;  // number of kernels
  for (std::size_t b = 0; b < sheet.bricks.size(); ++b) {
    const Brick& brick = sheet.bricks[b];
    const TileRange range = tiles_of(plan, brick);
    const std::int64_t tiles = std::int64_t{range.x1 - range.x0 + 1} * (range.y1 - range.y0 + 1);
    const std::int64_t load = brick_overhead + sheet.kernels[b] / tiles;
    each_tile(bins, range, [&](std::size_t tile) { bins.load[tile] += load; });
  }
}

// Sorts bricks by their first depth; equal depths keep their order.
void sort_by_depth(BinSpace& space) {
  std::vector<Brick>& bricks = space.bins.bricks;
  space.by_depth.resize(bricks.size());
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    space.by_depth[b] = {bricks[b].depth_first, static_cast<std::uint32_t>(b)};
  }
  std::sort(space.by_depth.begin(), space.by_depth.end(), [](const auto& a, const auto& b) {
    return a.depth != b.depth ? a.depth < b.depth : a.brick < b.brick;
  });
  space.sorted.clear();
  for (const auto& key : space.by_depth) space.sorted.push_back(bricks[key.brick]);
  bricks.swap(space.sorted);
}

}  // namespace

BrickCounts& BrickCounts::operator+=(const BrickCounts& other) {
  samples += other.samples;
  culled += other.culled;
  without_line += other.without_line;
  without_splat += other.without_splat;
  without_both += other.without_both;
  left_out += other.left_out;
  return *this;
}

const Bins& make_bins(const RenderPlan& plan, const kernels::Table& table, ThreadPool& pool,
                      const CancelToken& cancel, BinSpace& space, WorkReport& work) {
  Bins& bins = space.bins;
  bins.tiles_x = (plan.camera.width + plan.tile_pixels - 1) / plan.tile_pixels;
  bins.tiles_y = (plan.camera.height + plan.tile_pixels - 1) / plan.tile_pixels;
  bins.bricks.clear();
  bins.load.assign(static_cast<std::size_t>(bins.tiles_x) * bins.tiles_y, 0);
  Binner binner(plan, table, space);
  binner.begin();
  const std::size_t rows = binner.rows();
  if (space.rows.size() < rows) space.rows.resize(rows);
  pool.run(rows, [&](std::size_t row, unsigned) {
    space.rows[row].counts = {};
    space.rows[row].left_out.clear();
    const FlushDenormals flush;
    if (!cancel.cancelled()) binner.count_regions(row, space.rows[row]);
  });
  const std::size_t sheets = space.sheets.size();
  if (space.found.size() < sheets) space.found.resize(sheets);
  pool.run(sheets, [&](std::size_t i, unsigned) {
    if (cancel.cancelled()) return;
    const FlushDenormals flush;
    binner.add_sheet(space.sheets[i], space.found[i]);
  });
  if (cancel.cancelled()) return bins;
  BrickCounts sum;
  space.touched.begin(plan.camera);
  for (std::size_t row = 0; row < rows; ++row) {
    sum += space.rows[row].counts;
    for (const BlockRange& range : space.rows[row].left_out) space.touched.add(range);
  }
  for (std::size_t i = 0; i < sheets && !cancel.cancelled(); ++i) {
    const SheetBricks& sheet = space.found[i];
    bins.bricks.insert(bins.bricks.end(), sheet.bricks.begin(), sheet.bricks.end());
    add_load(plan, bins, sheet);
    sum += sheet.counts;
    for (const BlockRange& range : sheet.left_out) space.touched.add(range);
  }
  work.samples += sum.samples;
  work.culled += sum.culled;
  work.skipped_vector += sum.without_line;
  work.skipped_scalar += sum.without_splat;
  work.skipped_both += sum.without_both;
  const double pixels = static_cast<double>(plan.camera.width) * plan.camera.height;
  work.skipped_bound =
      std::min(sum.left_out, static_cast<double>(space.touched.pixels(plan.camera))) / pixels;
  if (plan.slabs || plan.curved) sort_by_depth(space);
  if (!cancel.cancelled()) list_by_tile(plan, cancel, space);
  return bins;
}

}  // namespace windsplat::engine
