// Part of the kernel body: prepared lines and splats into blocks of pixels, front to back.
#pragma once

#include "server/engine/kernels/body_lines.hpp"
#include "server/engine/kernels/body_splats.hpp"

namespace windsplat::engine::kernels {
namespace {

// Pixel centres of a block, from its corner.
alignas(64) constexpr float lane_x[block_pixels] = {0.5F, 1.5F, 2.5F, 3.5F, 0.5F, 1.5F, 2.5F, 3.5F,
                                                    0.5F, 1.5F, 2.5F, 3.5F, 0.5F, 1.5F, 2.5F, 3.5F};
alignas(64) constexpr float lane_y[block_pixels] = {0.5F, 0.5F, 0.5F, 0.5F, 1.5F, 1.5F, 1.5F, 1.5F,
                                                    2.5F, 2.5F, 2.5F, 2.5F, 3.5F, 3.5F, 3.5F, 3.5F};

// One line's constants.
struct Ribbon {
  float x, y, ux, uy, inverse_u2, w0, depth_ratio;
  float tail[3], rise[3];
  float depth, depth_rise;
  float r2, inverse_ramp, opacity;
};

struct Splat {
  float x, y, xx, xy, yy;
  float weight[3];
  float strength, cells_depth;
  float color[3];
};

struct RibbonLane {
  float opacity;
  float f;
};

template <bool Perspective>
inline RibbonLane ribbon_lane(const Ribbon& r, float px, float py) {
  const float dx = px - r.x;
  const float dy = py - r.y;
  const float w = clamped((dx * r.ux + dy * r.uy) * r.inverse_u2 + r.w0, 0.0F, 1.0F);
  const float ex = dx - w * r.ux;
  const float ey = dy - w * r.uy;
  const float distance = square_root(ex * ex + ey * ey);
  const float cover = clamped((r.r2 - distance) * r.inverse_ramp, 0.0F, 1.0F);
  // 1/z is linear on the screen.
  const float f = Perspective ? w * r.depth_ratio / (1.0F + w * (r.depth_ratio - 1.0F)) : w;
  return {cover * r.opacity, f};
}

struct SplatLane {
  float tau;
  float cells_depth;  // cells per unit of view distance along this pixel's ray
};

template <bool Perspective>
inline SplatLane splat_lane(const Splat& s, float px, float py, const float* ray, int l) {
  const float dx = px - s.x;
  const float dy = py - s.y;
  const float top = s.xx * (dx * dx) + s.xy * (dx * dy) + s.yy * (dy * dy);
  // The quadratic form is never negative; its rounded sum may be.
  const float least = larger(top, 0.0F);
  if constexpr (Perspective) {
    const float length2 = s.weight[0] * ray[l] + s.weight[1] * ray[block_pixels + l] +
                          s.weight[2] * ray[2 * block_pixels + l];
    const float inverse = 1.0F / square_root(length2);
    const float r = square_root(least) * inverse;
    const float tau = s.strength * footprint(r * r, r) * (inverse * ray[3 * block_pixels + l]);
    return {tau, length2 * inverse};
  } else {
    return {s.strength * footprint(least, square_root(least)), s.cells_depth};
  }
}

struct Channels {
  float* transmittance;
  float* alpha;
  float* rgb[3];
};

inline Channels channels_of(float* block) {
  constexpr std::ptrdiff_t lanes = block_pixels;
  return {block, block + lanes, {block + 2 * lanes, block + 3 * lanes, block + 4 * lanes}};
}

template <bool Perspective, bool Head>
inline void line_block(const Ribbon& r, float x, float y, float* __restrict block) {
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const RibbonLane lane = ribbon_lane<Perspective>(r, x + lane_x[l], y + lane_y[l]);
    const float t = to.transmittance[l];
    const float a = t * lane.opacity;
    for (int c = 0; c < 3; ++c) {
      const float color = Head ? r.tail[c] + lane.f * r.rise[c] : r.tail[c];
      to.rgb[c][l] += a * color;
    }
    to.alpha[l] += a;
    to.transmittance[l] = t * (1.0F - lane.opacity);
  }
}

template <bool Perspective>
inline void splat_block(const Splat& s, float x, float y, const float* __restrict ray,
                        float* __restrict block) {
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const SplatLane lane = splat_lane<Perspective>(s, x + lane_x[l], y + lane_y[l], ray, l);
    const Attenuation medium = attenuation(lane.tau);
    const float t = to.transmittance[l];
    const float a = t * medium.absorbed;
    for (int c = 0; c < 3; ++c) to.rgb[c][l] += a * s.color[c];
    to.alpha[l] += a;
    to.transmittance[l] = t * medium.transmitted;
  }
}

