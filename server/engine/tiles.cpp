// Scheduling, drawing and delivery of tiles.
#include "server/engine/tiles.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

#include "server/engine/flush_denormals.hpp"

namespace windsplat::engine {

namespace {

using kernels::block_floats;
using kernels::block_pixels;
using kernels::block_side;
using kernels::Brick;
using kernels::Tile;
using kernels::tile_blocks;

constexpr std::size_t blocks_of_tile = static_cast<std::size_t>(tile_blocks) * tile_blocks;
constexpr std::size_t row_floats = std::size_t{4} * kernels::tile_side;
constexpr int rows_delivered = 8;  // number of rows per call of the sink; even

// Reserves the storage of every worker, including those that draw no tile this time.
void make_room(const RenderPlan& plan, bool surfaces, std::vector<Workspace>& spaces) {
  for (Workspace& space : spaces) {
    space.blocks.resize(blocks_of_tile * block_floats);
    space.rows.resize(row_floats * rows_delivered);
    if (plan.perspective_medium) space.rays.resize(blocks_of_tile * block_pixels);
    if (surfaces || plan.body.shape != kernels::body_none) space.body.resize(blocks_of_tile);
  }
}

// Blocks along a tile's width or height.
int blocks_along(int pixels) { return (pixels + block_side - 1) / block_side; }

// Sets the pixels of a row of blocks to transparent black (transmittance 1).
void clear_row(float* blocks, int count) {
  std::fill_n(blocks, static_cast<std::ptrdiff_t>(count) * block_floats, 0.0F);
  for (int b = 0; b < count; ++b) {
    std::fill_n(blocks + static_cast<std::ptrdiff_t>(b) * block_floats, block_pixels, 1.0F);
  }
}

void open_tile(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
               std::size_t index, Workspace& space, Tile& tile) {
  const int tx = static_cast<int>(index) % bins.tiles_x;
  const int ty = static_cast<int>(index) / bins.tiles_x;
  tile.x = tx * plan.tile_pixels;
  tile.y = ty * plan.tile_pixels;
  tile.width = std::min(plan.tile_pixels, plan.camera.width - tile.x);
  tile.height = std::min(plan.tile_pixels, plan.camera.height - tile.y);
  tile.blocks = space.blocks.data();
  tile.rays = space.rays.data();
  tile.stop = plan.stop_transmittance;
  std::fill(std::begin(tile.open), std::end(tile.open), 0U);
  const int columns = blocks_along(tile.width);
  for (int row = 0; row < blocks_along(tile.height); ++row) {
    const std::ptrdiff_t first = std::ptrdiff_t{row} * tile_blocks;
    clear_row(tile.blocks + first * block_floats, columns);
    tile.open[row] = (2U << static_cast<unsigned>(columns - 1)) - 1U;
  }
  if (plan.perspective_medium) table.fill_rays(plan.camera, tile, space.rays.data());
}

std::int64_t positions_of(const Brick& brick) {
  return static_cast<std::int64_t>(brick.u_count) * brick.v_count;
}

// Iterates over the bricks of a tile in order, skipping those that touch closed blocks only.
// or_lines: only those with lines that are combined by `or`; otherwise only the others.
class OpenBricks {
 public:
  OpenBricks(const RenderPlan& plan, const Bins& bins, bool or_lines, std::size_t index, Tile& tile)
      : plan_(plan),
        bins_(bins),
        or_lines_(or_lines),
        tile_(tile),
        at_(bins.first[index]),
        last_(bins.first[index + 1]) {}

  const Brick* next() {
    while (at_ < last_) {
      const Brick& brick = bins_.bricks[bins_.entries[at_++]];
      if (has_or_lines(plan_, brick) != or_lines_) continue;
      if (!all_closed(tile_, brick)) return &brick;
      tile_.counters.occluded += positions_of(brick);
    }
    return nullptr;
  }

