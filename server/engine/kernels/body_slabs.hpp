// Part of the kernel body: the slab method. Splats add the part of their footprint that lies in a
// slab of view depth, then the slab's medium and the lines in it are composited, block by block.
#pragma once

#include "server/engine/kernels/body_draw.hpp"

namespace windsplat::engine::kernels {
namespace {

// F(b^2, v) by linear interpolation in both; row is where the table's row begins, v in [-1, 1].
HWY_INLINE Pixel partial_at(const float* partial, SignedOf<Pixel> row, Pixel row_part, Pixel v) {
  const Pixel place = (v + all<Pixel>(1.0F)) * all<Pixel>(0.5F * (partial_columns - 1));
  const Pixel inside = hn::Min(place, all<Pixel>(static_cast<float>(partial_columns - 1) - 0.001F));
  const SignedOf<Pixel> column = truncated(inside);
  const Pixel part = inside - from_integer<Pixel>(column);
  const SignedOf<Pixel> at = row + column;
  const PixelTag tag;
  const Pixel a = hn::GatherIndex(tag, partial, at);
  const Pixel b = hn::GatherIndex(tag, partial + 1, at);
  const Pixel c = hn::GatherIndex(tag, partial + partial_columns, at);
  const Pixel d = hn::GatherIndex(tag, partial + partial_columns + 1, at);
  const Pixel upper = hn::MulAdd(part, b - a, a);
  const Pixel lower = hn::MulAdd(part, d - c, c);
  return hn::MulAdd(row_part, lower - upper, upper);
}

// Adds what of the splat lies between two view depths, given from the splat's centre.
template <bool Perspective>
HWY_INLINE void gather_block(const SplatLanes& s, const float* HWY_RESTRICT partial, float front,
                             float back, float x, float y, const float* HWY_RESTRICT ray,
                             float* HWY_RESTRICT gathered) {
  constexpr float t2 = footprint_t * footprint_t;
  constexpr float rows_per_t2 = static_cast<float>(partial_rows - 1) / t2;
  const hn::RebindToSigned<PixelTag> integers;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel px = all<Pixel>(x) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(y) + load<Pixel>(lane_y + l);
    const Pixel length = Perspective ? load<Pixel>(ray + l) : all<Pixel>(1.0F);
    const SplatLane lane = splat_lane<Perspective, From::eye>(s, px, py, length);
    // Half the chord in cells, and with it the slab's faces in half chords from the middle.
    const Pixel chord2 = hn::Max(all<Pixel>(t2) - lane.r2, all<Pixel>(1e-6F));
    const Pixel scale = lane.cells / hn::Sqrt(chord2);
    const Pixel v0 = clamped((all<Pixel>(front) - lane.behind) * scale, -1.0F, 1.0F);
    const Pixel v1 = clamped((all<Pixel>(back) - lane.behind) * scale, -1.0F, 1.0F);
    const Pixel place =
        hn::Min(lane.r2 * all<Pixel>(rows_per_t2), all<Pixel>(partial_rows - 1.001F));
    const SignedOf<Pixel> row = truncated(place);
    const Pixel row_part = place - from_integer<Pixel>(row);
    const SignedOf<Pixel> at = row * hn::Set(integers, partial_columns);
    const Pixel after = partial_at(partial, at, row_part, v1);
    const Pixel before = partial_at(partial, at, row_part, v0);
    const Pixel tau = lane.tau * hn::Max(after - before, hn::Zero(PixelTag()));
    add_to(gathered + l, tau);
    for (int c = 0; c < 3; ++c) {
      add_product(gathered + static_cast<std::ptrdiff_t>(1 + c) * block_pixels + l, tau,
                  s.color[c]);
    }
  }
}

// The block's gathered medium, emptied when it is first touched in this slab.
inline float* touch(Slab& slab, int row, int column) {
  float* at =
      slab.gathered + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * gathered_floats;
  const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
  if ((slab.touched[row] & bit) == 0) {
    slab.touched[row] |= bit;
    for (int i = 0; i < gathered_floats; ++i) at[i] = 0;
  }
  return at;
}

// What lies before the near plane does not count.
template <bool Perspective>
void gather_on(const Camera& camera, const SplatRecord& record, Slab& slab, Tile& tile) {
  const auto near = static_cast<float>(static_cast<double>(camera.near) - camera.depth_origin);
  const float front = Perspective ? larger(slab.front, near) : slab.front;
  const float back = slab.back;
  if (back <= front || record.last <= front || record.first >= back) return;
  const std::uint32_t columns = range_mask({record.column_first, record.column_last});
  const SplatLanes lanes = spread(record.splat);
  for (int row = record.row_first; row <= record.row_last; ++row) {
    std::uint32_t left = columns & tile.open[row];
    while (left != 0) {
      const int column = __builtin_ctz(left);
      left &= left - 1U;
      const std::ptrdiff_t index = row * tile_blocks + column;
      const float* ray = Perspective ? tile.rays + index * block_pixels : nullptr;
      gather_block<Perspective>(lanes, record.partial, front - record.middle, back - record.middle,
                                static_cast<float>(tile.x + column * block_side),
                                static_cast<float>(tile.y + row * block_side), ray,
                                touch(slab, row, column));
      tile.counters.pixel_updates += block_pixels;
    }
  }
}

void gather(const Camera& camera, const SplatRecord& record, Slab& slab, Tile& tile) {
  if (camera.perspective != 0) {
    gather_on<true>(camera, record, slab, tile);
  } else {
    gather_on<false>(camera, record, slab, tile);
  }
}

template <bool Perspective>
int pack_splats_on(const Prepared& p, SplatRecord* out) {
  const Footing& f = p.footing;
  int n = 0;
  for (std::uint64_t left = p.stops.splats; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    const float middle = p.stops.depth[l];
    const float half = p.splats.half_depth[l];
    out[n++] = {p.pass->partial,
                middle - half,
                middle + half,
                middle,
                splat_at<Perspective>(p, l),
                static_cast<std::int16_t>(f.row_first[l]),
                static_cast<std::int16_t>(f.row_last[l]),
                static_cast<std::int16_t>(f.column_first[l]),
                static_cast<std::int16_t>(f.column_last[l])};
  }
  return n;
}

int pack_splats(const Camera& camera, const Prepared& p, SplatRecord* out) {
  return camera.perspective != 0 ? pack_splats_on<true>(p, out) : pack_splats_on<false>(p, out);
}

int pack_ribbons(const Prepared& p, RibbonRecord* out) {
  const Footing& f = p.footing;
  int n = 0;
  for (std::uint64_t left = p.stops.lines; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    const float tail = p.stops.depth[l] + p.ribbons.depth[l];
    const float head = tail + p.ribbons.depth_rise[l];
    RibbonRecord& to = out[n++];
    to.first = smaller(tail, head);
    to.last = larger(tail, head);
    to.centre = p.stops.depth[l];
    to.row_first = static_cast<std::int16_t>(f.line_first[l]);
    to.row_last = static_cast<std::int16_t>(f.line_last[l]);
    to.moving = p.pass->line.moving;
    for (int k = 0; k <= to.row_last - to.row_first; ++k) {
      to.columns[k] = f.line_columns[k][l];
    }
    to.ribbon = ribbon_at(p.pass->line, p.ribbons, l);
  }
  return n;
}

// A line's view depth where it passes a point of the picture, from the camera's depth origin.
template <bool Perspective>
inline float ribbon_depth(const Ribbon& r, float centre, float px, float py) {
  const float along = (px - r.x) * r.wx + (py - r.y) * r.wy + r.w0;
  const float w = limited(along, 0.0F, 1.0F);
  const float f = Perspective ? w * r.depth_ratio / (1.0F + w * (r.depth_ratio - 1.0F)) : w;
  return centre + r.depth + f * r.depth_rise;
}

// How far a line's depth anywhere in a block may be from that at the block's middle: the way of f
// over the farthest pixel's distance.
inline float depth_slack(const Ribbon& r) {
  constexpr float farthest = 2.2F;  // pixels
  const float steepest = larger(r.depth_ratio, 1.0F / larger(r.depth_ratio, 1e-6F));
  const float along = farthest * square_root(r.wx * r.wx + r.wy * r.wy) * steepest;
  return absolute(r.depth_rise) * smaller(along, 1.0F) * 1.001F;
}

// Lists the blocks that a line may touch within the slab. `hits` has room for hits_of_line_max.
template <bool Perspective>
int list_hits_on(const RibbonRecord& line, const Slab& slab, const Tile& tile, Hit* hits) {
  if (line.last < slab.front || line.first >= slab.back) return 0;
  const Ribbon& ribbon = line.ribbon;
  const float slack = depth_slack(ribbon);
  int n = 0;
  for (int row = line.row_first; row <= line.row_last; ++row) {
    std::uint32_t left = line.columns[row - line.row_first] & tile.open[row];
    while (left != 0) {
      const int column = __builtin_ctz(left);
      left &= left - 1U;
      constexpr float middle = 0.5F * block_side;
      const float depth = ribbon_depth<Perspective>(
          ribbon, line.centre, static_cast<float>(tile.x + column * block_side) + middle,
          static_cast<float>(tile.y + row * block_side) + middle);
      if (depth + slack < slab.front || depth - slack >= slab.back) continue;
      hits[n++] = {&line, depth, row * tile_blocks + column};
    }
  }
  return n;
}

int list_hits(const Camera& camera, const RibbonRecord& line, const Slab& slab, const Tile& tile,
              Hit* hits) {
  return camera.perspective != 0 ? list_hits_on<true>(line, slab, tile, hits)
                                 : list_hits_on<false>(line, slab, tile, hits);
}

// What has happened to the light of a vector of a block's pixels within the slab at hand.
struct Passage {
  Pixel tau;
  Attenuation<Pixel> medium;
  Pixel color[3];  // of the medium
  Pixel rgb[3];    // added by lines, minus the medium's behind them
  Pixel through;   // product of 1 - opacity of the lines so far
  Pixel reached;   // cd-naive: how far through the slab the light was followed
  Pixel left;      // cd-naive: light left there
};

// A line as a block's pixels meet it; a pixel that does not has opacity 0.
struct Meeting {
  alignas(64) float place[block_pixels];  // through the slab, 0 to 1
  alignas(64) float opacity[block_pixels];
  alignas(64) float color[3][block_pixels];
};
constexpr int meetings_max = 64;  // put in order together; a line moves by half of that at most

template <int Compositing>
HWY_INLINE Passage open_passage(const float* gathered, int l) {
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel one = all<Pixel>(1.0F);
  Passage p = {zero, {zero, one}, {zero, zero, zero}, {zero, zero, zero}, one, zero, one};
  if (gathered == nullptr) return p;
  p.tau = load<Pixel>(gathered + l);
  p.medium = attenuation_by<Compositing>(p.tau);
  const Pixel inverse = inverse_of(hn::Max(p.tau, all<Pixel>(1e-37F)));
  for (int c = 0; c < 3; ++c) {
    p.color[c] =
        load<Pixel>(gathered + static_cast<std::ptrdiff_t>(1 + c) * block_pixels + l) * inverse;
  }
  return p;
}

template <bool Perspective, int Style>
HWY_INLINE void meet_line(const RibbonRecord& line, const Slab& slab, float x, float y,
                          Meeting& m) {
  const RibbonLanes r = spread(line.ribbon);
  const Pixel inverse = all<Pixel>(1.0F / (slab.back - slab.front));
  const Pixel first = all<Pixel>(line.centre + line.ribbon.depth);
  const Pixel rise = all<Pixel>(line.ribbon.depth_rise);
  const Pixel front = all<Pixel>(slab.front);
  const Pixel back = all<Pixel>(slab.back);
  constexpr Depth along = Perspective ? Depth::exact : Depth::flat;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel px = all<Pixel>(x) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(y) + load<Pixel>(lane_y + l);
    const RibbonLane lane = ribbon_lane<along, Style>(r, px - r.x, py - r.y);
    const Pixel depth = hn::MulAdd(lane.f, rise, first);
    store(clamped((depth - front) * inverse, 0.0F, 1.0F), m.place + l);
    const auto here = hn::And(hn::Ge(depth, front), hn::Lt(depth, back));
    store(hn::IfThenElseZero(here, lane.opacity), m.opacity + l);
    for (int c = 0; c < 3; ++c) store(hn::MulAdd(lane.f, r.rise[c], r.tail[c]), m.color[c] + l);
  }
}

