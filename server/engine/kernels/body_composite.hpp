// Part of the kernel body: composites a line, a splat or both into one block of pixels.
#pragma once

#include "server/engine/kernels/body_lanes.hpp"

namespace windsplat::engine::kernels {
namespace {

// The values of scene::Compositing, whose header is not included here.
constexpr int compositing_simple = 0;
constexpr int compositing_cd_naive = 1;
constexpr int compositing_cd = 2;
constexpr int compositing_analytic = 3;
constexpr int compositing_cd_euler = 4;

struct Channels {
  float* transmittance;
  float* rgb[3];
};

KERNEL_INLINE Channels channels_of(float* block) {
  constexpr std::ptrdiff_t lanes = block_pixels;
  return {block, {block + lanes, block + 2 * lanes, block + 3 * lanes}};
}

KERNEL_INLINE void add_to(float* channel, Pixel value) {
  store(load<Pixel>(channel) + value, channel);
}

KERNEL_INLINE void add_product(float* channel, Pixel a, Pixel b) {
  store(hn::MulAdd(a, b, load<Pixel>(channel)), channel);
}

// Largest transmittance of the pixels of a block, collected while they are written.
struct Light {
  Pixel most = hn::Zero(PixelTag());

  KERNEL_INLINE void see(Pixel transmittance) { see_positive(hn::Abs(transmittance)); }
  // Valid for all compositing methods except forward Euler.
  KERNEL_INLINE void see_positive(Pixel transmittance) {
    most = pixel_lanes == block_pixels ? transmittance : hn::Max(most, transmittance);
  }
  KERNEL_INLINE bool above(float stop) const {
    return !hn::AllFalse(PixelTag(), hn::Gt(most, all<Pixel>(stop)));
  }
};

// Forward Euler uses the optical depth as the absorbed fraction, which is stable only below 1.
// Clamped so that a diverging picture remains finite.
KERNEL_INLINE Attenuation<Pixel> euler_attenuation(Pixel tau) {
  const Pixel bounded = hn::Min(tau, all<Pixel>(1e6F));
  return {bounded, all<Pixel>(1.0F) - bounded};
}

template <int Compositing>
KERNEL_INLINE Attenuation<Pixel> attenuation_by(Pixel tau) {
  if (Compositing == compositing_cd_euler) return euler_attenuation(tau);
  return attenuation(tau);
}

template <int Compositing>
KERNEL_INLINE Pixel bounded_light(Pixel transmittance) {
  if (Compositing != compositing_cd_euler) return transmittance;
  return clamped(transmittance, -1e12F, 1e12F);
}

template <int Compositing>
KERNEL_INLINE void see_light(Pixel transmittance, Light& light) {
  if (Compositing == compositing_cd_euler) {
    light.see(transmittance);
  } else {
    light.see_positive(transmittance);
  }
}

// Transmittance of the medium in front of a line at the fraction x_line of the depth of the cell.
template <int Compositing>
KERNEL_INLINE Pixel light_before(const Attenuation<Pixel>& medium, Pixel tau, Pixel x_line) {
  if (Compositing == compositing_simple) return medium.transmitted;
  // tau is finite (the plan bounds extinctions), so that 0 * tau is 0.
  if (Compositing == compositing_analytic) return attenuation(tau * x_line).transmitted;
  return hn::NegMulAdd(x_line, medium.absorbed, all<Pixel>(1.0F));
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

// Closes an opaque block for everything behind it.
inline void mark_closed(int row, std::uint32_t bit, Tile& tile) {
  tile.open[row] &= ~bit;
  tile.any_closed = 1;
}

KERNEL_INLINE void note_light(const Light& light, int row, std::uint32_t bit, Tile& tile) {
  if (!light.above(tile.stop)) mark_closed(row, bit, tile);
}

// Blocks of a tile within 8 x 8 of them: bit 8 j + i is the one in row + j and column + i.
struct Window {
  int row, column;
  std::uint64_t blocks;
};

// The open blocks of a window.
inline std::uint64_t open_window(const Tile& tile, int row, int column) {
  std::uint64_t open = 0;
  for (int k = 0; k < window_side && row + k < tile_blocks; ++k) {
    const std::uint64_t here = tile.open[row + k] >> static_cast<unsigned>(column) & 0xffU;
    open |= here << static_cast<unsigned>(window_side * k);
  }
  return open;
}

// Pixels from a point of the picture to the corner of a block or window.
struct BlockPixels {
  Pixel x, y;
};

KERNEL_INLINE BlockPixels corner_of(const Window& window, const Tile& tile) {
  return {all<Pixel>(left_of(tile, window.column)), all<Pixel>(top_of(tile, window.row))};
}

// The blocks of a window by their bits: from its corner in pixels, and indices in the tile.
struct WindowOffsets {
  float x[window_side * window_side];
  float y[window_side * window_side];
  std::int32_t block[window_side * window_side];
};

constexpr WindowOffsets window_offsets() {
  WindowOffsets offsets = {};
  for (int b = 0; b < window_side * window_side; ++b) {
    const int row = b / window_side;
    const int column = b % window_side;
    offsets.x[b] = static_cast<float>(column * block_side);
    offsets.y[b] = static_cast<float>(row * block_side);
    offsets.block[b] = row * tile_blocks + column;
  }
  return offsets;
}

constexpr WindowOffsets offsets_in_window = window_offsets();

// Calls add(offset, ray, block) for each block of a window; offset: pixels from the corner of the
// window. add returns the Light of the block.
template <bool Perspective, class Add>
KERNEL_INLINE void each_block(const Window& window, Tile& tile, const Add& add) {
  float* const first = block_at(tile, window.row, window.column);
  const float* const rays = Perspective ? rays_at(tile, window.row, window.column) : nullptr;
  const float stop = tile.stop;
  for (std::uint64_t blocks = window.blocks; blocks != 0; blocks &= blocks - 1U) {
    const int at = __builtin_ctzll(blocks);
    const std::ptrdiff_t block = offsets_in_window.block[at];
    const float* ray = Perspective ? &rays[block * block_pixels] : nullptr;
    const Light light =
        add({all<Pixel>(offsets_in_window.x[at]), all<Pixel>(offsets_in_window.y[at])}, ray,
            &first[block * block_floats]);
    if (!light.above(stop)) {
      mark_closed(window.row + at / window_side,
                  1U << static_cast<unsigned>(window.column + at % window_side), tile);
    }
  }
}

// Combines a line with the others by `or`: the largest opacity and the largest premultiplied light
// of each channel. `open`: transmittance without lines. Returns the transmittance.
KERNEL_INLINE Pixel add_or(Pixel opacity, const Pixel color[3], Pixel open, const Channels& to,
                           int l) {
  const Pixel weight = open * opacity;
  for (int c = 0; c < 3; ++c) {
    store(hn::Max(load<Pixel>(to.rgb[c] + l), weight * color[c]), to.rgb[c] + l);
  }
  const Pixel left = hn::Min(load<Pixel>(to.transmittance + l), open - weight);
  store(left, to.transmittance + l);
  return left;
}

// corner: from the line to the corner of the window, offset: from there to the block, in pixels.
template <Depth Along, int Style>
KERNEL_INLINE Light or_block(const RibbonLanes& r, const BlockPixels& corner,
                             const BlockPixels& offset, float* HWY_RESTRICT block) {
  const Channels to = channels_of(block);
  Light light;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const RibbonLane lane =
        ribbon_lane<Along, Style>(r, corner.x + load<Pixel>(lane_x + l) + offset.x,
                                  corner.y + load<Pixel>(lane_y + l) + offset.y);
    Pixel color[3];
    for (int c = 0; c < 3; ++c) color[c] = line_color<Style>(r, lane, c);
    light.see(add_or(lane.opacity, color, all<Pixel>(1.0F), to, l));
  }
  return light;
}

template <Depth Along, int Style>
KERNEL_INLINE Light line_block(const RibbonLanes& r, const BlockPixels& corner,
                               const BlockPixels& offset, float* HWY_RESTRICT block) {
  const Channels to = channels_of(block);
  Light light;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const RibbonLane lane =
        ribbon_lane<Along, Style>(r, corner.x + load<Pixel>(lane_x + l) + offset.x,
                                  corner.y + load<Pixel>(lane_y + l) + offset.y);
    const Pixel t = load<Pixel>(to.transmittance + l);
    const Pixel a = t * lane.opacity;
    for (int c = 0; c < 3; ++c) add_product(to.rgb[c] + l, a, line_color<Style>(r, lane, c));
    const Pixel left = hn::NegMulAdd(t, lane.opacity, t);
    store(left, to.transmittance + l);
    light.see(left);
  }
  return light;
}

// Lanes: SplatLanes or, from the near plane, NearLanes.
template <From Start, class Lanes>
KERNEL_INLINE SplatPixels splat_pixels(const Lanes& s, const BlockPixels& corner,
                                       const BlockPixels& offset, int l) {
  // Added in this order, the first sum is that of the whole window.
  const Pixel x = load<Pixel>(lane_x + l);
  const Pixel y = load<Pixel>(lane_y + l);
  return pixels_from<Start>(s, corner.x, corner.y).moved(x, y).moved(offset.x, offset.y);
}

// corner: the corner of the window, offset: from there to the block, in pixels.
template <bool Perspective, int Compositing, From Start, class Lanes>
KERNEL_INLINE Light splat_block(const Lanes& s, const BlockPixels& corner,
                                const BlockPixels& offset, const float* HWY_RESTRICT ray,
                                float* HWY_RESTRICT block) {
  const Channels to = channels_of(block);
  Light light;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const SplatPixels pixels = splat_pixels<Start>(s, corner, offset, l);
    const Pixel length = Perspective ? load<Pixel>(ray + l) : all<Pixel>(1.0F);
    const Pixel tau = splat_depth<Perspective, Start>(s, pixels, length);
    const Attenuation<Pixel> medium = attenuation_by<Compositing>(tau);
    const Pixel t = load<Pixel>(to.transmittance + l);
    const Pixel a = t * medium.absorbed;
    for (int c = 0; c < 3; ++c) add_product(to.rgb[c] + l, a, s.color[c]);
    const Pixel left = bounded_light<Compositing>(t * medium.transmitted);
    store(left, to.transmittance + l);
    see_light<Compositing>(left, light);
  }
  return light;
}

