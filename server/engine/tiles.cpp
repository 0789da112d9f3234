// Draws tiles.
#include "server/engine/tiles.hpp"

#include <algorithm>
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
using kernels::tile_side;

// The length of every pixel's ray whose forward component is 1.
void fill_rays(const kernels::Camera& camera, const Tile& tile, AlignedVector<float>& rays) {
  for (int block = 0; block < tile_blocks * tile_blocks; ++block) {
    float* ray = rays.data() + static_cast<std::size_t>(block) * block_pixels;
    for (int l = 0; l < block_pixels; ++l) {
      const int px = tile.x + block % tile_blocks * block_side + l % block_side;
      const int py = tile.y + block / tile_blocks * block_side + l / block_side;
      const double x = (px + 0.5 - camera.half_width_px) * camera.pixel;
      const double y = (py + 0.5 - camera.half_height_px) * camera.pixel;
      ray[l] = static_cast<float>(std::sqrt(1 + x * x + y * y));
    }
  }
}

void open_tile(const RenderPlan& plan, const Bins& bins, std::size_t index, Workspace& space,
               Tile& tile) {
  const int tx = static_cast<int>(index) % bins.tiles_x;
  const int ty = static_cast<int>(index) / bins.tiles_x;
  tile.x = tx * tile_side;
  tile.y = ty * tile_side;
  tile.width = std::min(tile_side, plan.camera.width - tile.x);
  tile.height = std::min(tile_side, plan.camera.height - tile.y);
  constexpr std::size_t blocks = static_cast<std::size_t>(tile_blocks) * tile_blocks;
  space.blocks.assign(blocks * block_floats, 0.0F);
  for (std::size_t b = 0; b < blocks; ++b) {
    std::fill_n(space.blocks.begin() + static_cast<std::ptrdiff_t>(b * block_floats), block_pixels,
                1.0F);
  }
  if (plan.perspective_medium) {
    space.rays.resize(blocks * block_pixels);
    fill_rays(plan.camera, tile, space.rays);
  }
  tile.blocks = space.blocks.data();
  tile.rays = space.rays.data();
  tile.stop = plan.stop_transmittance;
  const int columns = (tile.width + block_side - 1) / block_side;
  const int rows = (tile.height + block_side - 1) / block_side;
  std::fill(std::begin(tile.open), std::end(tile.open), 0U);
  std::fill_n(std::begin(tile.open), rows, (2U << static_cast<unsigned>(columns - 1)) - 1U);
}

std::int64_t stops_of(const Brick& brick) {
  return static_cast<std::int64_t>(brick.u_count) * brick.v_count;
}

void draw_tile(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
               const CancelToken& cancel, std::size_t index, Tile& tile, TileWork& work) {
  // Between looks at the clock of light and of the caller's patience.
  constexpr std::size_t bricks_between_checks = 16;
  const std::size_t first = bins.first[index];
  const std::size_t last = bins.first[index + 1];
  for (std::size_t e = first; e < last; ++e) {
    if ((e - first) % bricks_between_checks == bricks_between_checks - 1) {
      if (cancel.cancelled()) return;
      work.stopped = table.count_open(tile) == 0;
    }
    if (e + 1 < last) {
      const Brick& next = bins.bricks[bins.entries[e + 1]];
      table.prefetch(plan.passes[next.pass].kernel, next);
    }
    const Brick& brick = bins.bricks[bins.entries[e]];
    if (work.stopped || all_closed(tile, brick)) {
      tile.counters.occluded += stops_of(brick);
      continue;
    }
    table.draw(plan.camera, plan.passes[brick.pass].kernel, brick, tile);
  }
}