// Puts two neighbours in order, each pixel by itself; whether any pixel had them the other way.
HWY_INLINE bool put_in_order(Meeting& first, Meeting& second) {
  bool swapped = false;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const auto wrong = hn::Gt(load<Pixel>(first.place + l), load<Pixel>(second.place + l));
    if (hn::AllFalse(PixelTag(), wrong)) continue;
    swapped = true;
    const auto exchange = [&](float* a, float* b) {
      const Pixel p = load<Pixel>(a + l);
      const Pixel q = load<Pixel>(b + l);
      store(hn::IfThenElse(wrong, q, p), a + l);
      store(hn::IfThenElse(wrong, p, q), b + l);
    };
    exchange(first.place, second.place);
    exchange(first.opacity, second.opacity);
    for (int c = 0; c < 3; ++c) exchange(first.color[c], second.color[c]);
  }
  return swapped;
}

// Front to back in every pixel, by insertion. The lines come nearly sorted, by their depth at the
// block's middle, so that few pairs are exchanged.
inline void sort_meetings(Meeting* m, int count) {
  for (int n = 1; n < count; ++n) {
    for (int k = n; k > 0 && put_in_order(m[k - 1], m[k]); --k) continue;
  }
}

template <int Compositing>
HWY_INLINE void pass_line(const Meeting& m, int l, Passage& p) {
  const Pixel one = all<Pixel>(1.0F);
  const Pixel opacity = load<Pixel>(m.opacity + l);
  const Pixel place = load<Pixel>(m.place + l);
  if (Compositing == compositing_cd_naive) {
    // Only a pixel that the line covers is followed up to it.
    const Pixel next =
        hn::IfThenElse(hn::Gt(opacity, hn::Zero(PixelTag())), hn::Max(place, p.reached), p.reached);
    const Pixel part = (next - p.reached) * p.medium.absorbed;
    const Pixel behind = p.left * (one - part);
    for (int c = 0; c < 3; ++c) {
      const Pixel own = behind * opacity * load<Pixel>(m.color[c] + l);
      p.rgb[c] = p.rgb[c] + hn::MulAdd(p.left * part, p.color[c], own);
    }
    p.left = behind * (one - opacity);
    p.reached = next;
    return;
  }
  const Pixel own = p.through * opacity * light_before<Compositing>(p.medium, p.tau, place);
  for (int c = 0; c < 3; ++c) {
    p.rgb[c] = hn::MulAdd(own, load<Pixel>(m.color[c] + l) - p.color[c], p.rgb[c]);
  }
  p.through = p.through * (one - opacity);
}