// A line in a homogeneous cell at a vector of pixels; see add_cell.
struct CellLight {
  Pixel tau;
  Pixel opacity;
  Pixel x_line;
  Attenuation<Pixel> medium;
  const Pixel* color;  // of the medium
  const Pixel* line_color;
};

// The first form of [CM92]: the front part of the medium, the line and the back part composited one
// over the other where the ray meets the line.
KERNEL_INLINE Pixel add_naive_cell(const CellLight& cell, Pixel t, const Channels& to, int l) {
  const Pixel one = all<Pixel>(1.0F);
  const Pixel split = hn::IfThenElse(hn::Gt(cell.opacity, hn::Zero(PixelTag())), cell.x_line, one);
  const Pixel front = split * cell.medium.absorbed;
  const Pixel back = (one - split) * cell.medium.absorbed;
  const Pixel line_weight = (one - front) * cell.opacity;
  const Pixel rest = (one - front) * (one - cell.opacity);
  const Pixel absorbed = front + rest * back;
  for (int c = 0; c < 3; ++c) {
    add_product(to.rgb[c] + l, t,
                hn::MulAdd(line_weight, cell.line_color[c], cell.color[c] * absorbed));
  }
  return rest * (one - back);
}

// Adds a line in a homogeneous cell of optical depth tau, with optical depth tau_f in front of it
// (x = tau_f / tau is its relative position), where the transmittance t remains:
// A = -expm1(-tau) + a exp(-tau), I = c_s A + a exp(-tau_f) (c_v - c_s).
// Returns the transmittance of the cell.
template <int Compositing>
KERNEL_INLINE Pixel add_cell(const CellLight& cell, Pixel t, const Channels& to, int l) {
  if (Compositing == compositing_cd_naive) return add_naive_cell(cell, t, to, l);
  const Attenuation<Pixel>& medium = cell.medium;
  const Pixel a = hn::MulAdd(cell.opacity, medium.transmitted, medium.absorbed);
  const Pixel line_weight = cell.opacity * light_before<Compositing>(medium, cell.tau, cell.x_line);
  for (int c = 0; c < 3; ++c) {
    const Pixel difference = cell.line_color[c] - cell.color[c];
    add_product(to.rgb[c] + l, t, hn::MulAdd(line_weight, difference, cell.color[c] * a));
  }
  return medium.transmitted * (all<Pixel>(1.0F) - cell.opacity);
}

