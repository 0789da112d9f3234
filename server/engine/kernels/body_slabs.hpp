// Part of the kernel body: composites the accumulated medium of a slab and the lines in it, block
// by block.
#pragma once

#include "server/engine/kernels/body_line_hits.hpp"

namespace windsplat::engine::kernels {
namespace {

// A block of a slab without medium: all compositing methods are equal.
constexpr int compositing_no_medium = -1;

// Light and transmittance of a vector of pixels within the current slab.
struct Passage {
  Pixel tau;
  Attenuation<Pixel> medium;
  Pixel color[3];  // colour of the medium
  Pixel rgb[3];    // light added by lines, minus that of the medium behind them
  Pixel through;   // product of 1 - opacity of the lines so far
  Pixel reached;   // cd-naive: relative position in the slab up to which light is composited
  Pixel left;      // cd-naive: transmittance up to there
};

// A line at the pixels of a block; opacity 0 where a pixel does not meet it.
struct BlockHit {
  alignas(64) float x_line[block_pixels];  // through the slab, 0 to 1
  alignas(64) float opacity[block_pixels];
  alignas(64) float color[3][block_pixels];
};
constexpr int block_hits_max = 64;  // sorted together; exact if no line is displaced by more than
                                    // half

template <int Compositing>
KERNEL_INLINE Passage open_passage(const float* gathered, int l) {
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel one = all<Pixel>(1.0F);
  Passage p = {zero, {zero, one}, {zero, zero, zero}, {zero, zero, zero}, one, zero, one};
  if (Compositing == compositing_no_medium) return p;
  p.tau = load<Pixel>(gathered + l);
  p.medium = attenuation_by<Compositing>(p.tau);
  const Pixel inverse = inverse_of(hn::Max(p.tau, all<Pixel>(1e-37F)));
  for (int c = 0; c < 3; ++c) {
    p.color[c] =
        load<Pixel>(gathered + static_cast<std::ptrdiff_t>(1 + c) * block_pixels + l) * inverse;
  }
  return p;
}

// A line at a vector of pixels within the slab.
struct LaneHit {
  MaskOf<Pixel> here;  // the line covers the pixel, in this slab
  Pixel opacity;       // 0 elsewhere
  Pixel depth;
  Pixel f;
};

template <Depth Along, int Style>
KERNEL_INLINE LaneHit hit_lanes(const RibbonRecord& line, const Slab& slab, Pixel px, Pixel py) {
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
  if (hn::AllFalse(PixelTag(), inside)) return {inside, zero, depth, f};
  const Pixel opacity = ribbon_lane<Along, Style>(r, px - r.x, py - r.y).opacity;
  const auto here = hn::And(inside, hn::Gt(opacity, zero));
  return {here, hn::IfThenElseZero(here, opacity), depth, f};
}

template <bool Perspective>
KERNEL_INLINE LaneHit hit_lanes(const RibbonRecord& line, const Slab& slab, Pixel px, Pixel py) {
  if (!Perspective) {
    return line.moving != 0 ? hit_lanes<Depth::flat, style_moving>(line, slab, px, py)
                            : hit_lanes<Depth::flat, style_head>(line, slab, px, py);
  }
  if (line.bent == 0) {
    return line.moving != 0 ? hit_lanes<Depth::series, style_moving>(line, slab, px, py)
                            : hit_lanes<Depth::series, style_head>(line, slab, px, py);
  }
  return line.moving != 0 ? hit_lanes<Depth::exact, style_moving>(line, slab, px, py)
                          : hit_lanes<Depth::exact, style_head>(line, slab, px, py);
}

KERNEL_INLINE Pixel fraction_in(const Slab& slab, Pixel depth) {
  const Pixel inverse = all<Pixel>(1.0F / (slab.back - slab.begin));
  return clamped((depth - all<Pixel>(slab.begin)) * inverse, 0.0F, 1.0F);
}

// Returns whether any pixel meets the line.
template <bool Perspective>
KERNEL_INLINE bool hit_block(const RibbonRecord& line, const Slab& slab, float x, float y,
                             BlockHit& m) {
  bool any = false;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel px = all<Pixel>(x) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(y) + load<Pixel>(lane_y + l);
    const LaneHit at = hit_lanes<Perspective>(line, slab, px, py);
    any = any || !hn::AllFalse(PixelTag(), at.here);
    store(fraction_in(slab, at.depth), m.x_line + l);
    store(at.opacity, m.opacity + l);
    for (int c = 0; c < 3; ++c) {
      store(hn::MulAdd(at.f, all<Pixel>(line.ribbon.rise[c]), all<Pixel>(line.ribbon.tail[c])),
            m.color[c] + l);
    }
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
inline void take_body(const Slab& slab, const float rgb[3], BodyBlock& body, BlockHit& m) {
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
      const Pixel own = load<Pixel>(body.shade + l) * all<Pixel>(rgb[c]);
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

template <int Compositing>
KERNEL_INLINE void pass_line(Pixel opacity, Pixel x_line, const Pixel color[3], Passage& p) {
  const Pixel one = all<Pixel>(1.0F);
  if (Compositing == compositing_cd_naive) {
    // Composite the medium up to the line only in pixels that the line covers.
    const Pixel next = hn::IfThenElse(hn::Gt(opacity, hn::Zero(PixelTag())),
                                      hn::Max(x_line, p.reached), p.reached);
    const Pixel part = (next - p.reached) * p.medium.absorbed;
    const Pixel behind = p.left * (one - part);
    for (int c = 0; c < 3; ++c) {
      const Pixel line_weight = behind * opacity * color[c];
      p.rgb[c] = p.rgb[c] + hn::MulAdd(p.left * part, p.color[c], line_weight);
    }
    p.left = behind * (one - opacity);
    p.reached = next;
    return;
  }
  Pixel line_weight = p.through * opacity;
  if (Compositing == compositing_no_medium) {
    for (int c = 0; c < 3; ++c) p.rgb[c] = hn::MulAdd(line_weight, color[c], p.rgb[c]);
  } else {
    line_weight = line_weight * light_before<Compositing>(p.medium, p.tau, x_line);
    for (int c = 0; c < 3; ++c) p.rgb[c] = hn::MulAdd(line_weight, color[c] - p.color[c], p.rgb[c]);
  }
  p.through = p.through * (one - opacity);
}

template <int Compositing>
KERNEL_INLINE void pass_line(const BlockHit& m, int l, Passage& p) {
  const Pixel color[3] = {load<Pixel>(m.color[0] + l), load<Pixel>(m.color[1] + l),
                          load<Pixel>(m.color[2] + l)};
  pass_line<Compositing>(load<Pixel>(m.opacity + l), load<Pixel>(m.x_line + l), color, p);
}

// I = c_s (1 - P exp(-tau)) + sum_k prod_(j<k) (1 - a_j) a_k exp(-tau x_k) (c_k - c_s).
// Returns the remaining transmittance.
template <int Compositing>
KERNEL_INLINE Pixel close_passage(const Passage& p, int l, float* block) {
  const Channels to = channels_of(block);
  const Pixel one = all<Pixel>(1.0F);
  const Pixel t = load<Pixel>(to.transmittance + l);
  if (Compositing == compositing_cd_naive) {
    const Pixel part = (one - p.reached) * p.medium.absorbed;
    const Pixel left = p.left * (one - part);
    for (int c = 0; c < 3; ++c) {
      add_product(to.rgb[c] + l, t, hn::MulAdd(p.left * part, p.color[c], p.rgb[c]));
    }
    store(t * left, to.transmittance + l);
    return t * left;
  }
  if (Compositing == compositing_no_medium) {
    for (int c = 0; c < 3; ++c) add_product(to.rgb[c] + l, t, p.rgb[c]);
    store(t * p.through, to.transmittance + l);
    return t * p.through;
  }
  const Pixel absorbed = hn::MulAdd(one - p.through, p.medium.transmitted, p.medium.absorbed);
  for (int c = 0; c < 3; ++c) {
    add_product(to.rgb[c] + l, t, hn::MulAdd(p.color[c], absorbed, p.rgb[c]));
  }
  const Pixel left = bounded_light<Compositing>(t * (p.through * p.medium.transmitted));
  store(left, to.transmittance + l);
  return left;
}

// Whether the transmittance of every pixel is so low that everything behind can be skipped.
inline bool is_dark(const float* transmittance, const Passage* p, float stop) {
  Light light;
  for (int v = 0; v < block_vectors; ++v) {
    light.see(load<Pixel>(transmittance + static_cast<std::ptrdiff_t>(v) * pixel_lanes) *
              p[v].through * p[v].left);
  }
  return !light.above(stop);
}

template <int Compositing>
KERNEL_INLINE void pass_lines(const BlockHit* m, int count, Passage* p) {
  for (int v = 0; v < block_vectors; ++v) {
    Passage passage = p[v];
    for (int n = 0; n < count; ++n) pass_line<Compositing>(m[n], v * pixel_lanes, passage);
    p[v] = passage;
  }
}

// Input for compositing a block of the slab.
struct Closing {
  const Slab& slab;
  const RibbonRecord* lines;
  const MetLine* met;
  int count;
  float x, y;  // the block's corner, pixels
  float stop;
  const float* transmittance;  // transmittance in front of the slab
  BodyBlock* body;             // null: no pixel meets the body in the slab
  const float* body_rgb;
};

// Stable rank sort of a few lines by depth: the number of predecessors is the index.
inline void sort_met(const MetLine* met, int count, MetLine* sorted) {
  alignas(64) float depth[met_lines_sorted_max];
  int filled = 0;
  for (; filled < count; ++filled) depth[filled] = met[filled].depth;
  for (; filled % pixel_lanes != 0; ++filled) depth[filled] = __builtin_inff();
  for (int n = 0; n < count; ++n) {
    const Pixel depth_n = all<Pixel>(met[n].depth);
    const Pixel index = all<Pixel>(static_cast<float>(n));
    std::size_t before = 0;
    for (int l = 0; l < filled; l += pixel_lanes) {
      const Pixel other = load<Pixel>(depth + l);
      const auto earlier = hn::Lt(hn::Iota(PixelTag(), l), index);
      const auto equal = hn::And(hn::Eq(other, depth_n), earlier);
      before += hn::CountTrue(PixelTag(), hn::Or(hn::Lt(other, depth_n), equal));
    }
    sorted[before] = met[n];
  }
}

// Whether all lines starting at `from` lie behind a depth, so that they can be skipped if the
// transmittance there is low enough.
inline bool rest_is_behind(const Closing& with, int from, float depth) {
  for (int h = from; h < with.count; ++h) {
    if (with.met[h].first < depth) return false;
  }
  return true;
}

KERNEL_INLINE float largest_of(Pixel v) { return hn::GetLane(hn::MaxOfLanes(PixelTag(), v)); }

enum class Outcome { done, dark, out_of_order };

// Composites the lines in order of their depth at the centre of the block. If that is not the order
// in some pixel, returns out_of_order and the passage is invalid.
template <bool Perspective, int Compositing>
KERNEL_INLINE Outcome pass_in_order(const Closing& with, Passage* passage) {
  constexpr int between_checks = 16;
  Pixel farthest[block_vectors];
  for (Pixel& depth : farthest) depth = all<Pixel>(with.slab.front);
  for (int from = 0; from < with.count; from += between_checks) {
    const int to = from + between_checks < with.count ? from + between_checks : with.count;
    for (int v = 0, l = 0; v < block_vectors; ++v, l += pixel_lanes) {
      const Pixel px = all<Pixel>(with.x) + load<Pixel>(lane_x + l);
      const Pixel py = all<Pixel>(with.y) + load<Pixel>(lane_y + l);
      Passage p = passage[v];
      Pixel far = farthest[v];
      for (int h = from; h < to; ++h) {
        const RibbonRecord& line = with.lines[with.met[h].line];
        const LaneHit hit = hit_lanes<Perspective>(line, with.slab, px, py);
        if (hn::AllFalse(PixelTag(), hit.here)) continue;
        if (!hn::AllFalse(PixelTag(), hn::And(hit.here, hn::Lt(hit.depth, far)))) {
          return Outcome::out_of_order;
        }
        far = hn::IfThenElse(hit.here, hit.depth, far);
        Pixel color[3];
        for (int c = 0; c < 3; ++c) {
          color[c] =
              hn::MulAdd(hit.f, all<Pixel>(line.ribbon.rise[c]), all<Pixel>(line.ribbon.tail[c]));
        }
        pass_line<Compositing>(hit.opacity, fraction_in(with.slab, hit.depth), color, p);
      }
      farthest[v] = far;
      passage[v] = p;
    }
    if (to == with.count || !is_dark(with.transmittance, passage, with.stop)) continue;
    Pixel most = farthest[0];
    for (const Pixel& depth : farthest) most = hn::Max(most, depth);
    if (rest_is_behind(with, to, largest_of(most))) return Outcome::dark;
  }
  return Outcome::done;
}

inline float farthest_x(const BlockHit& m) {
  Pixel most = hn::Zero(PixelTag());
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    most = hn::Max(most, load<Pixel>(m.x_line + l));
  }
  return largest_of(most);
}

// The same after sorting the lines in every pixel.
template <bool Perspective, int Compositing>
Outcome pass_sorted(const Closing& with, Passage* passage) {
  BlockHit hits[block_hits_max];
  BodyShare share;
  int held = 0;
  bool body = with.body != nullptr;
  if (body) open_share(with.slab, *with.body, share);
  for (int h = 0; h < with.count || body;) {
    if (body && (h == with.count || with.met[h].depth >= with.body->nearest)) {
      take_body(with.slab, with.body_rgb, *with.body, hits[held]);
      body = false;
    } else {
      const RibbonRecord& line = with.lines[with.met[h++].line];
      if (!hit_block<Perspective>(line, with.slab, with.x, with.y, hits[held])) continue;
      if (with.body != nullptr) scale_hit(share, hits[held]);
    }
    if (++held < block_hits_max) continue;
    // Composite the nearer half; later lines may still precede lines of the farther half.
    sort_block_hits(hits, held);
    held = block_hits_max / 2;
    pass_lines<Compositing>(hits, held, passage);
    const float depth = farthest_x(hits[held - 1]) * (with.slab.back - with.slab.begin);
    for (int n = 0; n < held; ++n) hits[n] = hits[n + held];
    if (is_dark(with.transmittance, passage, with.stop) &&
        rest_is_behind(with, h, with.slab.begin + depth)) {
      return Outcome::dark;
    }
  }
  sort_block_hits(hits, held);
  pass_lines<Compositing>(hits, held, passage);
  return Outcome::done;
}

template <bool Perspective, int Compositing>
void close_block(const Closing& with, const float* gathered, int row, int column, Tile& tile) {
  Passage passage[block_vectors];
  const auto open = [&] {
    for (int v = 0; v < block_vectors; ++v) {
      passage[v] = open_passage<Compositing>(gathered, v * pixel_lanes);
    }
  };
  open();
  Outcome outcome = Outcome::out_of_order;
  constexpr int in_order_max = 8;  // more lines are seldom in one order in every pixel
  if (with.body == nullptr && with.count <= in_order_max) {
    outcome = pass_in_order<Perspective, Compositing>(with, passage);
  }
  if (outcome == Outcome::out_of_order) {
    open();
    outcome = pass_sorted<Perspective, Compositing>(with, passage);
  }
  if (outcome == Outcome::dark) tile.any_closed = 1;  // lines behind were skipped
  float* block = block_at(tile, row, column);
  Light light;
  for (int v = 0; v < block_vectors; ++v) {
    light.see(close_passage<Compositing>(passage[v], v * pixel_lanes, block));
  }
  note_light(light, row, std::uint32_t{1} << static_cast<unsigned>(column), tile);
}

template <bool Perspective>
void close_slab_on(int compositing, const Closing& with, const float* gathered, int row, int column,
                   Tile& tile) {
  if (gathered == nullptr) {
    return close_block<Perspective, compositing_no_medium>(with, gathered, row, column, tile);
  }
  switch (compositing) {
    case compositing_simple:
      return close_block<Perspective, compositing_simple>(with, gathered, row, column, tile);
    case compositing_cd_naive:
      return close_block<Perspective, compositing_cd_naive>(with, gathered, row, column, tile);
    case compositing_cd:
      return close_block<Perspective, compositing_cd>(with, gathered, row, column, tile);
    case compositing_cd_euler:
      return close_block<Perspective, compositing_cd_euler>(with, gathered, row, column, tile);
    default:
      return close_block<Perspective, compositing_analytic>(with, gathered, row, column, tile);
  }
}

void close_slab(const Camera& camera, int compositing, const Slab& slab, const RibbonRecord* lines,
                const MetLine* met, int count, int index, Tile& tile) {
  const int row = index / tile_blocks;
  const int column = index % tile_blocks;
  const bool medium = (slab.touched[row] >> static_cast<unsigned>(column) & 1U) != 0;
  const float* gathered =
      medium ? slab.gathered + static_cast<std::ptrdiff_t>(index) * gathered_floats : nullptr;
  MetLine sorted[met_lines_sorted_max];
  if (count > 1 && count <= met_lines_sorted_max) {
    sort_met(met, count, sorted);
    met = sorted;
  }
  Closing with = {slab,
                  lines,
                  met,
                  count,
                  left_of(tile, column),
                  top_of(tile, row),
                  tile.stop,
                  block_at(tile, row, column),
                  nullptr,
                  nullptr};
  const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
  if (tile.body != nullptr && (tile.body->seen[row] & bit) != 0) {
    BodyBlock& body = tile.body->blocks[index];
    if (body.nearest < slab.back) with.body = &body;
    with.body_rgb = tile.body->rgb;
  }
  if (camera.perspective != 0) {
    close_slab_on<true>(compositing, with, gathered, row, column, tile);
  } else {
    close_slab_on<false>(compositing, with, gathered, row, column, tile);
  }
  if (with.body != nullptr && !awaits_body(*with.body)) tile.body->seen[row] &= ~bit;
  const int own = medium && compositing != compositing_cd_euler ? 1 : 0;
  const int each = medium && compositing == compositing_analytic ? count : 0;
  tile.counters.pixel_updates += std::int64_t{1 + count} * block_pixels;
  tile.counters.exponentials += std::int64_t{own + each} * block_pixels;
}

}  // namespace
}  // namespace windsplat::engine::kernels