void store_tile(const Tile& tile, Image& image) {
  for (int y = 0; y < tile.height; ++y) {
    float* to =
        image.rgba.data() + 4 * (static_cast<std::size_t>(tile.y + y) * image.width + tile.x);
    for (int x = 0; x < tile.width; ++x, to += 4) {
      const int block = y / block_side * tile_blocks + x / block_side;
      const int lane = y % block_side * block_side + x % block_side;
      const float* from = tile.blocks + static_cast<std::ptrdiff_t>(block) * block_floats + lane;
      for (int c = 0; c < 3; ++c) to[c] = from[static_cast<std::ptrdiff_t>(2 + c) * block_pixels];
      // A sum of many parts of what was left may pass 1 by a rounding; what passes it by more has
      // diverged, and is to be seen.
      constexpr float rounding = 1e-4F;
      const float alpha = from[block_pixels];
      to[3] = alpha > 1.0F && alpha < 1.0F + rounding ? 1.0F : alpha;
    }
  }
}

// Longest first, so that no thread is left alone with a long tile at the end.
void busy_tiles(const Bins& bins, std::vector<std::uint32_t>& order) {
  order.clear();
  for (std::size_t t = 0; t + 1 < bins.first.size(); ++t) {
    if (bins.first[t + 1] > bins.first[t]) order.push_back(static_cast<std::uint32_t>(t));
  }
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return bins.load[a] != bins.load[b] ? bins.load[a] > bins.load[b] : a < b;
  });
}

// Every worker's memory as large as the largest: which one meets the tile that needs most is a
// matter of chance, and is not to decide when memory stops growing.
void level(std::vector<Workspace>& spaces) {
  if (spaces.size() < 2) return;
  const auto each = [&](const auto& member) {
    std::size_t most = 0;
    for (Workspace& space : spaces) most = std::max(most, member(space.sweep).capacity());
    for (Workspace& space : spaces) member(space.sweep).reserve(most);
  };
  each_vector(each);
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

bool all_closed(const Tile& tile, const Brick& brick) {
  const int bx = tile.x / block_side;
  const int by = tile.y / block_side;
  const int x0 = std::max(brick.block_x - bx, 0);
  const int x1 = std::min(brick.block_x_last - bx, tile_blocks - 1);
  const int y0 = std::max(brick.block_y - by, 0);
  const int y1 = std::min(brick.block_y_last - by, tile_blocks - 1);
  const std::uint32_t columns = ((2U << static_cast<unsigned>(x1 - x0)) - 1U)
                                << static_cast<unsigned>(x0);
  for (int row = y0; row <= y1; ++row) {
    if ((tile.open[row] & columns) != 0) return false;
  }
  return true;
}

void draw_tiles(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                ThreadPool& pool, const CancelToken& cancel, TileSpace& space, Image& image,
                WorkReport& work) {
  busy_tiles(bins, space.order);
  const std::vector<std::uint32_t>& order = space.order;
  if (space.workers.size() < pool.size()) space.workers.resize(pool.size());
  std::vector<Workspace>& spaces = space.workers;
  std::vector<TileWork>& done = space.done;
  done.assign(order.size(), TileWork());
  pool.run(order.size(), [&](std::size_t i, unsigned worker) {
    if (cancel.cancelled()) return;
    const FlushDenormals flush;
    Tile tile{};
    open_tile(plan, bins, order[i], spaces[worker], tile);
    if (plan.slabs || plan.curved) {
      done[i].stopped = sweep_tile(plan, bins, table, cancel, order[i], spaces[worker].sweep, tile);
    } else {
      draw_tile(plan, bins, table, cancel, order[i], tile, done[i]);
    }
    done[i].counters = tile.counters;
    done[i].closed_blocks = tile.any_closed != 0;
    store_tile(tile, image);
  });
  level(spaces);
  work.tiles = static_cast<std::int64_t>(order.size());
  for (const TileWork& tile : done) {
    work.occluded += tile.counters.occluded;
    work.pixel_updates += tile.counters.pixel_updates;
    work.exponentials += tile.counters.exponentials;
    work.tiles_stopped += tile.stopped ? 1 : 0;
    // What is behind at most this much light is left out.
    if (tile.closed_blocks) work.stop_bound = static_cast<double>(plan.stop_transmittance);
  }
}

}  // namespace windsplat::engine
