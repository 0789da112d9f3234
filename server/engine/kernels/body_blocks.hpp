// Part of the kernel body: a brick's stops made ready for a tile, and composited into its blocks,
// front to back.
#pragma once

#include "server/engine/kernels/body_composite.hpp"

namespace windsplat::engine::kernels {
namespace {

using StopIntegers = hn::RebindToSigned<StopTag>;
using StopInteger = hn::Vec<StopIntegers>;

// blocks_between for a row of stops.
struct Ranges {
  StopInteger first, last;
};

HWY_INLINE Ranges blocks_between(Stop low, Stop high, int blocks) {
  constexpr float per_block = 1.0F / block_side;
  constexpr float slack = 1e-3F;
  const float bound = static_cast<float>(blocks);
  const Stop first = clamped((low + all<Stop>(0.5F - slack)) * all<Stop>(per_block), 0.0F, bound);
  const Stop last =
      clamped((high + all<Stop>(slack - 0.5F)) * all<Stop>(per_block), -1.0F, bound - 0.5F);
  return {truncated(first), truncated(last + all<Stop>(1.0F)) - hn::Set(StopIntegers(), 1)};
}

// The bits from first to last; none if last < first.
HWY_INLINE UnsignedOf<Stop> range_masks(const Ranges& range) {
  const hn::RebindToUnsigned<StopTag> tag;
  const auto one = hn::Set(tag, 1U);
  const auto above =
      hn::Shl(one + one, hn::BitCast(tag, hn::Max(range.last, hn::Zero(StopIntegers()))));
  const auto below = hn::Shl(one, hn::BitCast(tag, range.first));
  const auto bits = hn::AndNot(below - one, above - one);
  const auto none = hn::Gt(range.first, range.last);
  return hn::IfThenZeroElse(hn::RebindMask(tag, none), bits);
}

// Rows and columns of blocks that a row's lines may touch. In a row of blocks that is the part of
// the segment within r2 of the row's pixel centres, widened by r2.
HWY_INLINE std::uint32_t find_line_blocks(const LineStyle& line, const Ribbons& r, const Tile& tile,
                                          int l, std::uint32_t bits, Footing& f) {
  const int rows = blocks_of(tile.height);
  const int columns = blocks_of(tile.width);
  const Stop radius = all<Stop>(line.r2);
  const Stop x = load<Stop>(r.x + l) - all<Stop>(static_cast<float>(tile.x));
  const Stop y = load<Stop>(r.y + l) - all<Stop>(static_cast<float>(tile.y));
  const Stop ux = load<Stop>(r.ux + l);
  const Stop uy = load<Stop>(r.uy + l);
  const Stop end = y + uy;
  const Ranges range = blocks_between(hn::Min(y, end) - radius, hn::Max(y, end) + radius, rows);
  const Stop other_end = x + ux;
  const Ranges across =
      blocks_between(hn::Min(x, other_end) - radius, hn::Max(x, other_end) + radius, columns);
  const auto missing = hn::Or(hn::Gt(range.first, range.last), hn::Gt(across.first, across.last));
  bits &= ~bits_of<Stop>(hn::RebindMask(StopTag(), missing));
  if (bits == 0) return 0;
  hn::Store(range.first, StopIntegers(), f.line_first + l);
  hn::Store(range.last, StopIntegers(), f.line_last + l);
  // A level line's whole length counts in every row.
  const auto level = hn::Le(hn::Abs(uy), all<Stop>(1e-3F));
  const Stop inverse = inverse_of(hn::IfThenElse(level, all<Stop>(1.0F), uy));
  const Stop widen = hn::IfThenElseZero(level, all<Stop>(1e6F));
  const Stop zero = hn::Zero(StopTag());
  const Stop one = all<Stop>(1.0F);
  const int most = hn::GetLane(
      hn::MaxOfLanes(StopIntegers(), hn::IfThenZeroElse(missing, range.last - range.first)));
  const Stop first = from_integer<Stop>(range.first);
  const hn::RebindToUnsigned<StopTag> masks;
  const auto column = hn::BitCast(masks, across.first);
  auto low = hn::Zero(masks);
  auto high = hn::Zero(masks);
  for (int k = 0; k <= most; ++k) {
    const Stop row = first + all<Stop>(static_cast<float>(k));
    const Stop top = hn::MulAdd(row, all<Stop>(block_side), all<Stop>(0.5F)) - y;
    const Stop a = (top - radius) * inverse;
    const Stop b = (top + all<Stop>(block_side - 1) + radius) * inverse;
    const Stop from = clamped(hn::Min(a, b) - widen, zero, one);
    const Stop to = clamped(hn::Max(a, b) + widen, zero, one);
    const Stop xa = hn::MulAdd(from, ux, x);
    const Stop xb = hn::MulAdd(to, ux, x);
    const auto here =
        range_masks(blocks_between(hn::Min(xa, xb) - radius, hn::Max(xa, xb) + radius, columns));
    hn::Store(here, masks, f.line_columns[k] + l);
    // Lines that end before row k may have bits here; so have those that reach beyond the window.
    const auto ends = hn::Gt(hn::Set(StopIntegers(), k), range.last - range.first);
    const auto shifted = hn::IfThenZeroElse(hn::RebindMask(masks, ends), hn::Shr(here, column));
    if (k < 4) {
      low = low | hn::ShiftLeftSame(shifted, 8 * k);
    } else if (k < window_side) {
      high = high | hn::ShiftLeftSame(shifted, 8 * (k - 4));
    }
  }
  hn::Store(across.first, StopIntegers(), f.line_column + l);
  hn::Store(low, masks, f.window_low + l);
  hn::Store(high, masks, f.window_high + l);
  const auto within = hn::Set(StopIntegers(), window_side);
  const auto windowed =
      hn::And(hn::Lt(range.last - range.first, within), hn::Lt(across.last - across.first, within));
  f.windowed |= static_cast<std::uint64_t>(bits_of<Stop>(hn::RebindMask(StopTag(), windowed)))
                << static_cast<unsigned>(l);
  return bits;
}

// Rows and columns of blocks that a row's splats may touch; which of `bits` touch any.
HWY_INLINE std::uint32_t find_splat_blocks(const Outline& outline, const Tile& tile, int l,
                                           std::uint32_t bits, Footing& f) {
  const Stop left = all<Stop>(static_cast<float>(tile.x));
  const Stop top = all<Stop>(static_cast<float>(tile.y));
  const Ranges across =
      blocks_between(outline.x.low - left, outline.x.high - left, blocks_of(tile.width));
  const Ranges down =
      blocks_between(outline.y.low - top, outline.y.high - top, blocks_of(tile.height));
  hn::Store(across.first, StopIntegers(), f.column_first + l);
  hn::Store(across.last, StopIntegers(), f.column_last + l);
  hn::Store(down.first, StopIntegers(), f.row_first + l);
  hn::Store(down.last, StopIntegers(), f.row_last + l);
  const auto missing = hn::Or(hn::Gt(across.first, across.last), hn::Gt(down.first, down.last));
  return bits & ~bits_of<Stop>(hn::RebindMask(StopTag(), missing));
}

inline Ribbon ribbon_at(const LineStyle& line, const Ribbons& r, int l) {
  Ribbon out = {r.x[l],
                r.y[l],
                r.ux[l],
                r.uy[l],
                r.inverse_u2[l],
                r.w0[l],
                r.depth_ratio[l],
                {r.tail[l][0], r.tail[l][1], r.tail[l][2]},
                {r.rise[l][0], r.rise[l][1], r.rise[l][2]},
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
inline Splat splat_at(const Prepared& p, int l) {
  const Splats& s = p.splats;
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
    out.z = p.stops.z[l];
    out.near = p.near;
  }
  out.strength = s.strength[l];
  for (int c = 0; c < 3; ++c) out.color[c] = p.densities.color[l][c];
  return out;
}

inline bool has(std::uint64_t bits, int l) { return (bits >> static_cast<unsigned>(l) & 1U) != 0; }

// One vector of a row of stops, made ready: see prepare_brick.
template <bool Lines, bool Medium, bool Perspective, bool Curved>
struct RowMaker {
  const Camera& camera;
  const Pass& pass;
  const Tile& tile;
  Hash3<std::uint32_t> key;
  Prepared& out;
  Rows rows;  // both are filled row by row
  Cells cells;

  RowMaker(const Camera& of_camera, const Pass& of_pass, const Tile& of_tile, Prepared& into)
      : camera(of_camera),
        pass(of_pass),
        tile(of_tile),
        key(hash_key(of_pass.line.seed, of_pass.line.epoch)),
        out(into) {}

  // What of the lanes from i on (`bits`) has a line or a splat, made ready at stop l.
  HWY_INLINE void make(int i, int l, std::uint32_t bits) {
    const CellLanes<Curved> cell(rows, cells, i);
    if (Lines) {
      const Winds winds = read_winds(pass, rows, i);
      std::uint32_t lines =
          bits & bits_of<Stop>(hn::Ge(winds.magnitude, all<Stop>(least_magnitude(pass.line))));
      if (lines != 0) {
        lines = prepare_ribbons<Perspective, Curved>(camera, pass, rows, out.stops, cell, winds,
                                                     key, i, l, lines, out.ribbons);
      }
      if (lines != 0) lines = find_line_blocks(pass.line, out.ribbons, tile, l, lines, out.footing);
      out.stops.lines |= static_cast<std::uint64_t>(lines) << static_cast<unsigned>(l);
    }
    if (Medium) {
      const Extinctions found = read_extinctions(pass, rows, i);
      std::uint32_t splats = bits & bits_of<Stop>(found.kept);
      if (splats == 0) return;
      store(found.rho, out.densities.rho + l);
      const Outline outline =
          prepare_splats<Perspective, Curved>(camera, out.stops, cell, l, found.rho, out.splats);
      splats = find_splat_blocks(outline, tile, l, splats, out.footing);
      out.stops.splats |= static_cast<std::uint64_t>(splats) << static_cast<unsigned>(l);
      for (; splats != 0; splats &= splats - 1U) {
        const int k = __builtin_ctz(splats);
        color_density(pass, rows.offset + rows.along_u[i + k], out.densities.color[l + k]);
      }
    }
  }
};

// Everything up to the pixels: what of a brick may touch the tile's open blocks, made ready.
template <bool Lines, bool Medium, bool Perspective, bool Curved>
void prepare_brick(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                   Prepared& out) {
  RowMaker<Lines, Medium, Perspective, Curved> maker(camera, pass, tile, out);
  Rows& rows = maker.rows;
  Stops& stops = out.stops;
  stops.lines = stops.splats = out.footing.windowed = 0;
  out.pass = &pass;
  out.near = camera.near;
  open_rows(pass, brick, rows);
  float reach[3];
  brick_reach(camera, pass, brick, reach);
  const Frustum frustum = frustum_of<Perspective>(camera, tile, reach, Lines ? pass.line.r2 : 0.0F);
  const bool partly = partly_closed(tile, brick);
  for (int j = 0; j < rows.v_count; ++j) {
    set_row(pass, j, rows);
    if (Curved) {
      place_curved_row(camera, pass, j, rows, stops);
    } else {
      place_row(camera, pass, j, rows, stops);
    }
    std::uint32_t bits = seen_in_row<Perspective>(camera, frustum, stops, j) & row_bits(rows);
    if (bits == 0) continue;
    if (partly &&
        !row_is_open<Perspective>(camera, frustum, stops, j, rows.u_count, !Curved, tile)) {
      tile.counters.occluded += __builtin_popcount(bits);
      continue;
    }
    if (Curved) {
      fill_cells(camera, pass, rows, maker.cells);
      bits &= maker.cells.solid;
    }
    for (int i = 0; i < brick_side; i += stop_lanes) {
      const std::uint32_t here = bits >> static_cast<unsigned>(i) & ((2U << (stop_lanes - 1)) - 1U);
      if (here != 0) maker.make(i, brick_side * j + i, here);
    }
  }
  stops.count = __builtin_popcountll(stops.lines | stops.splats);
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

inline float* block_at(const Tile& tile, int row, int column) {
  return tile.blocks + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * block_floats;
}

inline const float* rays_at(const Tile& tile, int row, int column) {
  return tile.rays + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * block_pixels;
}

inline float left_of(const Tile& tile, int column) {
  return static_cast<float>(tile.x + column * block_side);
}

inline float top_of(const Tile& tile, int row) {
  return static_cast<float>(tile.y + row * block_side);
}

// A block that lets nothing through any more is closed for all that lies behind.
inline void close_block(int row, std::uint32_t bit, Tile& tile) {
  tile.open[row] &= ~bit;
  tile.any_closed = 1;
}

HWY_INLINE void note_light(const Light& light, int row, std::uint32_t bit, Tile& tile) {
  if (!light.above(tile.stop)) close_block(row, bit, tile);
}

// The tile's open blocks within a window, as Footing has them.
inline std::uint64_t open_window(const Tile& tile, int row, int column) {
  std::uint64_t open = 0;
  for (int k = 0; k < window_side && row + k < tile_blocks; ++k) {
    const std::uint64_t here = tile.open[row + k] >> static_cast<unsigned>(column) & 0xffU;
    open |= here << static_cast<unsigned>(window_side * k);
  }
  return open;
}

// Pixels from a window's corner to each of its blocks.
struct WindowOffsets {
  float x[window_side * window_side];
  float y[window_side * window_side];
};

constexpr WindowOffsets window_offsets() {
  WindowOffsets offsets = {};
  for (int b = 0; b < window_side * window_side; ++b) {
    offsets.x[b] = static_cast<float>(b % window_side * block_side);
    offsets.y[b] = static_cast<float>(b / window_side * block_side);
  }
  return offsets;
}

constexpr WindowOffsets offsets_in_window = window_offsets();

// Composites one line into its blocks; how many.
template <Depth Along, int Style>
HWY_INLINE int draw_windowed(const RibbonLanes& lanes, const Footing& f, int l, Tile& tile) {
  const int row = f.line_first[l];
  const int column = f.line_column[l];
  std::uint64_t left = static_cast<std::uint64_t>(f.window_high[l]) << 32U | f.window_low[l];
  if (tile.any_closed != 0) left &= open_window(tile, row, column);
  const int blocks = __builtin_popcountll(left);
  const BlockPixels from_line = {all<Pixel>(left_of(tile, column)) - lanes.x,
                                 all<Pixel>(top_of(tile, row)) - lanes.y};
  float* corner = block_at(tile, row, column);
  for (; left != 0; left &= left - 1U) {
    const int at = __builtin_ctzll(left);
    const int down = at / window_side;
    const int across = at % window_side;
    const Light light = line_block<Along, Style>(
        lanes,
        {from_line.x + all<Pixel>(offsets_in_window.x[at]),
         from_line.y + all<Pixel>(offsets_in_window.y[at])},
        corner + static_cast<std::ptrdiff_t>(down * tile_blocks + across) * block_floats);
    if (!light.above(tile.stop)) {
      close_block(row + down, 1U << static_cast<unsigned>(column + across), tile);
    }
  }
  return blocks;
}

// The same for one that reaches farther than a window does.
template <Depth Along, int Style>
int draw_ribbon(const RibbonLanes& lanes, const Footing& f, int l, Tile& tile) {
  int blocks = 0;
  for (int row = f.line_first[l], k = 0; row <= f.line_last[l]; ++row, ++k) {
    std::uint32_t left = f.line_columns[k][l] & tile.open[row];
    blocks += __builtin_popcount(left);
    while (left != 0) {
      const int column = __builtin_ctz(left);
      const std::uint32_t bit = left & (~left + 1U);
      left ^= bit;
      const BlockPixels from_line = {all<Pixel>(left_of(tile, column)) - lanes.x,
                                     all<Pixel>(top_of(tile, row)) - lanes.y};
      note_light(line_block<Along, Style>(lanes, from_line, block_at(tile, row, column)), row, bit,
                 tile);
    }
  }
  return blocks;
}

template <bool Perspective, int Style>
HWY_INLINE void draw_line(const Prepared& p, int l, Tile& tile) {
  const RibbonLanes lanes = spread(p.pass->line, p.ribbons, l);
  const Footing& f = p.footing;
  constexpr Depth general = Perspective && Style != style_plain ? Depth::exact : Depth::flat;
  int blocks = 0;
  if (!has(f.windowed, l)) {
    blocks = draw_ribbon<general, Style>(lanes, f, l, tile);
  } else if (general == Depth::exact &&
             absolute(p.ribbons.depth_ratio[l] - 1.0F) <= series_bend_max) {
    blocks = draw_windowed<Depth::series, Style>(lanes, f, l, tile);
  } else {
    blocks = draw_windowed<general, Style>(lanes, f, l, tile);
  }
  tile.counters.pixel_updates += std::int64_t{blocks} * block_pixels;
}

template <bool Perspective>
void draw_styled(const Prepared& p, int style, int l, Tile& tile) {
  if (style == style_head) {
    draw_line<Perspective, style_head>(p, l, tile);
  } else if (style == style_moving) {
    draw_line<Perspective, style_moving>(p, l, tile);
  } else {
    draw_line<Perspective, style_plain>(p, l, tile);
  }
}

// A kernel whose splat the near plane may cut.
template <bool Perspective>
inline bool is_near(const Prepared& p, int l) {
  return Perspective && p.stops.z[l] - 2.0F * p.splats.half_depth[l] < p.near;
}

// Composites one kernel that has a splat, and perhaps a line.
template <bool Perspective>
void draw_kernel(const Prepared& p, const Compositor& with, int style, int l, Tile& tile) {
  const Footing& f = p.footing;
  const bool lined = has(p.stops.lines, l);
  const Splat splat = splat_at<Perspective>(p, l);
  Ribbon ribbon;
  if (lined) ribbon = ribbon_at(p.pass->line, p.ribbons, l);
  const bool near = is_near<Perspective>(p, l);
  const SplatFunction splat_function = near ? with.near_splat : with.splat;
  const BothFunction both_function = near ? with.near_both : with.both;
  const std::uint32_t columns = range_mask({f.column_first[l], f.column_last[l]});
  const int first = lined && f.line_first[l] < f.row_first[l] ? f.line_first[l] : f.row_first[l];
  const int last = lined && f.line_last[l] > f.row_last[l] ? f.line_last[l] : f.row_last[l];
  for (int row = first; row <= last; ++row) {
    const bool with_line = lined && row >= f.line_first[l] && row <= f.line_last[l];
    const std::uint32_t lines = with_line ? f.line_columns[row - f.line_first[l]][l] : 0;
    const std::uint32_t splats = row >= f.row_first[l] && row <= f.row_last[l] ? columns : 0;
    std::uint32_t left = (lines | splats) & tile.open[row];
    tile.counters.pixel_updates += std::int64_t{__builtin_popcount(left)} * block_pixels;
    tile.counters.exponentials +=
        std::int64_t{__builtin_popcount(left & splats & ~lines) * with.splat_exponentials +
                     __builtin_popcount(left & splats & lines) * with.both_exponentials} *
        block_pixels;
    while (left != 0) {
      const int column = __builtin_ctz(left);
      const std::uint32_t bit = left & (~left + 1U);
      left ^= bit;
      const float x = left_of(tile, column);
      const float y = top_of(tile, row);
      const float* ray = Perspective ? rays_at(tile, row, column) : nullptr;
      float* block = block_at(tile, row, column);
      if ((lines & splats & bit) != 0) {
        note_light(both_function(ribbon, splat, x, y, ray, block), row, bit, tile);
      } else if ((splats & bit) != 0) {
        note_light(splat_function(splat, x, y, ray, block), row, bit, tile);
      } else {
        const RibbonLanes lanes = spread(ribbon);
        const BlockPixels at = {all<Pixel>(x) - lanes.x, all<Pixel>(y) - lanes.y};
        constexpr Depth along = Perspective ? Depth::exact : Depth::flat;
        note_light(style == style_moving ? line_block<along, style_moving>(lanes, at, block)
                                         : line_block<along, style_head>(lanes, at, block),
                   row, bit, tile);
      }
    }
  }
}

template <bool Perspective>
HWY_INLINE void draw_stop(const Prepared& p, const Compositor& with, int style, int l, Tile& tile) {
  if (has(p.stops.splats, l)) {
    draw_kernel<Perspective>(p, with, style, l, tile);
  } else {
    draw_styled<Perspective>(p, style, l, tile);
  }
}

// A brick's kernels in visibility order: rows outward from the eye's, stops outward in each.
template <bool Perspective>
void draw_in_order(const Brick& brick, const Prepared& p, Tile& tile) {
  const Pass& pass = *p.pass;
  const int* us = pass.axis[pass.u].visit + brick.u_first;
  const int* vs = pass.axis[pass.v].visit + brick.v_first;
  const int u_low = lowest(us);
  const int v_low = lowest(vs);
  const std::uint64_t kept = p.stops.lines | p.stops.splats;
  const Compositor with = compositor_of<Perspective>(pass);
  const int style = style_of(pass.line);
  for (int j = 0; j < brick.v_count; ++j) {
    const int row = brick_side * (vs[j] - v_low);
    if ((kept >> static_cast<unsigned>(row) & 0xffU) == 0) continue;
    for (int i = 0; i < brick.u_count; ++i) {
      const int l = row + us[i] - u_low;
      if (has(kept, l)) draw_stop<Perspective>(p, with, style, l, tile);
    }
  }
}

// A row's samples lie on one cache line or two.
inline void prefetch_row(const float* from, std::int64_t length) {
  __builtin_prefetch(from);
  __builtin_prefetch(from + length - 1);
}

// Brings a brick's samples closer while the one before it is drawn: rows of a brick are far apart
// in memory, which no processor guesses.
void prefetch_brick(const Pass& pass, const Brick& brick) {
  const Axis& u = pass.axis[pass.u];
  const Axis& v = pass.axis[pass.v];
  const Axis& major = pass.axis[pass.major];
  const std::int64_t slab = pass.step[pass.major] * major.sample[major.visit[brick.slab]];
  const std::int64_t first = slab + pass.step[pass.u] * u.sample[lowest(u.visit + brick.u_first)];
  for (int j = 0; j < brick.v_count; ++j) {
    const std::int64_t at = first + pass.step[pass.v] * v.sample[v.visit[brick.v_first + j]];
    if (pass.has_lines != 0) {
      for (const float* values : pass.line.velocity) {
        if (values != nullptr) prefetch_row(values + at, brick.u_count);
      }
    }
    for (int k = 0; k < pass.medium.layers; ++k) {
      prefetch_row(pass.medium.layer[k].values + at, brick.u_count);
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

void draw_prepared(const Camera& camera, const Prepared& p, int stop, Tile& tile) {
  const int style = style_of(p.pass->line);
  if (camera.perspective != 0) {
    draw_stop<true>(p, compositor_of<true>(*p.pass), style, stop, tile);
  } else {
    draw_stop<false>(p, compositor_of<false>(*p.pass), style, stop, tile);
  }
}

void draw(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile) {
  Prepared prepared;
  prepare(camera, pass, brick, tile, prepared);
  if (prepared.stops.count == 0) return;
  if (camera.perspective != 0) {
    draw_in_order<true>(brick, prepared, tile);
  } else {
    draw_in_order<false>(brick, prepared, tile);
  }
}

int count_open(const Tile& tile) {
  int open = 0;
  for (const std::uint32_t row : tile.open) open += __builtin_popcount(row);
  return open;
}

}  // namespace
}  // namespace windsplat::engine::kernels