 private:
  const RenderPlan& plan_;
  const Bins& bins_;
  const bool or_lines_;
  Tile& tile_;
  std::size_t at_;
  std::size_t last_;
};

void draw_bricks(const RenderPlan& plan, const Bins& bins, bool or_lines,
                 const kernels::Table& table, const CancelToken& cancel, std::size_t index,
                 Tile& tile) {
  constexpr std::size_t bricks_between_checks = 16;
  OpenBricks bricks(plan, bins, or_lines, index, tile);
  const Brick* next = bricks.next();
  for (std::size_t drawn = 1; next != nullptr; ++drawn) {
    if (drawn % bricks_between_checks == 0 && cancel.cancelled()) return;
    const Brick& brick = *next;
    next = bricks.next();
    if (next != nullptr) table.prefetch(plan.passes[next->pass].kernel, *next);
    table.draw(plan.camera, plan.passes[brick.pass].kernel, brick, tile);
  }
}

// In any order. Opaque lines close no block, since others may add to their colour.
void draw_or_lines(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                   const CancelToken& cancel, std::size_t index, Tile& tile) {
  tile.stop = -1;
  draw_bricks(plan, bins, true, table, cancel, index, tile);
  tile.stop = plan.stop_transmittance;
}

// Converts blocks to rows, a few at a time, so that they are still in the cache when the sink reads
// them.
void deliver_tile(const kernels::Table& table, const Tile& tile, AlignedVector<float>& rows,
                  TileSink sink) {
  for (int y = 0; y < tile.height; y += rows_delivered) {
    const int count = std::min(rows_delivered, tile.height - y);
    for (int row = 0; row < count; ++row) {
      table.copy_row(tile, y + row, rows.data() + static_cast<std::size_t>(row) * row_floats);
    }
    sink({tile.x, tile.y + y, tile.width, count, rows.data(), row_floats});
  }
}

bool has_bricks(const Bins& bins, std::size_t tile) {
  return bins.first[tile + 1] > bins.first[tile];
}

// Tiles with bricks, most expensive first, so that the frame does not end with one long tile; in a
// scene with a body or surfaces all tiles.
void busy_tiles(bool all, const Bins& bins, std::vector<std::uint32_t>& order) {
  order.clear();
  for (std::size_t t = 0; t + 1 < bins.first.size(); ++t) {
    if (all || has_bricks(bins, t)) order.push_back(static_cast<std::uint32_t>(t));
  }
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return bins.load[a] != bins.load[b] ? bins.load[a] > bins.load[b] : a < b;
  });
}

// Grows the storage of every worker to that of the largest. Which worker draws the largest tile
// depends on timing; without this, later frames of the same kind could still allocate.
void level(std::vector<Workspace>& spaces) {
  if (spaces.size() < 2) return;
  const auto each = [&](const auto& member) {
    std::size_t most = 0;
    for (Workspace& space : spaces) most = std::max(most, member(space.sweep).capacity());
    for (Workspace& space : spaces) member(space.sweep).reserve(most);
  };
  each_vector(each);
  std::size_t layers = 0;
  for (const Workspace& space : spaces) layers = std::max(layers, space.surfaces.blocks.size());
  for (Workspace& space : spaces) space.surfaces.blocks.resize(layers);
  std::size_t slots = 0;
  bool prepared = false;
  for (const Workspace& space : spaces) {
    slots = std::max(slots, space.sweep.slots.size());
    prepared = prepared || space.sweep.prepared;
  }
  for (Workspace& space : spaces) {
    if (prepared && !space.sweep.prepared) {
      space.sweep.prepared = std::make_unique<kernels::Prepared>();
    }
    while (space.sweep.slots.size() < slots) {
      space.sweep.slots.push_back(std::make_unique<kernels::Prepared>());
    }
  }
}

}  // namespace

