// Part of the kernel body: records the lines of the slab method for the blocks they cross; meets
// them in a block within a slab or a part of it, and sorts them in every pixel.
#pragma once

#include "server/engine/kernels/body_gather.hpp"

namespace windsplat::engine::kernels {
namespace {

inline RibbonRecord ribbon_record(const LineStyle& line, const Prepared& p, int l) {
  RibbonRecord out = {ribbon_at(line, p.ribbons, l), style_of(line), 0};
  out.ribbon.depth += p.positions.depth[l];
  out.bent = absolute(out.ribbon.bend) > series_bend_max ? 1 : 0;
  return out;
}

// The range of depths of a line at the pixels of the blocks of one row, one lane per column.
struct DepthRange {
  Pixel first, last;
};

template <bool Perspective>
KERNEL_INLINE DepthRange row_depths(const Ribbon& r, float margin, Pixel x, float y) {
  constexpr float farthest = 0.5F * (block_side - 1);  // largest distance of pixel centres from the
                                                       // block centre
  const auto depth_at = [&](Pixel along) {
    const Pixel w = clamped(along, 0.0F, 1.0F);
    const Pixel one = all<Pixel>(1.0F);
    const Pixel f =
        Perspective ? w * all<Pixel>(r.depth_ratio) / hn::MulAdd(w, all<Pixel>(r.bend), one) : w;
    return hn::MulAdd(f, all<Pixel>(r.depth_rise), all<Pixel>(r.depth));
  };
  const Pixel w =
      hn::MulAdd(x - all<Pixel>(r.x), all<Pixel>(r.wx), all<Pixel>((y - r.y) * r.wy + r.w0));
  const Pixel reach = all<Pixel>(farthest * (absolute(r.wx) + absolute(r.wy)));
  const Pixel a = depth_at(w - reach);
  const Pixel b = depth_at(w + reach);
  // Margin for rounding of the depths of the line and of the slab faces.
  constexpr float rounding = 1e-6F;
  const Pixel slack =
      hn::MulAdd(hn::Max(hn::Abs(a), hn::Abs(b)), all<Pixel>(rounding), all<Pixel>(margin));
  return {hn::Min(a, b) - slack, hn::Max(a, b) + slack};
}

// Lists the open blocks that line l may touch. Returns their number.
template <bool Perspective>
KERNEL_INLINE int list_hits(const RibbonRecord& line, const Footing& f, int l, std::uint32_t slot,
                            float margin, const Tile& tile, Hit* hits) {
  constexpr float middle = 0.5F * block_side;
  int n = 0;
  for (int row = f.line_first[l], k = 0; row <= f.line_last[l]; ++row, ++k) {
    std::uint32_t left = f.line_columns[k][l] & tile.open[row];
    while (left != 0) {
      const int from = __builtin_ctz(left);
      const Pixel x = hn::MulAdd(hn::Iota(PixelTag(), 0), all<Pixel>(block_side),
                                 all<Pixel>(left_of(tile, from) + middle));
      const DepthRange range =
          row_depths<Perspective>(line.ribbon, margin, x, top_of(tile, row) + middle);
      alignas(64) float first[block_pixels];
      alignas(64) float last[block_pixels];
      store(range.first, first);
      store(range.last, last);
      std::uint32_t here = left >> static_cast<unsigned>(from) & ((2U << (pixel_lanes - 1)) - 1U);
      left &= ~(here << static_cast<unsigned>(from));
      for (; here != 0; here &= here - 1U) {
        const int c = __builtin_ctz(here);
        hits[n++] = {slot, row * tile_blocks + from + c, first[c], last[c]};
      }
    }
  }
  return n;
}

template <bool Perspective>
int pack_lines_on(const Prepared& p, float slab_depth, const std::uint32_t* slots, const Tile& tile,
                  RibbonRecord* records, Hit* hits, int* counts) {
  const float margin = 1e-4F * slab_depth;
  int n = 0;
  for (std::uint64_t left = p.positions.lines; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    RibbonRecord& record = records[slots[n]];
    record = ribbon_record(p.pass->line, p, l);
    const int count = list_hits<Perspective>(record, p.footing, l, slots[n], margin, tile, hits);
    if (count == 0) continue;
    hits += count;
    counts[n++] = count;
  }
  return n;
}

int pack_lines(const Camera& camera, const Prepared& p, float slab_depth,
               const std::uint32_t* slots, const Tile& tile, RibbonRecord* records, Hit* hits,
               int* counts) {
  return camera.perspective != 0
             ? pack_lines_on<true>(p, slab_depth, slots, tile, records, hits, counts)
             : pack_lines_on<false>(p, slab_depth, slots, tile, records, hits, counts);
}

// A line at the pixels of a block; opacity 0 where a pixel does not meet it.
struct BlockHit {
  alignas(64) float x_line[block_pixels];  // through the slab, 0 to 1
  alignas(64) float opacity[block_pixels];
  alignas(64) float color[3][block_pixels];
};
// Sorted together; exact if no line is displaced by more than half.
constexpr int block_hits_max = 64;

// A line at a vector of pixels within the slab.
struct LaneHit {
  MaskOf<Pixel> here;  // the line covers the pixel, in this slab
  Pixel opacity;       // 0 elsewhere
  Pixel depth;
  Pixel f;
  Pixel light;  // part of the opacity that has light
};

// A slab or a part of it.
struct Between {
  float front;
  float back;
};

template <Depth Along, int Style>
KERNEL_INLINE LaneHit hit_lanes(const RibbonRecord& line, Between slab, Pixel px, Pixel py) {
  const RibbonLanes r = spread(line.ribbon);
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel w =
      clamped(hn::MulAdd(px - r.x, r.wx, hn::MulAdd(py - r.y, r.wy, r.w0)), zero, all<Pixel>(1.0F));
  const Pixel f = along_ribbon<Along>(r, w);
  const Pixel depth =
      hn::MulAdd(f, all<Pixel>(line.ribbon.depth_rise), all<Pixel>(line.ribbon.depth));
  const auto inside =
      hn::And(hn::Ge(depth, all<Pixel>(slab.front)), hn::Lt(depth, all<Pixel>(slab.back)));
  // Early exit: most candidates pass the block in another slab.
  if (hn::AllFalse(PixelTag(), inside)) return {inside, zero, depth, f, zero};
  const RibbonLane lane = ribbon_lane<Along, Style>(r, px - r.x, py - r.y);
  const auto here = hn::And(inside, hn::Gt(lane.opacity, zero));
  return {here, hn::IfThenElseZero(here, lane.opacity), depth, f, lane.light};
}

template <Depth Along>
KERNEL_INLINE LaneHit hit_lanes(const RibbonRecord& line, Between slab, Pixel px, Pixel py) {
  if (line.style == style_chain) return hit_lanes<Along, style_chain>(line, slab, px, py);
  return line.style == style_general ? hit_lanes<Along, style_general>(line, slab, px, py)
                                     : hit_lanes<Along, style_head>(line, slab, px, py);
}

template <bool Perspective>
KERNEL_INLINE LaneHit hit_lanes(const RibbonRecord& line, Between slab, Pixel px, Pixel py) {
  if (!Perspective) return hit_lanes<Depth::flat>(line, slab, px, py);
  return line.bent == 0 ? hit_lanes<Depth::series>(line, slab, px, py)
                        : hit_lanes<Depth::exact>(line, slab, px, py);
}

// One channel of the straight colour of a line where it is met.
KERNEL_INLINE Pixel hit_color(const RibbonRecord& line, const LaneHit& at, int c) {
  return at.light *
         hn::MulAdd(at.f, all<Pixel>(line.ribbon.rise[c]), all<Pixel>(line.ribbon.tail[c]));
}

KERNEL_INLINE Pixel fraction_in(const Slab& slab, Pixel depth) {
  const Pixel inverse = all<Pixel>(1.0F / (slab.back - slab.begin));
  return clamped((depth - all<Pixel>(slab.begin)) * inverse, 0.0F, 1.0F);
}

// Returns whether any pixel meets the line in a part of the slab.
template <bool Perspective>
KERNEL_INLINE bool hit_block(const RibbonRecord& line, const Slab& slab, Between part, float x,
                             float y, BlockHit& m) {
  bool any = false;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel px = all<Pixel>(x) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(y) + load<Pixel>(lane_y + l);
    const LaneHit at = hit_lanes<Perspective>(line, part, px, py);
    any = any || !hn::AllFalse(PixelTag(), at.here);
    store(fraction_in(slab, at.depth), m.x_line + l);
    store(at.opacity, m.opacity + l);
    for (int c = 0; c < 3; ++c) store(hit_color(line, at, c), m.color[c] + l);
  }
  return any;
}

// The part of the slab before the body, by pixel: the medium of pixels that it covers entirely ends
// there (body_limit), and x_line is relative to it. 1 for other pixels.
struct BodyShare {
  alignas(64) float before[block_pixels];
};

KERNEL_INLINE void open_share(const Slab& slab, const BodyBlock& body, BodyShare& share) {
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel before = fraction_in(slab, body_limit(body, l));
    store(hn::Max(before, all<Pixel>(1e-6F)), share.before + l);
  }
}