template <bool Perspective, int Compositing, int Style, From Start, class Lanes>
KERNEL_INLINE Light both_block(const RibbonLanes& r, Pixel depth, Pixel depth_rise, const Lanes& s,
                               const BlockPixels& corner, const BlockPixels& offset,
                               const float* HWY_RESTRICT ray, float* HWY_RESTRICT block) {
  constexpr Depth along = Perspective ? Depth::exact : Depth::flat;
  const Channels to = channels_of(block);
  Light light;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel to_line_x = corner.x - r.x + load<Pixel>(lane_x + l);
    const Pixel to_line_y = corner.y - r.y + load<Pixel>(lane_y + l);
    const RibbonLane line =
        ribbon_lane<along, Style>(r, to_line_x + offset.x, to_line_y + offset.y);
    const SplatPixels pixels = splat_pixels<Start>(s, corner, offset, l);
    const Pixel length = Perspective ? load<Pixel>(ray + l) : all<Pixel>(1.0F);
    const SplatLane lane = splat_lane<Perspective, Start>(s, pixels, length);
    const Pixel tau = depth_beyond<Start>(lane);
    const Attenuation<Pixel> medium = attenuation_by<Compositing>(tau);
    const Pixel x_line = fraction_before(s, lane, hn::MulAdd(line.f, depth_rise, depth));
    Pixel color[3];
    for (int c = 0; c < 3; ++c) color[c] = line_color<Style>(r, line, c);
    const Pixel t = load<Pixel>(to.transmittance + l);
    const CellLight cell = {tau, line.opacity, x_line, medium, s.color, color};
    const Pixel left = bounded_light<Compositing>(t * add_cell<Compositing>(cell, t, to, l));
    store(left, to.transmittance + l);
    see_light<Compositing>(left, light);
  }
  return light;
}