// I = c_s (1 - P exp(-tau)) + sum_k prod_(j<k) (1 - a_j) a_k exp(-tau x_k) (c_k - c_s).
template <int Compositing>
HWY_INLINE void close_passage(const Passage& p, int l, float* block) {
  const Channels to = channels_of(block);
  const Pixel one = all<Pixel>(1.0F);
  const Pixel t = load<Pixel>(to.transmittance + l);
  if (Compositing == compositing_cd_naive) {
    const Pixel part = (one - p.reached) * p.medium.absorbed;
    const Pixel left = p.left * (one - part);
    for (int c = 0; c < 3; ++c) {
      add_product(to.rgb[c] + l, t, hn::MulAdd(p.left * part, p.color[c], p.rgb[c]));
    }
    add_product(to.alpha + l, t, one - left);
    store(t * left, to.transmittance + l);
    return;
  }
  const Pixel absorbed = hn::MulAdd(one - p.through, p.medium.transmitted, p.medium.absorbed);
  for (int c = 0; c < 3; ++c) {
    add_product(to.rgb[c] + l, t, hn::MulAdd(p.color[c], absorbed, p.rgb[c]));
  }
  add_product(to.alpha + l, t, absorbed);
  store(bounded_light<Compositing>(t * (p.through * p.medium.transmitted)), to.transmittance + l);
}