// A line inside its homogeneous cell, at x = tf / tau of the way through it:
// A = -expm1(-tau) + a exp(-tau), I = c_s A + a exp(-tf) (c_v - c_s).
template <bool Perspective>
inline void both_block(const Ribbon& r, const Splat& s, float x, float y,
                       const float* __restrict ray, float* __restrict block) {
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const float px = x + lane_x[l];
    const float py = y + lane_y[l];
    const RibbonLane line = ribbon_lane<Perspective>(r, px, py);
    const SplatLane splat = splat_lane<Perspective>(s, px, py, ray, l);
    const Attenuation medium = attenuation(splat.tau);
    const float place =
        clamped(0.5F + (r.depth + line.f * r.depth_rise) * splat.cells_depth, 0.0F, 1.0F);
    // tau is finite (the plan bounds extinctions), so that 0 times it is 0.
    const float before = attenuation(splat.tau * place).transmitted;
    const float t = to.transmittance[l];
    const float a = medium.absorbed + line.opacity * medium.transmitted;
    const float own = line.opacity * before;
    for (int c = 0; c < 3; ++c) {
      const float color = r.tail[c] + line.f * r.rise[c];
      to.rgb[c][l] += t * (s.color[c] * a + own * (color - s.color[c]));
    }
    to.alpha[l] += t * a;
    to.transmittance[l] = t * (medium.transmitted * (1.0F - line.opacity));
  }
}

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

struct Area {
  Range rows;
  Range columns;  // of a splat
};

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
                line.r2,
                line.inverse_ramp,
                line.opacity};
  return out;
}

inline Splat splat_at(const Densities& d, const Splats& s, int l) {
  Splat out = {s.x[l],        s.y[l],           s.xx[l],
               s.xy[l],       s.yy[l],          {s.weight[0][l], s.weight[1][l], s.weight[2][l]},
               s.strength[l], s.cells_depth[l], {d.color[0][l], d.color[1][l], d.color[2][l]}};
  return out;
}

constexpr Range no_range = {0, -1};

// Composites one kernel: its line, its splat or both.
template <bool Lines, bool Medium, bool Perspective, bool Head>
inline void draw_kernel(const Ribbon* ribbon, const Splat* splat, const Area& area, Range line_rows,
                        Tile& tile) {
  Capsule capsule = {};
  if (Lines) {
    capsule = {ribbon->x - static_cast<float>(tile.x), ribbon->y - static_cast<float>(tile.y),
               ribbon->ux, absolute(ribbon->uy) > 1e-3F ? 1.0F / ribbon->uy : 0.0F, ribbon->r2};
  }
  const int columns_in_tile = blocks_of(tile.width);
  int first = Medium ? area.rows.first : line_rows.first;
  int last = Medium ? area.rows.last : line_rows.last;
  if (Lines && Medium && line_rows.last >= line_rows.first) {
    const bool splat_rows = area.rows.last >= area.rows.first;
    first = splat_rows && area.rows.first < line_rows.first ? area.rows.first : line_rows.first;
    last = splat_rows && area.rows.last > line_rows.last ? area.rows.last : line_rows.last;
  }
  const std::uint32_t columns = Medium ? range_mask(area.columns) : 0;
  for (int row = first; row <= last; ++row) {
    std::uint32_t lines = 0;
    std::uint32_t splats = 0;
    if (Lines && row >= line_rows.first && row <= line_rows.last) {
      lines = range_mask(capsule_in_row(capsule, row, columns_in_tile));
    }
    if (Medium && row >= area.rows.first && row <= area.rows.last) splats = columns;
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
                             ? tile.rays + static_cast<std::ptrdiff_t>(index) * ray_floats
                             : nullptr;
      tile.counters.pixel_updates += block_pixels;
      if (Lines && Medium && (lines & splats & bit) != 0) {
        both_block<Perspective>(*ribbon, *splat, x, y, ray, block);
        tile.counters.exponentials += std::int64_t{2} * block_pixels;
      } else if (Lines && (!Medium || (lines & bit) != 0)) {
        line_block<Perspective, Head>(*ribbon, x, y, block);
      } else if (Medium) {
        splat_block<Perspective>(*splat, x, y, ray, block);
        tile.counters.exponentials += block_pixels;
      }
    }
  }
}

