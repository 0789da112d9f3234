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
  int layers;                  // number of those that pixels meet in the slab
  BodyBlock* layer[layers_max];
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
  const Between slab = {with.slab.front, with.slab.back};
  for (int v = 0, l = 0; v < block_vectors; ++v, l += pixel_lanes) {
    const Pixel px = all<Pixel>(with.x) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(with.y) + load<Pixel>(lane_y + l);
    Passage p = passage[v];
    Pixel far = all<Pixel>(slab.front);
    for (int h = 0; h < with.count; ++h) {
      const RibbonRecord& line = with.lines[with.met[h].line];
      const LaneHit hit = hit_lanes<Perspective>(line, slab, px, py);
      if (hn::AllFalse(PixelTag(), hit.here)) continue;
      if (!hn::AllFalse(PixelTag(), hn::And(hit.here, hn::Lt(hit.depth, far)))) {
        return Outcome::out_of_order;
      }
      far = hn::IfThenElse(hit.here, hit.depth, far);
      Pixel color[3];
      for (int c = 0; c < 3; ++c) color[c] = hit_color(line, hit, c);
      pass_line<Compositing>(hit.opacity, fraction_in(with.slab, hit.depth), color, p);
    }
    passage[v] = p;
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

// The same in a part of the slab, after sorting the lines in every pixel.
template <bool Perspective, int Compositing>
Outcome pass_sorted(const Closing& with, Between part, Passage* passage) {
  BlockHit hits[block_hits_max];
  BodyShare share;
  int held = 0;
  bool body = with.body != nullptr;
  if (body) open_share(with.slab, *with.body, share);
  for (int n = 0; n < with.layers; ++n) {
    take_body(with.slab, *with.layer[n], hits[held]);
    if (body) scale_hit(share, hits[held]);
    ++held;
  }
  for (int h = 0; h < with.count || body;) {
    if (body && (h == with.count || with.met[h].depth >= with.body->nearest)) {
      take_body(with.slab, *with.body, hits[held]);
      body = false;
    } else {
      const MetLine& met = with.met[h++];
      if (met.first >= part.back || 2 * met.depth - met.first < part.front) continue;
      const RibbonRecord& line = with.lines[met.line];
      if (!hit_block<Perspective>(line, with.slab, part, with.x, with.y, hits[held])) continue;
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

// Part by part where lines may be too many to be sorted together.
template <bool Perspective, int Compositing>
Outcome pass_parts(const Closing& with, Passage* passage) {
  constexpr int lines_of_part = block_hits_max / 2;
  const bool many = with.count > block_hits_max && with.body == nullptr && with.layers == 0;
  const int parts = many ? (with.count + lines_of_part - 1) / lines_of_part : 1;
  const float length = (with.slab.back - with.slab.front) / static_cast<float>(parts);
  Between part = {with.slab.front, with.slab.front};
  for (int n = 1; n <= parts; ++n) {
    part.front = part.back;
    part.back = n == parts ? with.slab.back : with.slab.front + static_cast<float>(n) * length;
    const Outcome outcome = pass_sorted<Perspective, Compositing>(with, part, passage);
    if (outcome == Outcome::dark) return outcome;
    if (n < parts && is_dark(with.transmittance, passage, with.stop)) return Outcome::dark;
  }
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
  if (with.body == nullptr && with.layers == 0 && with.count <= in_order_max) {
    outcome = pass_in_order<Perspective, Compositing>(with, passage);
  }
  if (outcome == Outcome::out_of_order) {
    open();
    outcome = pass_parts<Perspective, Compositing>(with, passage);
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
                  0,
                  {}};
  const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
  if (tile.body != nullptr && (tile.body->seen[row] & bit) != 0) {
    BodyBlock& body = tile.body->blocks[index];
    if (body.nearest < slab.back) with.body = &body;
  }
  TileBody* layer_of[layers_max];
  for (int n = 0; n < tile.layers; ++n) {
    TileBody& layer = tile.layer[n];
    if (!sees(layer, row, column) || layer.blocks[index].nearest >= slab.back) continue;
    layer_of[with.layers] = &layer;
    with.layer[with.layers++] = &layer.blocks[index];
  }
  if (camera.perspective != 0) {
    close_slab_on<true>(compositing, with, gathered, row, column, tile);
  } else {
    close_slab_on<false>(compositing, with, gathered, row, column, tile);
  }
  if (with.body != nullptr && !awaits_body(*with.body)) tile.body->seen[row] &= ~bit;
  for (int n = 0; n < with.layers; ++n) {
    if (!awaits_body(*with.layer[n])) layer_of[n]->seen[row] &= ~bit;
  }
  const int own = medium && compositing != compositing_cd_euler ? 1 : 0;
  const int each = medium && compositing == compositing_analytic ? count : 0;
  tile.counters.pixel_updates += std::int64_t{1 + count} * block_pixels;
  tile.counters.exponentials += std::int64_t{own + each} * block_pixels;
}

}  // namespace
}  // namespace windsplat::engine::kernels
