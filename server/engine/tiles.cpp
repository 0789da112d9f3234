// Draws tiles.
#include "server/engine/tiles.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/engine/sweep.hpp"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace windsplat::engine {

namespace {

using kernels::block_floats;
using kernels::block_pixels;
using kernels::block_side;
using kernels::Brick;
using kernels::Tile;
using kernels::tile_blocks;
using kernels::tile_side;

// Denormal numbers count as zero while this lives: they cost a hundred times as much, and no
// picture shows them.
class FlushDenormals {
 public:
#if defined(__SSE__)
  FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040U); }
  ~FlushDenormals() { _mm_setcsr(before_); }
#else
  FlushDenormals() = default;
  ~FlushDenormals() = default;
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
#if defined(__SSE__)
  unsigned before_;
#endif
};

// A worker's own pixels, used for one tile after the other.
struct Workspace {
  std::vector<float> blocks;
  std::vector<float> rays;
  std::vector<float> pixels;  // of a finished tile, by rows
  SweepSpace sweep;
};

// What a tile tells the report.
struct TileWork {
  kernels::Counters counters{};
  bool stopped = false;
  bool closed_blocks = false;
};

// The length of every pixel's ray whose forward component is 1.
void fill_rays(const kernels::Camera& camera, const Tile& tile, std::vector<float>& rays) {
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
      work.stopped = table.refresh_open(tile, plan.stop_transmittance) == 0;
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

// Block order -> rows.
void deliver_tile(const Tile& tile, std::vector<float>& pixels, const TileSink& sink) {
  constexpr std::size_t stride = std::size_t{4} * tile_side;
  pixels.resize(stride * tile_side);
  for (int y = 0; y < tile.height; ++y) {
    float* to = pixels.data() + static_cast<std::size_t>(y) * stride;
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
  sink({tile.x, tile.y, tile.width, tile.height, pixels.data(), stride});
}

// Longest first, so that no thread is left alone with a long tile at the end.
std::vector<std::uint32_t> busy_tiles(const Bins& bins) {
  std::vector<std::uint32_t> order;
  for (std::size_t t = 0; t + 1 < bins.first.size(); ++t) {
    if (bins.first[t + 1] > bins.first[t]) order.push_back(static_cast<std::uint32_t>(t));
  }
  const auto length = [&](std::uint32_t t) { return bins.first[t + 1] - bins.first[t]; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return length(a) > length(b); });
  return order;
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
                ThreadPool& pool, const CancelToken& cancel, const TileSink& sink,
                WorkReport& work) {
  const std::vector<std::uint32_t> order = busy_tiles(bins);
  std::vector<Workspace> spaces(pool.size());
  std::vector<TileWork> done(order.size());
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
    deliver_tile(tile, spaces[worker].pixels, sink);
  });
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