constexpr int block_vectors = block_pixels / pixel_lanes;

// Whether so little light is left in every pixel that what lies behind may be left out.
inline bool is_dark(const float* transmittance, const Passage* p, float stop) {
  Light light;
  for (int v = 0; v < block_vectors; ++v) {
    light.see(load<Pixel>(transmittance + v * pixel_lanes) * p[v].through * p[v].left);
  }
  return !light.above(stop);
}

template <int Compositing>
HWY_INLINE void pass_lines(const Meeting* m, int count, Passage* p) {
  for (int v = 0; v < block_vectors; ++v) {
    Passage passage = p[v];
    for (int n = 0; n < count; ++n) pass_line<Compositing>(m[n], v * pixel_lanes, passage);
    p[v] = passage;
  }
}

template <bool Perspective, int Compositing>
void close_slab_block(const Slab& slab, const Hit* hits, int count, int index, Tile& tile) {
  const int row = index / tile_blocks;
  const int column = index % tile_blocks;
  const bool medium = (slab.touched[row] >> static_cast<unsigned>(column) & 1U) != 0;
  const float* gathered =
      medium ? slab.gathered + static_cast<std::ptrdiff_t>(index) * gathered_floats : nullptr;
  const float x = static_cast<float>(tile.x + column * block_side);
  const float y = static_cast<float>(tile.y + row * block_side);
  float* block = tile.blocks + static_cast<std::ptrdiff_t>(index) * block_floats;
  Passage passage[block_vectors];
  for (int v = 0; v < block_vectors; ++v) {
    passage[v] = open_passage<Compositing>(gathered, v * pixel_lanes);
  }
  Meeting meetings[meetings_max];
  int held = 0;
  for (int h = 0; h < count; ++h) {
    const RibbonRecord& line = *hits[h].line;
    if (line.moving != 0) {
      meet_line<Perspective, style_moving>(line, slab, x, y, meetings[held]);
    } else {
      meet_line<Perspective, style_head>(line, slab, x, y, meetings[held]);
    }
    if (++held < meetings_max || h + 1 == count) continue;
    // The nearer half passes, the farther one may still be met by lines to come.
    sort_meetings(meetings, held);
    held = meetings_max / 2;
    pass_lines<Compositing>(meetings, held, passage);
    for (int n = 0; n < held; ++n) meetings[n] = meetings[n + held];
    if (is_dark(block, passage, slab.stop)) {
      tile.any_closed = 1;  // what is behind was left out
      held = 0;
      break;
    }
  }
  sort_meetings(meetings, held);
  pass_lines<Compositing>(meetings, held, passage);
  for (int v = 0; v < block_vectors; ++v) {
    close_passage<Compositing>(passage[v], v * pixel_lanes, block);
  }
  constexpr bool euler = Compositing == compositing_cd_euler;
  const int own = medium && !euler ? 1 : 0;
  const int each = medium && Compositing == compositing_analytic ? count : 0;
  tile.counters.pixel_updates += std::int64_t{1 + count} * block_pixels;
  tile.counters.exponentials += std::int64_t{own + each} * block_pixels;
}