inline void scale_hit(const BodyShare& share, BlockHit& m) {
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    store(load<Pixel>(m.x_line + l) / load<Pixel>(share.before + l), m.x_line + l);
  }
}

// The body as a line that covers its pixels, where it is in front of the end of the slab and still
// waits for light; it no longer does then.
inline void take_body(const Slab& slab, BodyBlock& body, BlockHit& m) {
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel one = all<Pixel>(1.0F);
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel depth = load<Pixel>(body.depth + l);
    const Pixel opacity = load<Pixel>(body.opacity + l);
    const auto here = hn::And(hn::Lt(depth, all<Pixel>(slab.back)), hn::Gt(opacity, zero));
    // Behind the medium before it, or before everything in the slab.
    const Pixel end = hn::IfThenElse(hn::Le(depth, all<Pixel>(slab.front)), hn::Neg(one), one);
    const Pixel x_line = hn::IfThenElse(hn::Ge(opacity, one), end, fraction_in(slab, depth));
    store(x_line, m.x_line + l);
    // With the lines combined by `or` that are seen beside the body, where there are any.
    const Pixel behind = load<Pixel>(body.behind + l);
    const auto lined = hn::Lt(behind, one - opacity);
    const Pixel all_opacity = hn::IfThenElse(lined, one - behind, opacity);
    const Pixel inverse = one / hn::Max(all_opacity, all<Pixel>(1e-37F));
    store(hn::IfThenElseZero(here, all_opacity), m.opacity + l);
    for (int c = 0; c < 3; ++c) {
      const Pixel own = load<Pixel>(body.rgb[c] + l);
      const Pixel light = load<Pixel>(body.light[c] + l);
      store(hn::IfThenElse(lined, hn::MulAdd(own, opacity, light) * inverse, own), m.color[c] + l);
      store(hn::IfThenZeroElse(here, light), body.light[c] + l);
    }
    store(hn::IfThenZeroElse(here, opacity), body.opacity + l);
    store(hn::IfThenElse(here, one, behind), body.behind + l);
  }
}