template <bool Perspective, int Compositing, From Start>
void splat_window(const Splat& splat, const Window& window, Tile& tile) {
  const auto s = spread_from<Start>(splat);
  const BlockPixels corner = corner_of(window, tile);
  each_block<Perspective>(
      window, tile, [&](const BlockPixels& offset, const float* ray, float* block) {
        return splat_block<Perspective, Compositing, Start>(s, corner, offset, ray, block);
      });
}

template <bool Perspective, int Compositing, int Style, From Start>
void both_window(const Ribbon& ribbon, const Splat& splat, const Window& window, Tile& tile) {
  const RibbonLanes r = spread(ribbon);
  const auto s = spread_from<Start>(splat);
  const Pixel depth = all<Pixel>(ribbon.depth);
  const Pixel depth_rise = all<Pixel>(ribbon.depth_rise);
  const BlockPixels corner = corner_of(window, tile);
  each_block<Perspective>(window, tile,
                          [&](const BlockPixels& offset, const float* ray, float* block) {
                            return both_block<Perspective, Compositing, Style, Start>(
                                r, depth, depth_rise, s, corner, offset, ray, block);
                          });
}

template <bool Perspective, int Style>
void line_window(const Ribbon& ribbon, const Window& window, Tile& tile) {
  const RibbonLanes r = spread(ribbon);
  const BlockPixels corner = corner_of(window, tile);
  each_block<false>(
      window, tile, [&](const BlockPixels& offset, const float* /*ray*/, float* block) {
        constexpr Depth along = Perspective ? Depth::exact : Depth::flat;
        return line_block<along, Style>(r, {corner.x - r.x, corner.y - r.y}, offset, block);
      });
}