int refresh_open(Tile& tile) {
  int open = 0;
  const int rows = blocks_of(tile.height);
  for (int row = 0; row < rows; ++row) {
    std::uint32_t left = tile.open[row];
    open += __builtin_popcount(left);
    while (left != 0) {
      const int column = __builtin_ctz(left);
      const std::uint32_t bit = left & (~left + 1U);
      left ^= bit;
      const float* transmittance = block_at(tile, row, column);
      Light light;
      for (int l = 0; l < block_pixels; l += pixel_lanes) light.see(load<Pixel>(transmittance + l));
      if (light.above(tile.stop)) continue;
      tile.open[row] ^= bit;
      tile.any_closed = 1;
      --open;
    }
  }
  return open;
}

template <bool Perspective>
void close_slab_on(int compositing, const Slab& slab, const Hit* hits, int count, int index,
                   Tile& tile) {
  switch (compositing) {
    case compositing_simple:
      return close_slab_block<Perspective, compositing_simple>(slab, hits, count, index, tile);
    case compositing_cd_naive:
      return close_slab_block<Perspective, compositing_cd_naive>(slab, hits, count, index, tile);
    case compositing_cd:
      return close_slab_block<Perspective, compositing_cd>(slab, hits, count, index, tile);
    case compositing_cd_euler:
      return close_slab_block<Perspective, compositing_cd_euler>(slab, hits, count, index, tile);
    default:
      return close_slab_block<Perspective, compositing_analytic>(slab, hits, count, index, tile);
  }
}

void close_slab(const Camera& camera, int compositing, const Slab& slab, const Hit* hits, int count,
                int index, Tile& tile) {
  if (camera.perspective != 0) {
    close_slab_on<true>(compositing, slab, hits, count, index, tile);
  } else {
    close_slab_on<false>(compositing, slab, hits, count, index, tile);
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