namespace {

// Whether the body hides everything from `depth` on in the blocks of a row.
bool body_hides(const kernels::TileBody& body, int row, std::uint32_t columns, float depth) {
  if ((columns & ~body.opaque[row]) != 0) return false;
  for (; columns != 0; columns &= columns - 1U) {
    const int column = std::countr_zero(columns);
    if (body.blocks[row * tile_blocks + column].farthest > depth) return false;
  }
  return true;
}

}  // namespace

bool all_closed(const Tile& tile, const Brick& brick) {
  if (tile.any_closed == 0 && tile.body == nullptr) return false;
  const int bx = tile.x / block_side;
  const int by = tile.y / block_side;
  const int x0 = std::max(brick.block_x - bx, 0);
  const int x1 = std::min(brick.block_x_last - bx, (tile.width - 1) / block_side);
  const int y0 = std::max(brick.block_y - by, 0);
  const int y1 = std::min(brick.block_y_last - by, (tile.height - 1) / block_side);
  const std::uint32_t columns = ((2U << static_cast<unsigned>(x1 - x0)) - 1U)
                                << static_cast<unsigned>(x0);
  for (int row = y0; row <= y1; ++row) {
    const std::uint32_t open = tile.open[row] & columns;
    if (open == 0) continue;
    if (tile.body == nullptr || !body_hides(*tile.body, row, open, brick.depth_first)) return false;
  }
  return true;
}

void draw_tiles(const RenderPlan& plan, const Bins& bins, const surface::Pixels* surfaces,
                const kernels::Table& table, ThreadPool& pool, const CancelToken& cancel,
                TileSpace& space, TileSink sink, WorkReport& work) {
  const bool has_body = plan.body.shape != kernels::body_none;
  busy_tiles(has_body || surfaces != nullptr, bins, space.order);
  const std::vector<std::uint32_t>& order = space.order;
  if (space.workers.size() < pool.size()) space.workers.resize(pool.size());
  std::vector<Workspace>& spaces = space.workers;
  make_room(plan, surfaces != nullptr, spaces);
  std::vector<TileWork>& done = space.done;
  done.assign(order.size(), TileWork());
  pool.run(order.size(), [&](std::size_t i, unsigned worker) {
    if (cancel.cancelled()) return;
    const FlushDenormals flush;
    Tile tile{};
    kernels::TileBody body{};
    open_tile(plan, bins, table, order[i], spaces[worker], tile);
    if (has_body || surfaces != nullptr) {
      body.blocks = spaces[worker].body.data();
      if (has_body && table.open_body(plan.camera, plan.body, tile, body)) tile.body = &body;
      if (surfaces != nullptr) {
        add_surfaces(*surfaces, plan.camera, spaces[worker].surfaces, body, tile);
      }
      if (tile.body == nullptr && !has_bricks(bins, order[i])) return;
    }
    done[i].drawn = true;
    if (plan.or_lines) draw_or_lines(plan, bins, table, cancel, order[i], tile);
    if (plan.slabs || plan.curved) {
      done[i].stopped = sweep_tile(plan, bins, table, cancel, order[i], spaces[worker].sweep, tile);
    } else {
      draw_bricks(plan, bins, false, table, cancel, order[i], tile);
      done[i].stopped = table.count_open(tile) == 0;
    }
    if (tile.body != nullptr) table.close_body(tile);
    done[i].counters = tile.counters;
    done[i].closed_blocks = tile.any_closed != 0;
    deliver_tile(table, tile, spaces[worker].rows, sink);
  });
  level(spaces);
  for (const TileWork& tile : done) {
    work.tiles += tile.drawn ? 1 : 0;
    work.occluded += tile.counters.occluded;
    work.pixel_updates += tile.counters.pixel_updates;
    work.exponentials += tile.counters.exponentials;
    work.tiles_stopped += tile.stopped ? 1 : 0;
    // Closed blocks omit only what lies behind at most this transmittance.
    if (tile.closed_blocks) work.stop_bound = static_cast<double>(plan.stop_transmittance);
  }
}

}  // namespace windsplat::engine