// Rows of blocks that each stop's line may touch.
struct Footing {
  int line_first[brick_stops], line_last[brick_stops];
};

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

template <bool Lines, bool Medium, bool Perspective, bool Head>
void draw_stops(const Pass& pass, const Stops& stops, const Ribbons& ribbons,
                const Densities& densities, const Splats& splats, Tile& tile) {
  Footing footing;
  if (Lines) find_line_rows(pass.line, ribbons, tile, stops.count, footing);
  const auto left = static_cast<float>(tile.x);
  const auto top = static_cast<float>(tile.y);
  for (int l = 0; l < stops.count; ++l) {
    Ribbon ribbon;
    Splat splat;
    Range line_rows = no_range;
    Area area = {no_range, no_range};
    if (Lines) line_rows = {footing.line_first[l], footing.line_last[l]};
    if (Lines && line_rows.last >= line_rows.first) ribbon = ribbon_at(pass.line, ribbons, l);
    if (Medium && densities.rho[l] > 0) {
      splat = splat_at(densities, splats, l);
      area.columns =
          blocks_between(splats.x0[l] - left, splats.x1[l] - left, blocks_of(tile.width));
      area.rows = blocks_between(splats.y0[l] - top, splats.y1[l] - top, blocks_of(tile.height));
      if (area.columns.last < area.columns.first) area.rows = no_range;
    }
    if (line_rows.last < line_rows.first && area.rows.last < area.rows.first) continue;
    draw_kernel<Lines, Medium, Perspective, Head>(&ribbon, &splat, area, line_rows, tile);
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
  const float* const frame[3] = {camera.right, camera.down, camera.forward};
  for (int c = 0; c < 3; ++c) {
    float line = brick.line_reach;
    float square = 0;
    for (int a = 0; a < 3; ++a) {
      line += moved * absolute(frame[c][a]) * cell[a];
      square += frame[c][a] * frame[c][a] * cell[a] * cell[a];
    }
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

template <bool Lines, bool Medium, bool Perspective, bool Head>
void draw_brick(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile) {
  Stops stops;
  Winds winds;
  Densities densities;
  Ribbons ribbons;
  Splats splats;
  list_stops(pass, brick, stops);
  place_stops(pass, brick, stops);
  float reach[3];
  brick_reach(camera, pass, brick, reach);
  const float margin = Lines ? pass.line.r2 : 0.0F;
  cull_stops<Perspective>(camera, tile, reach, margin, stops);
  if (tile.any_closed != 0) keep_unhidden<Perspective>(camera, reach, margin, tile, stops);
  if (stops.count == 0) return;
  if (Lines) read_winds(pass, stops, winds);
  if (Medium) read_densities(pass, stops, densities);
  keep_drawn<Lines, Medium>(stops, winds, densities);
  if (Lines) prepare_ribbons<Perspective>(camera, pass, stops, winds, ribbons);
  if (Medium) {
    color_densities(pass, stops, densities);
    prepare_splats<Perspective>(camera, pass, stops, densities, splats);
  }
  draw_stops<Lines, Medium, Perspective, Head>(pass, stops, ribbons, densities, splats, tile);
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
void draw_projected(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile) {
  const bool head = pass.has_lines != 0 && pass.line.head_desaturation > 0;
  if (pass.has_lines != 0 && pass.has_medium != 0) {
    if (head) {
      draw_brick<true, true, Perspective, true>(camera, pass, brick, tile);
    } else {
      draw_brick<true, true, Perspective, false>(camera, pass, brick, tile);
    }
  } else if (pass.has_lines != 0) {
    if (head) {
      draw_brick<true, false, Perspective, true>(camera, pass, brick, tile);
    } else {
      draw_brick<true, false, Perspective, false>(camera, pass, brick, tile);
    }
  } else {
    draw_brick<false, true, Perspective, false>(camera, pass, brick, tile);
  }
}

void draw(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile) {
  if (camera.perspective != 0) {
    draw_projected<true>(camera, pass, brick, tile);
  } else {
    draw_projected<false>(camera, pass, brick, tile);
  }
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
      for (int l = 0; l < block_pixels; ++l) most = larger(most, t[l]);
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
