// Part of the kernel body: the slab method. Splats add the part of their footprint that lies in a
// slab of view depth, then the slab's medium and the lines in it are composited, block by block.
#pragma once

#include "server/engine/kernels/body_blocks.hpp"

namespace windsplat::engine::kernels {
namespace {

// F(b^2, v) by linear interpolation in both; row is the table's row, v in [-1, 1].
inline float partial_at(const float* __restrict row, float row_part, float v) {
  const float place = (v + 1.0F) * (0.5F * (partial_columns - 1));
  const float inside = clamped(place, 0.0F, static_cast<float>(partial_columns - 1) - 0.001F);
  const int column = static_cast<int>(inside);
  const float part = inside - static_cast<float>(column);
  const float a = row[column];
  const float b = row[column + 1];
  const float c = row[column + partial_columns];
  const float d = row[column + partial_columns + 1];
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
    const float place = clamped(lane.r2 * rows_per_t2, 0.0F, partial_rows - 1.001F);
    const int row = static_cast<int>(place);
    const float row_part = place - static_cast<float>(row);
    const float* at = partial + static_cast<std::ptrdiff_t>(row) * partial_columns;
    tau[l] = lane.tau * (partial_at(at, row_part, v1) - partial_at(at, row_part, v0));
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
void gather_on(const Camera& camera, const Prepared& p, Slab& slab, Tile& tile) {
  const auto near = static_cast<float>(static_cast<double>(camera.near) - camera.depth_origin);
  const float front = Perspective ? larger(slab.front, near) : slab.front;
  const float back = slab.back;
  if (back <= front) return;
  for (int l = 0; l < p.stops.count; ++l) {
    const float middle = p.stops.depth[l];
    const float half = p.splats.half_depth[l];
    if (p.footing.row_last[l] < p.footing.row_first[l]) continue;
    if (middle + half <= front || middle - half >= back) continue;
    const Splat splat = splat_at<Perspective>(p.densities, p.splats, p.near, l);
    const std::uint32_t columns = range_mask({p.footing.column_first[l], p.footing.column_last[l]});
    for (int row = p.footing.row_first[l]; row <= p.footing.row_last[l]; ++row) {
      std::uint32_t left = columns & tile.open[row];
      while (left != 0) {
        const int column = __builtin_ctz(left);
        left &= left - 1U;
        const float* ray =
            Perspective
                ? tile.rays + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * block_pixels
                : nullptr;
        gather_block<Perspective>(splat, p.pass->partial, front - middle, back - middle,
                                  static_cast<float>(tile.x + column * block_side),
                                  static_cast<float>(tile.y + row * block_side), ray,
                                  touch(slab, row, column));
        tile.counters.pixel_updates += block_pixels;
      }
    }
  }
}

void gather(const Camera& camera, const Prepared& p, Slab& slab, Tile& tile) {
  if (p.pass->has_medium == 0) return;
  if (camera.perspective != 0) {
    gather_on<true>(camera, p, slab, tile);
  } else {
    gather_on<false>(camera, p, slab, tile);
  }
}

// A line's view depth where it passes a pixel, from the camera's depth origin.
template <bool Perspective>
inline float ribbon_depth(const Ribbon& r, float centre, float px, float py) {
  const RibbonLane lane = ribbon_lane<Perspective, style_plain>(r, px, py);
  return centre + r.depth + lane.f * r.depth_rise;
}

// Lists the blocks that lines in the slab may touch. `hits` has room for hits_of_brick_max.
template <bool Perspective>
int list_hits_on(const Prepared& p, const Slab& slab, const Tile& tile, Hit* hits) {
  const float back = slab.back;
  const int columns = blocks_of(tile.width);
  int n = 0;
  for (int l = 0; l < p.stops.count; ++l) {
    if (p.footing.line_last[l] < p.footing.line_first[l]) continue;
    const float first = p.stops.depth[l] + p.ribbons.depth[l];
    const float last = first + p.ribbons.depth_rise[l];
    if (larger(first, last) < slab.front || smaller(first, last) >= back) continue;
    const Ribbon ribbon = ribbon_at(p.pass->line, p.ribbons, l);
    const Capsule capsule = capsule_of(ribbon, tile);
    for (int row = p.footing.line_first[l]; row <= p.footing.line_last[l]; ++row) {
      std::uint32_t left = range_mask(capsule_in_row(capsule, row, columns)) & tile.open[row];
      while (left != 0) {
        const int column = __builtin_ctz(left);
        left &= left - 1U;
        constexpr float middle = 0.5F * block_side;
        const float depth = ribbon_depth<Perspective>(
            ribbon, p.stops.depth[l], static_cast<float>(tile.x + column * block_side) + middle,
            static_cast<float>(tile.y + row * block_side) + middle);
        hits[n++] = {&p, depth, static_cast<std::int16_t>(l),
                     static_cast<std::int16_t>(row * tile_blocks + column)};
      }
    }
  }
  return n;
}

int list_hits(const Camera& camera, const Prepared& p, const Slab& slab, const Tile& tile,
              Hit* hits) {
  if (p.pass->has_lines == 0) return 0;
  return camera.perspective != 0 ? list_hits_on<true>(p, slab, tile, hits)
                                 : list_hits_on<false>(p, slab, tile, hits);
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

template <int Compositing>
inline void open_passage(const float* __restrict gathered, Passage& p) {
  for (int l = 0; l < block_pixels; ++l) {
    p.tau[l] = gathered == nullptr ? 0.0F : gathered[l];
    const Attenuation medium = attenuation_by<Compositing>(p.tau[l]);
    p.absorbed[l] = medium.absorbed;
    p.transmitted[l] = medium.transmitted;
    const float inverse = 1.0F / larger(p.tau[l], 1e-37F);
    for (int c = 0; c < 3; ++c) {
      const float weighted = gathered == nullptr
                                 ? 0.0F
                                 : gathered[static_cast<std::ptrdiff_t>(1 + c) * block_pixels + l];
      p.color[c][l] = weighted * inverse;
      p.rgb[c][l] = 0;
    }
    p.through[l] = 1;
    p.reached[l] = 0;
    p.left[l] = 1;
  }
}

template <bool Perspective, int Compositing, int Style>
inline void pass_line(const Ribbon& ribbon, float centre, const Slab& slab, float x, float y,
                      Passage& p) {
  const Ribbon r = ribbon;
  const float inverse = 1.0F / (slab.back - slab.front);
  const float first = centre + r.depth;
  for (int l = 0; l < block_pixels; ++l) {
    const RibbonLane lane = ribbon_lane<Perspective, Style>(r, x + lane_x[l], y + lane_y[l]);
    const float depth = first + lane.f * r.depth_rise;
    const float place = clamped((depth - slab.front) * inverse, 0.0F, 1.0F);
    const float opacity = depth >= slab.front && depth < slab.back ? lane.opacity : 0.0F;
    float color[3];
    for (int c = 0; c < 3; ++c) color[c] = r.tail[c] + lane.f * r.rise[c];
    if (Compositing == compositing_cd_naive) {
      // Only a pixel that the line covers is followed up to it.
      const float next = opacity > 0 ? larger(place, p.reached[l]) : p.reached[l];
      const float part = (next - p.reached[l]) * p.absorbed[l];
      const float behind = p.left[l] * (1.0F - part);
      for (int c = 0; c < 3; ++c) {
        p.rgb[c][l] += p.left[l] * part * p.color[c][l] + behind * opacity * color[c];
      }
      p.left[l] = behind * (1.0F - opacity);
      p.reached[l] = next;
      continue;
    }
    const Attenuation medium = {p.absorbed[l], p.transmitted[l]};
    const float before = light_before<Compositing>(medium, p.tau[l], place);
    const float own = p.through[l] * opacity * before;
    for (int c = 0; c < 3; ++c) p.rgb[c][l] += own * (color[c] - p.color[c][l]);
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
  Passage passage;
  open_passage<Compositing>(gathered, passage);
  for (int h = 0; h < count; ++h) {
    const Prepared& p = *hits[h].from;
    const Ribbon ribbon = ribbon_at(p.pass->line, p.ribbons, hits[h].stop);
    const float centre = p.stops.depth[hits[h].stop];
    if (p.pass->line.moving != 0) {
      pass_line<Perspective, Compositing, style_moving>(ribbon, centre, slab, x, y, passage);
    } else {
      pass_line<Perspective, Compositing, style_head>(ribbon, centre, slab, x, y, passage);
    }
  }
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
