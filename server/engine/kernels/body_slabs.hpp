// Part of the kernel body: the slab method. Splats add the part of their footprint that lies in a
// slab of view depth, then the slab's medium and the lines in it are composited, block by block.
#pragma once

#include "server/engine/kernels/body_blocks.hpp"

namespace windsplat::engine::kernels {
namespace {

// F(b^2, v) by linear interpolation in both; row is where the table's row begins, v in [-1, 1].
inline float partial_at(const float* __restrict partial, int row, float row_part, float v) {
  const float place = (v + 1.0F) * (0.5F * (partial_columns - 1));
  const float inside = smaller(place, static_cast<float>(partial_columns - 1) - 0.001F);
  const int column = static_cast<int>(inside);
  const float part = inside - static_cast<float>(column);
  const int at = row + column;
  const float a = partial[at];
  const float b = partial[at + 1];
  const float c = partial[at + partial_columns];
  const float d = partial[at + partial_columns + 1];
  const float upper = a + part * (b - a);
  const float lower = c + part * (d - c);
  return upper + row_part * (lower - upper);
}

// Adds what of the splat lies between two view depths, given from the splat's centre.
template <bool Perspective>
void gather_block(const Splat& splat, const float* __restrict partial, float front, float back,
                  float x, float y, const float* __restrict ray, float* __restrict gathered) {
  const Splat s = splat;
  constexpr float t2 = footprint_t * footprint_t;
  constexpr float rows_per_t2 = static_cast<float>(partial_rows - 1) / t2;
  float tau[block_pixels];
  for (int l = 0; l < block_pixels; ++l) {
    const float length = Perspective ? ray[l] : 1.0F;
    const SplatLane lane =
        splat_lane<Perspective, From::eye>(s, x + lane_x[l], y + lane_y[l], length);
    // Half the chord in cells, and with it the slab's faces in half chords from the middle.
    const float chord2 = larger(t2 - lane.r2, 1e-6F);
    const float scale = lane.cells / square_root(chord2);
    const float v0 = clamped((front - lane.behind) * scale, -1.0F, 1.0F);
    const float v1 = clamped((back - lane.behind) * scale, -1.0F, 1.0F);
    const float place = smaller(lane.r2 * rows_per_t2, partial_rows - 1.001F);
    const int row = static_cast<int>(place);
    const float row_part = place - static_cast<float>(row);
    const int at = row * partial_columns;
    const float after = partial_at(partial, at, row_part, v1);
    const float before = partial_at(partial, at, row_part, v0);
    tau[l] = lane.tau * larger(after - before, 0.0F);
  }
  for (int l = 0; l < block_pixels; ++l) gathered[l] += tau[l];
  for (int c = 0; c < 3; ++c) {
    float* to = gathered + static_cast<std::ptrdiff_t>(1 + c) * block_pixels;
    for (int l = 0; l < block_pixels; ++l) to[l] += tau[l] * s.color[c];
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
  for (int row = record.row_first; row <= record.row_last; ++row) {
    std::uint32_t left = columns & tile.open[row];
    while (left != 0) {
      const int column = __builtin_ctz(left);
      left &= left - 1U;
      const std::ptrdiff_t index = row * tile_blocks + column;
      const float* ray = Perspective ? tile.rays + index * block_pixels : nullptr;
      gather_block<Perspective>(
          record.splat, record.partial, front - record.middle, back - record.middle,
          static_cast<float>(tile.x + column * block_side),
          static_cast<float>(tile.y + row * block_side), ray, touch(slab, row, column));
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
  int n = 0;
  for (int l = 0; l < p.stops.count; ++l) {
    const Footing& f = p.footing;
    if (f.row_last[l] < f.row_first[l]) continue;
    const float middle = p.stops.depth[l];
    const float half = p.splats.half_depth[l];
    out[n++] = {p.pass->partial,
                middle - half,
                middle + half,
                middle,
                splat_at<Perspective>(p.densities, p.splats, p.near, l),
                static_cast<std::int16_t>(f.row_first[l]),
                static_cast<std::int16_t>(f.row_last[l]),
                static_cast<std::int16_t>(f.column_first[l]),
                static_cast<std::int16_t>(f.column_last[l])};
  }
  return n;
}

int pack_splats(const Camera& camera, const Prepared& p, SplatRecord* out) {
  if (p.pass->has_medium == 0) return 0;
  return camera.perspective != 0 ? pack_splats_on<true>(p, out) : pack_splats_on<false>(p, out);
}

int pack_ribbons(const Prepared& p, RibbonRecord* out) {
  if (p.pass->has_lines == 0) return 0;
  int n = 0;
  for (int l = 0; l < p.stops.count; ++l) {
    const Footing& f = p.footing;
    if (f.line_last[l] < f.line_first[l]) continue;
    const float tail = p.stops.depth[l] + p.ribbons.depth[l];
    const float head = tail + p.ribbons.depth_rise[l];
    out[n++] = {smaller(tail, head),
                larger(tail, head),
                p.stops.depth[l],
                static_cast<std::int16_t>(f.line_first[l]),
                static_cast<std::int16_t>(f.line_last[l]),
                p.pass->line.moving,
                ribbon_at(p.pass->line, p.ribbons, l)};
  }
  return n;
}

// A line's view depth where it passes a pixel, from the camera's depth origin.
template <bool Perspective>
inline float ribbon_depth(const Ribbon& r, float centre, float px, float py) {
  const RibbonLane lane = ribbon_lane<Perspective, style_plain>(r, px, py);
  return centre + r.depth + lane.f * r.depth_rise;
}

// How far a line's depth anywhere in a block may be from that at the block's middle: the way of f
// over the farthest pixel's distance.
inline float depth_slack(const Ribbon& r) {
  constexpr float farthest = 2.2F;  // pixels
  const float steepest = larger(r.depth_ratio, 1.0F / larger(r.depth_ratio, 1e-6F));
  const float along = farthest * square_root(r.inverse_u2) * steepest;
  return absolute(r.depth_rise) * smaller(along, 1.0F) * 1.001F;
}

// Lists the blocks that a line may touch within the slab. `hits` has room for hits_of_line_max.
template <bool Perspective>
int list_hits_on(const RibbonRecord& line, const Slab& slab, const Tile& tile, Hit* hits) {
  if (line.last < slab.front || line.first >= slab.back) return 0;
  const Ribbon& ribbon = line.ribbon;
  const Capsule capsule = capsule_of(ribbon, tile);
  const int columns = blocks_of(tile.width);
  const float slack = depth_slack(ribbon);
  int n = 0;
  for (int row = line.row_first; row <= line.row_last; ++row) {
    std::uint32_t left = range_mask(capsule_in_row(capsule, row, columns)) & tile.open[row];
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

// What has happened to the light of a block's pixels within the slab at hand.
struct Passage {
  float tau[block_pixels];
  float absorbed[block_pixels], transmitted[block_pixels];
  float color[3][block_pixels];  // of the medium
  float rgb[3][block_pixels];    // added by lines, minus the medium's behind them
  float through[block_pixels];   // product of 1 - opacity of the lines so far
  float reached[block_pixels];   // cd-naive: how far through the slab the light was followed
  float left[block_pixels];      // cd-naive: light left there
};

// Lines as the pixels of a block meet them; a pixel that does not has opacity 0 and the place
// `far`.
struct Meeting {
  float place[block_pixels];  // through the slab, 0 to 1
  float opacity[block_pixels];
  float color[3][block_pixels];
};
constexpr int meetings_max = 64;  // put in order together; a line moves by half of that at most

template <int Compositing>
inline void open_passage(const float* __restrict gathered, Passage& p) {
  for (int l = 0; l < block_pixels; ++l) {
    p.tau[l] = 0;
    p.absorbed[l] = 0;
    p.transmitted[l] = 1;
    for (int c = 0; c < 3; ++c) p.color[c][l] = p.rgb[c][l] = 0;
    p.through[l] = 1;
    p.reached[l] = 0;
    p.left[l] = 1;
  }
  if (gathered == nullptr) return;
  for (int l = 0; l < block_pixels; ++l) {
    p.tau[l] = gathered[l];
    const Attenuation medium = attenuation_by<Compositing>(p.tau[l]);
    p.absorbed[l] = medium.absorbed;
    p.transmitted[l] = medium.transmitted;
    const float inverse = 1.0F / larger(p.tau[l], 1e-37F);
    for (int c = 0; c < 3; ++c) {
      p.color[c][l] = gathered[static_cast<std::ptrdiff_t>(1 + c) * block_pixels + l] * inverse;
    }
  }
}

template <bool Perspective, int Style>
inline void meet_line(const Ribbon& ribbon, float centre, const Slab& slab, float x, float y,
                      Meeting& m) {
  const Ribbon r = ribbon;
  const float inverse = 1.0F / (slab.back - slab.front);
  const float first = centre + r.depth;
  for (int l = 0; l < block_pixels; ++l) {
    const RibbonLane lane = ribbon_lane<Perspective, Style>(r, x + lane_x[l], y + lane_y[l]);
    const float depth = first + lane.f * r.depth_rise;
    m.place[l] = clamped((depth - slab.front) * inverse, 0.0F, 1.0F);
    m.opacity[l] = depth >= slab.front && depth < slab.back ? lane.opacity : 0.0F;
    for (int c = 0; c < 3; ++c) m.color[c][l] = r.tail[c] + lane.f * r.rise[c];
  }
}

// Puts two neighbours in order, each pixel by itself; whether any pixel had them the other way.
inline int put_in_order(Meeting& first, Meeting& second) {
  int swapped = 0;
  for (int l = 0; l < block_pixels; ++l) {
    swapped |= first.place[l] > second.place[l] ? 1 : 0;
  }
  if (swapped == 0) return 0;
  int wrong[block_pixels];
  for (int l = 0; l < block_pixels; ++l) wrong[l] = first.place[l] > second.place[l] ? 1 : 0;
  const auto exchange = [&](float* a, float* b) {
    for (int l = 0; l < block_pixels; ++l) {
      const float near = wrong[l] != 0 ? b[l] : a[l];
      const float far = wrong[l] != 0 ? a[l] : b[l];
      a[l] = near;
      b[l] = far;
    }
  };
  exchange(first.place, second.place);
  exchange(first.opacity, second.opacity);
  for (int c = 0; c < 3; ++c) exchange(first.color[c], second.color[c]);
  return 1;
}

// Front to back in every pixel, by insertion. The lines come nearly sorted, by their depth at the
// block's middle, so that few pairs are exchanged.
inline void sort_meetings(Meeting* m, int count) {
  for (int n = 1; n < count; ++n) {
    for (int k = n; k > 0 && put_in_order(m[k - 1], m[k]) != 0; --k) continue;
  }
}

// Whether so little light is left in every pixel that what lies behind may be left out.
inline bool is_dark(const float* __restrict transmittance, const Passage& p, float stop) {
  float most = 0;
  for (int l = 0; l < block_pixels; ++l) {
    most = larger(most, absolute(transmittance[l] * p.through[l] * p.left[l]));
  }
  return most <= stop;
}

template <int Compositing>
inline void pass_line(const Meeting& m, Passage& p) {
  for (int l = 0; l < block_pixels; ++l) {
    const float opacity = m.opacity[l];
    const float place = m.place[l];
    if (Compositing == compositing_cd_naive) {
      // Only a pixel that the line covers is followed up to it.
      const float next = opacity > 0 ? larger(place, p.reached[l]) : p.reached[l];
      const float part = (next - p.reached[l]) * p.absorbed[l];
      const float behind = p.left[l] * (1.0F - part);
      for (int c = 0; c < 3; ++c) {
        p.rgb[c][l] += p.left[l] * part * p.color[c][l] + behind * opacity * m.color[c][l];
      }
      p.left[l] = behind * (1.0F - opacity);
      p.reached[l] = next;
      continue;
    }
    const Attenuation medium = {p.absorbed[l], p.transmitted[l]};
    const float before = light_before<Compositing>(medium, p.tau[l], place);
    const float own = p.through[l] * opacity * before;
    for (int c = 0; c < 3; ++c) p.rgb[c][l] += own * (m.color[c][l] - p.color[c][l]);
    p.through[l] *= 1.0F - opacity;
  }
}

// I = c_s (1 - P exp(-tau)) + sum_k prod_(j<k) (1 - a_j) a_k exp(-tau x_k) (c_k - c_s).
template <int Compositing>
inline void close_passage(const Passage& p, float* __restrict block) {
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const float t = to.transmittance[l];
    if (Compositing == compositing_cd_naive) {
      const float part = (1.0F - p.reached[l]) * p.absorbed[l];
      const float left = p.left[l] * (1.0F - part);
      for (int c = 0; c < 3; ++c) {
        to.rgb[c][l] += t * (p.rgb[c][l] + p.left[l] * part * p.color[c][l]);
      }
      to.alpha[l] += t * (1.0F - left);
      to.transmittance[l] = t * left;
      continue;
    }
    const float absorbed = p.absorbed[l] + (1.0F - p.through[l]) * p.transmitted[l];
    for (int c = 0; c < 3; ++c) to.rgb[c][l] += t * (p.rgb[c][l] + p.color[c][l] * absorbed);
    to.alpha[l] += t * absorbed;
    const float left = t * (p.through[l] * p.transmitted[l]);
    to.transmittance[l] = Compositing == compositing_cd_euler ? bounded_light(left) : left;
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
  Passage passage;
  open_passage<Compositing>(gathered, passage);
  Meeting meetings[meetings_max];
  int held = 0;
  for (int h = 0; h < count; ++h) {
    const RibbonRecord& line = *hits[h].line;
    if (line.moving != 0) {
      meet_line<Perspective, style_moving>(line.ribbon, line.centre, slab, x, y, meetings[held]);
    } else {
      meet_line<Perspective, style_head>(line.ribbon, line.centre, slab, x, y, meetings[held]);
    }
    if (++held < meetings_max || h + 1 == count) continue;
    // The nearer half passes, the farther one may still be met by lines to come.
    sort_meetings(meetings, held);
    held = meetings_max / 2;
    for (int n = 0; n < held; ++n) pass_line<Compositing>(meetings[n], passage);
    for (int n = 0; n < held; ++n) meetings[n] = meetings[n + held];
    if (is_dark(block, passage, slab.stop)) {
      tile.any_closed = 1;  // what is behind was left out
      held = 0;
      break;
    }
  }
  sort_meetings(meetings, held);
  for (int n = 0; n < held; ++n) pass_line<Compositing>(meetings[n], passage);
  close_passage<Compositing>(passage,
                             tile.blocks + static_cast<std::ptrdiff_t>(index) * block_floats);
  constexpr bool euler = Compositing == compositing_cd_euler;
  const int own = medium && !euler ? 1 : 0;
  const int each = medium && Compositing == compositing_analytic ? count : 0;
  tile.counters.pixel_updates += std::int64_t{1 + count} * block_pixels;
  tile.counters.exponentials += std::int64_t{own + each} * block_pixels;
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
