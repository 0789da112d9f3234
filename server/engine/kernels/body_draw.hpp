// Part of the kernel body: composites the prepared lines and splats of a brick into the blocks of a
// tile, front to back.
#pragma once

#include "server/engine/kernels/body_composite.hpp"
#include "server/engine/kernels/body_forms.hpp"
#include "server/engine/kernels/body_opaque.hpp"
#include "server/engine/kernels/body_pixels.hpp"
#include "server/engine/kernels/body_prepare.hpp"

namespace windsplat::engine::kernels {
namespace {

// Joins the two halves of a window as stored in Footing.
inline std::uint64_t joined(std::uint32_t high, std::uint32_t low) {
  return static_cast<std::uint64_t>(high) << 32U | low;
}

// Composites one line into its blocks. Returns their number.
template <Depth Along, int Style>
KERNEL_INLINE int draw_windowed(const RibbonLanes& lanes, const Footing& f, int l, Tile& tile) {
  const int row = f.line_first[l];
  const int column = f.line_column[l];
  std::uint64_t left = joined(f.window_high[l], f.window_low[l]);
  if (tile.any_closed != 0) left &= open_window(tile, row, column);
  const int blocks = __builtin_popcountll(left);
  const BlockPixels from_line = {all<Pixel>(left_of(tile, column)) - lanes.x,
                                 all<Pixel>(top_of(tile, row)) - lanes.y};
  float* corner = block_at(tile, row, column);
  for (; left != 0; left &= left - 1U) {
    const int at = __builtin_ctzll(left);
    const std::ptrdiff_t block = offsets_in_window.block[at];
    const Light light = line_block<Along, Style>(
        lanes, from_line,
        {all<Pixel>(offsets_in_window.x[at]), all<Pixel>(offsets_in_window.y[at])},
        &corner[block * block_floats]);
    if (!light.above(tile.stop)) {
      mark_closed(row + at / window_side, 1U << static_cast<unsigned>(column + at % window_side),
                  tile);
    }
  }
  return blocks;
}

// The same for a line larger than a window.
template <Depth Along, int Style>
int draw_ribbon(const RibbonLanes& lanes, const Footing& f, int l, Tile& tile) {
  int blocks = 0;
  const BlockPixels none = {hn::Zero(PixelTag()), hn::Zero(PixelTag())};
  for (int row = f.line_first[l], k = 0; row <= f.line_last[l]; ++row, ++k) {
    std::uint32_t left = f.line_columns[k][l] & tile.open[row];
    blocks += __builtin_popcount(left);
    while (left != 0) {
      const int column = __builtin_ctz(left);
      const std::uint32_t bit = left & (~left + 1U);
      left ^= bit;
      const BlockPixels from_line = {all<Pixel>(left_of(tile, column)) - lanes.x,
                                     all<Pixel>(top_of(tile, row)) - lanes.y};
      note_light(line_block<Along, Style>(lanes, from_line, none, block_at(tile, row, column)), row,
                 bit, tile);
    }
  }
  return blocks;
}

template <bool Perspective, int Style>
KERNEL_INLINE void draw_line(const Prepared& p, int l, Tile& tile) {
  const RibbonLanes lanes = spread(p.pass->line, p.ribbons, l);
  const Footing& f = p.footing;
  constexpr Depth general = Perspective && Style != style_plain ? Depth::exact : Depth::flat;
  int blocks = 0;
  if (!has(f.windowed, l)) {
    blocks = draw_ribbon<general, Style>(lanes, f, l, tile);
  } else if (general == Depth::exact && absolute(p.ribbons.bend[l]) <= series_bend_max) {
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
  } else if (style == style_general) {
    draw_line<Perspective, style_general>(p, l, tile);
  } else if (style == style_chain) {
    draw_line<Perspective, style_chain>(p, l, tile);
  } else {
    draw_line<Perspective, style_plain>(p, l, tile);
  }
}

// Start of the rays through a splat.
template <bool Perspective>
inline From from_of(const Prepared& p, int l) {
  if (!Perspective) return From::eye;
  const Splats& s = p.splats;
  if (has(s.near, l)) return From::near_plane;
  return s.ex[l] == s.x[l] && s.ey[l] == s.y[l] ? From::eye_inside : From::eye;
}

// Rows and columns of blocks, both ends included.
struct Box {
  int row, row_last, column, column_last;
};

inline Box splat_box(const Footing& f, int l) {
  return {f.row_first[l], f.row_last[l], f.column_first[l], f.column_last[l]};
}

inline Box line_box(const Footing& f, int l) {
  return {f.line_first[l], f.line_last[l], f.line_column[l], f.line_column_last[l]};
}

inline Box united(const Box& a, const Box& b) {
  return {a.row < b.row ? a.row : b.row, a.row_last > b.row_last ? a.row_last : b.row_last,
          a.column < b.column ? a.column : b.column,
          a.column_last > b.column_last ? a.column_last : b.column_last};
}

inline bool within_window(const Box& box) {
  return box.row_last - box.row < window_side && box.column_last - box.column < window_side;
}

// Converts the blocks of a window to another window that contains them all; its corner must not lie
// right of or below the first.
inline std::uint64_t moved(std::uint64_t blocks, const Box& from, const Window& to) {
  return blocks << static_cast<unsigned>(window_side * (from.row - to.row) + from.column -
                                         to.column);
}

// The blocks of a window that are set in row_of(row), for outlines larger than a window.
template <class RowOf>
inline std::uint64_t in_window(const Box& box, const Window& window, const RowOf& row_of) {
  std::uint64_t blocks = 0;
  for (int k = 0; k < window_side; ++k) {
    const int row = window.row + k;
    if (row < box.row || row > box.row_last) continue;
    const std::uint64_t here = row_of(row) >> static_cast<unsigned>(window.column) & 0xffU;
    blocks |= here << static_cast<unsigned>(window_side * k);
  }
  return blocks;
}

// A kernel with a splat and optionally a line.
struct KernelDrawing {
  const Compositor& with;
  Tile& tile;
  Splat splat;
  Ribbon ribbon;
  int from;