template <bool Perspective, int Style>
void or_window(const Ribbon& ribbon, const Window& window, Tile& tile) {
  const RibbonLanes r = spread(ribbon);
  const BlockPixels corner = corner_of(window, tile);
  each_block<false>(
      window, tile, [&](const BlockPixels& offset, const float* /*ray*/, float* block) {
        constexpr Depth along = Perspective ? Depth::exact : Depth::flat;
        return or_block<along, Style>(r, {corner.x - r.x, corner.y - r.y}, offset, block);
      });
}

template <int Compositing>
void afar_window(const Prepared& p, int l, const Window& window, Tile& tile) {
  const AfarLanes s = spread_afar(p.splats, p.densities.color[l], l);
  const BlockPixels corner = corner_of(window, tile);
  each_block<true>(window, tile, [&](const BlockPixels& offset, const float* ray, float* block) {
    return splat_block<true, Compositing, From::afar>(s, corner, offset, ray, block);
  });
}

using LineFunction = void (*)(const Ribbon& r, const Window& window, Tile& tile);
using SplatFunction = void (*)(const Splat& s, const Window& window, Tile& tile);
using AfarFunction = void (*)(const Prepared& p, int l, const Window& window, Tile& tile);
using BothFunction = void (*)(const Ribbon& r, const Splat& s, const Window& window, Tile& tile);

constexpr int from_count = 3;

// The functions that composite the kernels of a pass, selected once per brick; those with a splat
// by the start of the rays.
struct Compositor {
  LineFunction line;
  SplatFunction splat[from_count];
  BothFunction both[from_count];
  AfarFunction afar;       // splats alone, perspective only
  int splat_exponentials;  // number of exponentials per pixel
  int both_exponentials;
};

inline int signature_of(const LineStyle& line) {
  if (line.chains.q != nullptr) return style_chain;
  if (line.moving != 0 || line.marked != 0) return style_general;
  return line.head_desaturation > 0 || line.tail_light < 1 ? style_head : style_plain;
}

template <bool Perspective, int Compositing, int Style>
inline Compositor compositor_with() {
  constexpr From inside = Perspective ? From::eye_inside : From::eye;
  constexpr From near = Perspective ? From::near_plane : From::eye;
  constexpr int splat = Compositing == compositing_cd_euler ? 0 : 1;
  return {line_window<Perspective, Style>,
          {splat_window<Perspective, Compositing, From::eye>,
           splat_window<Perspective, Compositing, inside>,
           splat_window<Perspective, Compositing, near>},
          {both_window<Perspective, Compositing, Style, From::eye>,
           both_window<Perspective, Compositing, Style, inside>,
           both_window<Perspective, Compositing, Style, near>},
          afar_window<Compositing>,
          splat,
          Compositing == compositing_analytic ? 2 : splat};
}

// A plain line is drawn as one whose head equals its tail.
template <bool Perspective, int Compositing>
inline Compositor compositor_with(int style) {
  if (style == style_chain) {
    // Chains have a pass without splats.
    Compositor with = compositor_with<Perspective, Compositing, style_head>();
    with.line = line_window<Perspective, style_chain>;
    return with;
  }
  return style == style_general ? compositor_with<Perspective, Compositing, style_general>()
                                : compositor_with<Perspective, Compositing, style_head>();
}

// Lines combined by `or` have a pass without splats.
template <bool Perspective>
inline Compositor or_compositor(int style) {
  Compositor with = compositor_with<Perspective, compositing_analytic>(style);
  with.line = style == style_general ? or_window<Perspective, style_general>
                                     : or_window<Perspective, style_head>;
  return with;
}

template <bool Perspective>
inline Compositor compositor_of(const Pass& pass) {
  const int style = signature_of(pass.line);
  switch (pass.compositing) {
    case compositing_or:
      return or_compositor<Perspective>(style);
    case compositing_simple:
      return compositor_with<Perspective, compositing_simple>(style);
    case compositing_cd_naive:
      return compositor_with<Perspective, compositing_cd_naive>(style);
    case compositing_cd:
      return compositor_with<Perspective, compositing_cd>(style);
    case compositing_cd_euler:
      return compositor_with<Perspective, compositing_cd_euler>(style);
    default:
      return compositor_with<Perspective, compositing_analytic>(style);
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
