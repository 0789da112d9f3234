// Part of the kernel body: a brick's prepared lines and splats into a tile's blocks, front to back.
#pragma once

#include "server/engine/kernels/body_composite.hpp"

namespace windsplat::engine::kernels {
namespace {

// First and last block of a row or column; none if last < first.
struct Range {
  int first, last;
};

// Blocks of the tile whose pixel centres may lie between two coordinates in pixels from the tile's
// edge. Block b holds the centres 4 b + 0.5 to 4 b + 3.5.
inline Range blocks_between(float low, float high, int blocks) {
  constexpr float per_block = 1.0F / block_side;
  constexpr float slack = 1e-3F;
  const float bound = static_cast<float>(blocks);
  // Truncation rounds down because nothing below zero is truncated.
  const float first = clamped((low - slack + 0.5F) * per_block, 0.0F, bound);
  const float last = clamped((high + slack - 0.5F) * per_block, -1.0F, bound - 0.5F);
  return {static_cast<int>(first), static_cast<int>(last + 1.0F) - 1};
}

// Blocks of one row that the line's capsule may touch: the part of the segment within r2 of the
// row's pixel centres, widened by r2. Coordinates from the tile's corner.
struct Capsule {
  float x, y, ux;
  float inverse_uy;  // 0 for a level line, whose whole length counts in every row
  float radius;
};

inline Range capsule_in_row(const Capsule& c, int row, int blocks) {
  const float top = static_cast<float>(row * block_side) + 0.5F - c.y;
  const float a = (top - c.radius) * c.inverse_uy;
  const float b = (top + static_cast<float>(block_side - 1) + c.radius) * c.inverse_uy;
  const float from = c.inverse_uy == 0 ? 0.0F : clamped(smaller(a, b), 0.0F, 1.0F);
  const float to = c.inverse_uy == 0 ? 1.0F : clamped(larger(a, b), 0.0F, 1.0F);
  const float xa = c.x + from * c.ux;
  const float xb = c.x + to * c.ux;
  return blocks_between(smaller(xa, xb) - c.radius, larger(xa, xb) + c.radius, blocks);
}

inline int blocks_of(int pixels) { return (pixels + block_side - 1) / block_side; }

inline std::uint32_t range_mask(Range range) {
  if (range.last < range.first) return 0;
  return (~std::uint32_t{0} >> static_cast<unsigned>(31 - (range.last - range.first)))
         << static_cast<unsigned>(range.first);
}

inline Ribbon ribbon_at(const LineStyle& line, const Ribbons& r, int l) {
  Ribbon out = {r.x[l],
                r.y[l],
                r.ux[l],
                r.uy[l],
                r.inverse_u2[l],
                r.w0[l],
                r.depth_ratio[l],
                {r.tail[0][l], r.tail[1][l], r.tail[2][l]},
                {r.rise[0][l], r.rise[1][l], r.rise[2][l]},
                r.depth[l],
                r.depth_rise[l],
                0,
                0,
                line.r2,
                line.inverse_ramp,
                line.opacity};
  if (line.moving != 0) {
    out.phase = r.phase[l];
    out.phase_rise = r.phase_rise[l];
  }
  return out;
}

template <bool Perspective>
inline Splat splat_at(const Densities& d, const Splats& s, float near, int l) {
  Splat out = {};
  out.x = s.x[l];
  out.y = s.y[l];
  out.xx = s.xx[l];
  out.xy = s.xy[l];
  out.yy = s.yy[l];
  out.d0 = s.d0[l];
  out.bx = s.bx[l];
  out.by = s.by[l];
  if (Perspective) {
    out.ex = s.ex[l];
    out.ey = s.ey[l];
    out.b0 = s.b0[l];
    out.dx = s.dx[l];
    out.dy = s.dy[l];
    out.dxx = s.dxx[l];
    out.dxy = s.dxy[l];
    out.dyy = s.dyy[l];
    out.d2_least = s.d2_least[l];
    out.z = s.z[l];
    out.near = near;
  }
  out.strength = s.strength[l];
  for (int c = 0; c < 3; ++c) out.color[c] = d.color[c][l];
  return out;
}

inline Capsule capsule_of(const Ribbon& ribbon, const Tile& tile) {
  return {ribbon.x - static_cast<float>(tile.x), ribbon.y - static_cast<float>(tile.y), ribbon.ux,
          absolute(ribbon.uy) > 1e-3F ? 1.0F / ribbon.uy : 0.0F, ribbon.r2};
}

// Rows of blocks that each stop's line may touch.
void find_line_rows(const LineStyle& line, const Ribbons& r, const Tile& tile, int count,
                    Footing& f) {
  const int rows = blocks_of(tile.height);
  const float top = static_cast<float>(tile.y);
  WINDSPLAT_LANES
  for (int l = 0; l < count; ++l) {
    const float a = r.y[l] - top;
    const float b = a + r.uy[l];
    const Range range = blocks_between(smaller(a, b) - line.r2, larger(a, b) + line.r2, rows);
    f.line_first[l] = range.first;
    f.line_last[l] = r.drawn[l] != 0 ? range.last : -1;
  }
}

// Rows and columns of blocks that each stop's splat may touch.
void find_splat_blocks(const Densities& densities, const Splats& s, const Tile& tile, int count,
                       Footing& f) {
  const int rows = blocks_of(tile.height);
  const int columns = blocks_of(tile.width);
  const float left = static_cast<float>(tile.x);
  const float top = static_cast<float>(tile.y);
  WINDSPLAT_LANES
  for (int l = 0; l < count; ++l) {
    const Range across = blocks_between(s.x0[l] - left, s.x1[l] - left, columns);
    const Range down = blocks_between(s.y0[l] - top, s.y1[l] - top, rows);
    const bool drawn = densities.rho[l] > 0 && across.last >= across.first;
    f.column_first[l] = across.first;
    f.column_last[l] = across.last;
    f.row_first[l] = down.first;
    f.row_last[l] = drawn ? down.last : -1;
  }
}

struct Reach {
  int first, last;        // rows of blocks, of line and splat together
  std::uint32_t columns;  // of the splat
};

template <bool Lines, bool Medium>
inline Reach reach_of(const Footing& f, int l) {
  Reach reach = {0, -1, 0};
  if (Lines) {
    reach.first = f.line_first[l];
    reach.last = f.line_last[l];
  }
  if (Medium && f.row_last[l] >= f.row_first[l]) {
    reach.columns = range_mask({f.column_first[l], f.column_last[l]});
    const bool alone = !Lines || reach.last < reach.first;
    reach.first = alone || f.row_first[l] < reach.first ? f.row_first[l] : reach.first;
    reach.last = alone || f.row_last[l] > reach.last ? f.row_last[l] : reach.last;
  }
  return reach;
}

// Composites one kernel: its line, its splat or both.
template <bool Lines, bool Medium, bool Perspective>
inline void draw_kernel(const Prepared& p, const Compositor& with, int l, Tile& tile) {
  const Reach reach = reach_of<Lines, Medium>(p.footing, l);
  if (reach.last < reach.first) return;
  Ribbon ribbon;
  Splat splat;
  Capsule capsule = {};
  if (Lines && p.footing.line_last[l] >= p.footing.line_first[l]) {
    ribbon = ribbon_at(p.pass->line, p.ribbons, l);
    capsule = capsule_of(ribbon, tile);
  }
  bool near = false;
  if (Medium && reach.columns != 0) {
    splat = splat_at<Perspective>(p.densities, p.splats, p.near, l);
    near = Perspective && splat.z - 2.0F * p.splats.half_depth[l] < p.near;
  }
  const SplatFunction splat_function = near ? with.near_splat : with.splat;
  const BothFunction both_function = near ? with.near_both : with.both;
  const int columns_in_tile = blocks_of(tile.width);
  for (int row = reach.first; row <= reach.last; ++row) {
    std::uint32_t lines = 0;
    std::uint32_t splats = 0;
    if (Lines && row >= p.footing.line_first[l] && row <= p.footing.line_last[l]) {
      lines = range_mask(capsule_in_row(capsule, row, columns_in_tile));
    }
    if (Medium && row >= p.footing.row_first[l] && row <= p.footing.row_last[l]) {
      splats = reach.columns;
    }
    const float y = static_cast<float>(tile.y + row * block_side);
    std::uint32_t left = (lines | splats) & tile.open[row];
    while (left != 0) {
      const int column = __builtin_ctz(left);
      const std::uint32_t bit = left & (~left + 1U);
      left ^= bit;
      const float x = static_cast<float>(tile.x + column * block_side);
      const int index = row * tile_blocks + column;
      float* block = tile.blocks + static_cast<std::ptrdiff_t>(index) * block_floats;
      const float* ray = Medium && Perspective
                             ? tile.rays + static_cast<std::ptrdiff_t>(index) * block_pixels
                             : nullptr;
      tile.counters.pixel_updates += block_pixels;
      if (Lines && Medium && (lines & splats & bit) != 0) {
        both_function(ribbon, splat, x, y, ray, block);
        tile.counters.exponentials += std::int64_t{with.both_exponentials} * block_pixels;
      } else if (Lines && (!Medium || (lines & bit) != 0)) {
        with.line(ribbon, x, y, block);
      } else if (Medium) {
        splat_function(splat, x, y, ray, block);
        tile.counters.exponentials += std::int64_t{with.splat_exponentials} * block_pixels;
      }
    }
  }
}

// How far a brick's kernels reach beyond their stops along right, down and forward.
void brick_reach(const Camera& camera, const Pass& pass, const Brick& brick, float reach[3]) {
  float cell[3] = {0, 0, 0};
  const auto widest = [&](int a, int first, int count) {
    for (int i = first; i < first + count; ++i) {
      cell[a] = larger(cell[a], pass.axis[a].cell[pass.axis[a].visit[i]]);
    }
  };
  widest(pass.major, brick.slab, 1);
  widest(pass.u, brick.u_first, brick.u_count);
  widest(pass.v, brick.v_first, brick.v_count);
  const float moved = 0.5F * (pass.line.jitter_center + pass.line.jitter_stride);
  if (pass.places != nullptr) {
    for (int c = 0; c < 3; ++c) cell[c] = pass.cell_max[c];
  }
  const float* const frame[3] = {camera.right, camera.down, camera.forward};
  for (int c = 0; c < 3; ++c) {
    float box = 0;    // half the kernel's, along this axis of the camera
    float shift = 0;  // of its centre
    float square = 0;
    for (int a = 0; a < 3; ++a) {
      box += pass.line.half_span * absolute(frame[c][a]) * cell[a];
      shift += moved * absolute(frame[c][a]) * cell[a];
      square += frame[c][a] * frame[c][a] * cell[a] * cell[a];
    }
    const float line = smaller(brick.line_reach, box) + shift;
    if (pass.places != nullptr) square *= 3.0F;
    const float splat = pass.has_medium != 0 ? footprint_t * square_root(square) : 0.0F;
    reach[c] = larger(pass.has_lines != 0 ? line : 0.0F, splat) * 1.00001F;
  }
}

// Leaves out the stops whose kernel can only touch closed blocks.
template <bool Perspective>
void keep_unhidden(const Camera& camera, const float reach[3], float margin, Tile& tile,
                   Stops& stops) {
  const float left = static_cast<float>(tile.x) - camera.half_width_px;
  const float top = static_cast<float>(tile.y) - camera.half_height_px;
  const int columns = blocks_of(tile.width);
  const int rows = blocks_of(tile.height);
  int first_column[brick_stops], last_column[brick_stops];
  int first_row[brick_stops], last_row[brick_stops];
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const float z = stops.z[l];
    // The nearest and farthest the kernel reaches widen it most, on either side of the middle.
    const float near = Perspective ? 1.0F / larger(z - reach[2], camera.near) : 1.0F;
    const float far = Perspective ? 1.0F / (z + reach[2]) : 1.0F;
    const float x0 = stops.x[l] - reach[0];
    const float x1 = stops.x[l] + reach[0];
    const float y0 = stops.y[l] - reach[1];
    const float y1 = stops.y[l] + reach[1];
    const float scale = camera.inverse_pixel;
    const Range across =
        blocks_between(smaller(x0 * near, x0 * far) * scale - left - margin,
                       larger(x1 * near, x1 * far) * scale - left + margin, columns);
    const Range along = blocks_between(smaller(y0 * near, y0 * far) * scale - top - margin,
                                       larger(y1 * near, y1 * far) * scale - top + margin, rows);
    first_column[l] = across.first;
    last_column[l] = across.last;
    first_row[l] = along.first;
    last_row[l] = along.last;
  }
  int kept[brick_stops];
  for (int l = 0; l < stops.count; ++l) {
    std::uint32_t open = 0;
    for (int row = first_row[l]; row <= last_row[l]; ++row) open |= tile.open[row];
    kept[l] = (open & range_mask({first_column[l], last_column[l]})) != 0 ? 1 : 0;
    tile.counters.occluded += 1 - kept[l];
  }
  keep_stops(kept, stops);
}

// Leaves out the stops that have neither line nor splat.
template <bool Lines, bool Medium>
void keep_drawn(Stops& stops, Winds& winds, Densities& densities) {
  int kept[brick_stops];
  int n = 0;
  for (int l = 0; l < stops.count; ++l) {
    int keep = 0;
    if (Lines) {
      keep |= winds.magnitude[l] > 0 ? 1 : 0;
      winds.magnitude[n] = winds.magnitude[l];
      for (auto& component : winds.direction) component[n] = component[l];
    }
    if (Medium) {
      keep |= densities.rho[l] > 0 ? 1 : 0;
      densities.rho[n] = densities.rho[l];
    }
    kept[l] = keep;
    n += keep;
  }
  keep_stops(kept, stops);
}

// Everything up to the pixels: what of a brick may touch the tile's open blocks, made ready.
template <bool Lines, bool Medium, bool Perspective, bool Curved>
void prepare_brick(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                   Prepared& out) {
  Stops& stops = out.stops;
  Winds winds;
  Cells cells;
  out.pass = &pass;
  out.near = camera.near;
  list_stops(pass, brick, stops);
  if (Curved) {
    place_curved_stops(camera, pass, stops);
  } else {
    place_stops(camera, pass, brick, stops);
  }
  float reach[3];
  brick_reach(camera, pass, brick, reach);
  const float margin = Lines ? pass.line.r2 : 0.0F;
  cull_stops<Perspective>(camera, tile, reach, margin, stops);
  if (tile.any_closed != 0) keep_unhidden<Perspective>(camera, reach, margin, tile, stops);
  if (stops.count == 0) return;
  if (Lines) read_winds(pass, stops, winds);
  if (Medium) read_densities(pass, stops, out.densities);
  keep_drawn<Lines, Medium>(stops, winds, out.densities);
  fill_cells<Curved>(camera, pass, stops, cells);
  if (Curved) drop_flat_cells<Lines, Medium>(stops, cells, winds, out.densities);
  if (Lines) {
    if (Curved) bend_winds(pass, stops, cells, winds);
    prepare_ribbons<Perspective, Curved>(camera, pass, stops, cells, winds, out.ribbons);
    find_line_rows(pass.line, out.ribbons, tile, stops.count, out.footing);
  }
  if (Medium) {
    color_densities(pass, stops, out.densities);
    prepare_splats<Perspective, Curved>(camera, stops, cells, out.densities, out.splats);
    find_splat_blocks(out.densities, out.splats, tile, stops.count, out.footing);
  }
}

template <bool Lines, bool Medium, bool Perspective>
void prepare_on(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                Prepared& out) {
  if (pass.places != nullptr) {
    prepare_brick<Lines, Medium, Perspective, true>(camera, pass, brick, tile, out);
  } else {
    prepare_brick<Lines, Medium, Perspective, false>(camera, pass, brick, tile, out);
  }
}

template <bool Lines, bool Medium, bool Perspective>
void draw_stops(const Prepared& p, int first, int last, Tile& tile) {
  const Compositor with = compositor_of<Perspective>(*p.pass);
  for (int l = first; l < last; ++l) draw_kernel<Lines, Medium, Perspective>(p, with, l, tile);
}

// Brings a brick's samples closer while the one before it is drawn: rows of a brick are far apart
// in memory, which no processor guesses.
void prefetch_brick(const Pass& pass, const Brick& brick) {
  const Axis& u = pass.axis[pass.u];
  const Axis& v = pass.axis[pass.v];
  const Axis& major = pass.axis[pass.major];
  const std::int64_t slab = pass.step[pass.major] * major.sample[major.visit[brick.slab]];
  const std::int64_t first = slab + pass.step[pass.u] * u.sample[u.visit[brick.u_first]];
  for (int j = 0; j < brick.v_count; ++j) {
    const std::int64_t at = first + pass.step[pass.v] * v.sample[v.visit[brick.v_first + j]];
    if (pass.has_lines != 0) {
      for (const float* values : pass.line.velocity) {
        if (values != nullptr) __builtin_prefetch(values + at);
      }
    }
    for (int k = 0; k < pass.medium.layers; ++k) {
      __builtin_prefetch(pass.medium.layer[k].values + at);
    }
  }
}

template <bool Perspective>
void prepare_projected(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                       Prepared& out) {
  if (pass.has_lines != 0 && pass.has_medium != 0) {
    prepare_on<true, true, Perspective>(camera, pass, brick, tile, out);
  } else if (pass.has_lines != 0) {
    prepare_on<true, false, Perspective>(camera, pass, brick, tile, out);
  } else {
    prepare_on<false, true, Perspective>(camera, pass, brick, tile, out);
  }
}

void prepare(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
             Prepared& out) {
  if (camera.perspective != 0) {
    prepare_projected<true>(camera, pass, brick, tile, out);
  } else {
    prepare_projected<false>(camera, pass, brick, tile, out);
  }
}

template <bool Perspective>
void draw_projected(const Prepared& p, int first, int last, Tile& tile) {
  if (p.pass->has_lines != 0 && p.pass->has_medium != 0) {
    draw_stops<true, true, Perspective>(p, first, last, tile);
  } else if (p.pass->has_lines != 0) {
    draw_stops<true, false, Perspective>(p, first, last, tile);
  } else {
    draw_stops<false, true, Perspective>(p, first, last, tile);
  }
}

void draw_prepared(const Camera& camera, const Prepared& p, int first, int last, Tile& tile) {
  if (camera.perspective != 0) {
    draw_projected<true>(p, first, last, tile);
  } else {
    draw_projected<false>(p, first, last, tile);
  }
}

void draw(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile) {
  Prepared prepared;
  prepare(camera, pass, brick, tile, prepared);
  if (prepared.stops.count > 0) draw_prepared(camera, prepared, 0, prepared.stops.count, tile);
}

int refresh_open(Tile& tile, float stop) {
  int open = 0;
  const int rows = blocks_of(tile.height);
  for (int row = 0; row < rows; ++row) {
    std::uint32_t left = tile.open[row];
    open += __builtin_popcount(left);
    while (left != 0) {
      const int column = __builtin_ctz(left);
      const std::uint32_t bit = left & (~left + 1U);
      left ^= bit;
      const float* t =
          tile.blocks + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * block_floats;
      float most = 0;
      for (int l = 0; l < block_pixels; ++l) most = larger(most, absolute(t[l]));
      if (most > stop) continue;
      tile.open[row] ^= bit;
      tile.any_closed = 1;
      --open;
    }
  }
  return open;
}

}  // namespace
}  // namespace windsplat::engine::kernels