  // `lines`, `splats`: blocks of the window that the line and the splat may touch.
  KERNEL_INLINE void draw(int row, int column, std::uint64_t lines, std::uint64_t splats) const {
    if (tile.any_closed != 0) {
      const std::uint64_t open = open_window(tile, row, column);
      lines &= open;
      splats &= open;
    }
    const std::uint64_t both = lines & splats;
    const std::uint64_t splat_alone = splats & ~both;
    const std::uint64_t line_alone = lines & ~both;
    if (both != 0) with.both[from](ribbon, splat, {row, column, both}, tile);
    if (splat_alone != 0) with.splat[from](splat, {row, column, splat_alone}, tile);
    if (line_alone != 0) with.line(ribbon, {row, column, line_alone}, tile);
    const int exponentials = __builtin_popcountll(splat_alone) * with.splat_exponentials +
                             __builtin_popcountll(both) * with.both_exponentials;
    tile.counters.pixel_updates +=
        std::int64_t{__builtin_popcountll(lines | splats)} * block_pixels;
    tile.counters.exponentials += std::int64_t{exponentials} * block_pixels;
  }
};

// Calls draw(row, column, lines, splats) for each window of a kernel, with the blocks of the window
// that its line and its splat may touch.
template <class Draw>
KERNEL_INLINE void each_window(const Footing& f, int l, bool lined, bool splatted,
                               const Draw& draw) {
  const Box splat = splatted ? splat_box(f, l) : line_box(f, l);
  const Box line = lined ? line_box(f, l) : splat;
  const Box box = united(splat, line);
  if (within_window(box)) {
    const Window window = {box.row, box.column, 0};
    const std::uint64_t lines =
        lined ? moved(joined(f.window_high[l], f.window_low[l]), line, window) : 0;
    const std::uint64_t splats =
        splatted ? moved(joined(f.splat_high[l], f.splat_low[l]), splat, window) : 0;
    draw(box.row, box.column, lines, splats);
    return;
  }
  const std::uint32_t columns = range_mask({splat.column, splat.column_last});
  for (int row = box.row; row <= box.row_last; row += window_side) {
    for (int column = box.column; column <= box.column_last; column += window_side) {
      const Window window = {row, column, 0};
      std::uint64_t lines = 0;
      if (lined) {
        lines = in_window(line, window, [&](int at) { return f.line_columns[at - line.row][l]; });
      }
      std::uint64_t splats = 0;
      if (splatted) splats = in_window(splat, window, [&](int) { return columns; });
      draw(row, column, lines, splats);
    }
  }
}

// Draws a splat from afar that is within a window.
inline void draw_afar(const Prepared& p, const Compositor& with, int l, Tile& tile) {
  const Footing& f = p.footing;
  const int row = f.row_first[l];
  const int column = f.column_first[l];
  std::uint64_t blocks = joined(f.splat_high[l], f.splat_low[l]);
  if (tile.any_closed != 0) blocks &= open_window(tile, row, column);
  if (blocks == 0) return;
  with.afar(p, l, {row, column, blocks}, tile);
  const std::int64_t pixels = std::int64_t{__builtin_popcountll(blocks)} * block_pixels;
  tile.counters.pixel_updates += pixels;
  tile.counters.exponentials += pixels * with.splat_exponentials;
}

template <bool Perspective>
void draw_kernel(const Prepared& p, const Compositor& with, int l, Tile& tile) {
  const bool lined = has(p.positions.lines, l);
  if (Perspective && !lined && has(p.splats.afar, l) && within_window(splat_box(p.footing, l))) {
    return draw_afar(p, with, l, tile);
  }
  KernelDrawing kernel = {
      with, tile, splat_at<Perspective>(p, l), {}, static_cast<int>(from_of<Perspective>(p, l))};
  if (lined) kernel.ribbon = ribbon_at(p.pass->line, p.ribbons, l);
  each_window(p.footing, l, lined, true,
              [&](int row, int column, std::uint64_t lines, std::uint64_t splats) {
                kernel.draw(row, column, lines, splats);
              });
}

template <bool Perspective>
void draw_or_line(const Prepared& p, const Compositor& with, int l, Tile& tile) {
  KernelDrawing kernel = {
      with, tile, {}, ribbon_at(p.pass->line, p.ribbons, l), static_cast<int>(From::eye)};
  each_window(p.footing, l, true, false,
              [&](int row, int column, std::uint64_t lines, std::uint64_t splats) {
                kernel.draw(row, column, lines, splats);
              });
}

// The cell along a ray of a splat extends to sqrt(t^2 + 1/4) strides from the centre, the
// silhouette to t.
inline KernelDepths depths_of(const Prepared& p, int l) {
  const float centre = p.positions.depth[l];
  KernelDepths depths = {body_nowhere, -body_nowhere};
  const auto reach = [&](float a, float b) {
    depths.first = smaller(depths.first, smaller(a, b));
    depths.last = larger(depths.last, larger(a, b));
  };
  if (has(p.positions.lines, l)) {
    const float from = centre + p.ribbons.depth[l];
    reach(from, from + p.ribbons.depth_rise[l]);
  }
  if (has(p.positions.splats, l)) {
    constexpr float cell_share = 1.07F;
    const float half = cell_share * p.splats.half_depth[l];
    reach(centre - half, centre + half);
  }
  return depths;
}

// Whether a surface divides or hides a kernel.
inline bool meets_body(const Prepared& p, const KernelDepths& depths, int l, const Tile& tile) {
  const bool layered = tile.layers > 0 && depths.last > tile.layer[0].nearest;
  if (depths.last <= tile.body->nearest && !layered) return false;
  bool meets = false;
  each_window(p.footing, l, has(p.positions.lines, l), has(p.positions.splats, l),
              [&](int row, int column, std::uint64_t lines, std::uint64_t splats) {
                const BodyWindow found = at_body(tile, depths, {row, column, lines | splats});
                meets = meets || (found.hidden | found.divided) != 0;
              });
  return meets;
}

// Draws a kernel that a surface divides or hides.
template <bool Perspective>
void draw_at_body(const Prepared& p, const Compositor& with, const KernelDepths& depths, int l,
                  Tile& tile) {
  const bool lined = has(p.positions.lines, l);
  const bool splatted = has(p.positions.splats, l);
  KernelDrawing kernel = {with, tile, {}, {}, static_cast<int>(From::eye)};
  if (lined) kernel.ribbon = ribbon_at(p.pass->line, p.ribbons, l);
  if (splatted) {
    kernel.splat = splat_at<Perspective>(p, l);
    kernel.from = static_cast<int>(from_of<Perspective>(p, l));
  }
  const int near = kernel.from == static_cast<int>(From::near_plane) ? 1 : 0;
  const DividedKernel divided = {&kernel.ribbon, &kernel.splat, near, p.positions.depth[l]};
  each_window(p.footing, l, lined, splatted,
              [&](int row, int column, std::uint64_t lines, std::uint64_t splats) {
                std::uint64_t open = lines | splats;
                if (tile.any_closed != 0) open &= open_window(tile, row, column);
                const BodyWindow found = at_body(tile, depths, {row, column, open});
                const std::uint64_t before = open & ~(found.hidden | found.divided);
                kernel.draw(row, column, lines & before, splats & before);
                draw_divided<Perspective>(divided, p.pass->compositing, row, column,
                                          lines & found.divided, splats & found.divided, tile);
              });
}

template <bool Perspective>
KERNEL_INLINE void draw_position(const Prepared& p, const Compositor& with, int style, int l,
                                 Tile& tile) {
  if (tile.body != nullptr) {
    const KernelDepths depths = depths_of(p, l);
    if (meets_body(p, depths, l, tile)) {
      return draw_at_body<Perspective>(p, with, depths, l, tile);
    }
  }
  if (has(p.positions.splats, l)) {
    draw_kernel<Perspective>(p, with, l, tile);
  } else if (p.pass->compositing == compositing_or) {
    draw_or_line<Perspective>(p, with, l, tile);
  } else {
    draw_styled<Perspective>(p, style, l, tile);
  }
}

// Holds, for each subset of a row, the indices of its members, one per byte, ascending.
struct RowIndices {
  std::uint64_t of[256];
};

constexpr RowIndices make_row_indices() {
  RowIndices indices = {};
  for (unsigned bits = 0; bits < 256; ++bits) {
    unsigned n = 0;
    for (unsigned i = 0; i < brick_side; ++i) {
      if ((bits >> i & 1U) != 0) indices.of[bits] |= std::uint64_t{i} << (8 * n++);
    }
  }
  return indices;
}

constexpr RowIndices row_indices = make_row_indices();

// Lists the kernel positions of a brick in visibility order: rows outward from the eye, positions
// outward in each. Returns their number. `order` must have room for brick_side more.
inline int order_positions(const Brick& brick, const Pass& pass, std::uint64_t kept,
                           std::uint8_t* order) {
  const int* us = pass.axis[pass.u].visit + brick.u_first;
  const int* vs = pass.axis[pass.v].visit + brick.v_first;
  const int u_low = lowest(us);
  const int v_low = lowest(vs);
  const bool ascending = us[0] == u_low;
  int n = 0;
  for (int j = 0; j < brick.v_count; ++j) {
    const std::uint32_t bits = row_at(kept, vs[j] - v_low);
    const int row = brick_side * (vs[j] - v_low);
    if (ascending) {
      const std::uint64_t indices =
          row_indices.of[bits] + static_cast<std::uint64_t>(row) * 0x0101010101010101U;
      __builtin_memcpy(order + n, &indices, sizeof indices);
      n += __builtin_popcount(bits);
      continue;
    }
    for (int i = 0; i < brick.u_count; ++i) {
      const int l = row + us[i] - u_low;
      order[n] = static_cast<std::uint8_t>(l);
      n += has(kept, l) ? 1 : 0;
    }
  }
  return n;
}

template <bool Perspective>
void draw_in_order(const Brick& brick, const Prepared& p, Tile& tile) {
  const Pass& pass = *p.pass;
  const int style = signature_of(pass.line);
  std::uint8_t order[brick_kernels + brick_side];
  const int count = order_positions(brick, pass, p.positions.lines | p.positions.splats, order);
  const Compositor with = compositor_of<Perspective>(pass);
  for (int i = 0; i < count; ++i) draw_position<Perspective>(p, with, style, order[i], tile);
}

// The samples of a row occupy one or two cache lines.
inline void prefetch_row(const float* from, std::int64_t length) {
  const float* last = from + length - 1;
  __builtin_prefetch(from);
  constexpr std::uintptr_t line = 64;  // bytes
  if (reinterpret_cast<std::uintptr_t>(from) / line !=
      reinterpret_cast<std::uintptr_t>(last) / line) {
    __builtin_prefetch(last);
  }
}

// Prefetches the samples of a brick while the one before it is drawn: its rows are far apart in
// memory, so that hardware prefetching does not help.
void prefetch_brick(const Pass& pass, const Brick& brick) {
  const Axis& u = pass.axis[pass.u];
  const Axis& v = pass.axis[pass.v];
  const Axis& major = pass.axis[pass.major];
  int kernel[3];
  kernel[pass.major] = major.visit[brick.sheet];
  kernel[pass.u] = lowest(u.visit + brick.u_first);
  kernel[pass.v] = lowest(v.visit + brick.v_first);
  const std::int64_t first = origin_at(pass, kernel) +
                             pass.step[pass.major] * major.field_index[kernel[pass.major]] +
                             pass.step[pass.u] * u.field_index[kernel[pass.u]];
  for (int j = 0; j < brick.v_count; ++j) {
    const std::int64_t at = first + pass.step[pass.v] * v.field_index[v.visit[brick.v_first + j]];
    if (brick.lines != 0) {
      for (const float* values : pass.line.velocity) {
        if (values != nullptr) prefetch_row(values + at, brick.u_count);
      }
    }
    for (int k = 0; brick.splats != 0 && k < pass.medium.layers; ++k) {
      const MediumLayer& layer = pass.medium.layer[k];
      prefetch_row(layer.values + at, brick.u_count);
      if (layer.share != nullptr) prefetch_row(layer.share + at, brick.u_count);
    }
  }
}

void draw_prepared(const Camera& camera, const Prepared& p, int position, Tile& tile) {
  const int style = signature_of(p.pass->line);
  if (camera.perspective != 0) {
    draw_position<true>(p, compositor_of<true>(*p.pass), style, position, tile);
  } else {
    draw_position<false>(p, compositor_of<false>(*p.pass), style, position, tile);
  }
}

void draw(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile) {
  Prepared prepared;
  prepare(camera, pass, brick, tile, prepared);
  if (prepared.positions.count == 0) return;
  if (camera.perspective != 0) {
    draw_in_order<true>(brick, prepared, tile);
  } else {
    draw_in_order<false>(brick, prepared, tile);
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