// Whether any pixel of the block still waits for light of the body.
inline bool awaits_body(const BodyBlock& body) {
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const auto waits = hn::Gt(load<Pixel>(body.opacity + l), hn::Zero(PixelTag()));
    if (!hn::AllFalse(PixelTag(), waits)) return true;
  }
  return false;
}

// Sorts two neighbours per pixel. Returns whether any pixel swapped them.
KERNEL_INLINE bool put_in_order(BlockHit& first, BlockHit& second) {
  bool swapped = false;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const auto wrong = hn::Gt(load<Pixel>(first.x_line + l), load<Pixel>(second.x_line + l));
    if (hn::AllFalse(PixelTag(), wrong)) continue;
    swapped = true;
    const auto exchange = [&](float* a, float* b) {
      const Pixel p = load<Pixel>(a + l);
      const Pixel q = load<Pixel>(b + l);
      store(hn::IfThenElse(wrong, q, p), a + l);
      store(hn::IfThenElse(wrong, p, q), b + l);
    };
    exchange(first.x_line, second.x_line);
    exchange(first.opacity, second.opacity);
    for (int c = 0; c < 3; ++c) exchange(first.color[c], second.color[c]);
  }
  return swapped;
}

// Insertion sort front to back in every pixel. The input is nearly sorted, by depth at the centre
// of the block.
inline void sort_block_hits(BlockHit* m, int count) {
  for (int n = 1; n < count; ++n) {
    for (int k = n; k > 0 && put_in_order(m[k - 1], m[k]); --k) continue;
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
