// Part of the kernel body: the opaque body of the scene at the pixels of a tile, and kernels that
// it divides.
#pragma once

#include "server/engine/kernels/body_composite.hpp"
#include "server/engine/kernels/body_rows.hpp"

namespace windsplat::engine::kernels {
namespace {

// Depths of the body are computed in double: differences of squares cancel near its limb and for
// distant eyes.
using WideTag = hn::CappedTag<double, block_side>;
using Wide = hn::Vec<WideTag>;
constexpr int wide_lanes = static_cast<int>(hn::MaxLanes(WideTag()));

KERNEL_INLINE Wide wide(double value) { return hn::Set(WideTag(), value); }

struct BodyLanes {
  Wide depth;     // view depth at which the ray enters the body
  Wide coverage;  // part of the pixel that the body covers
  Wide cosine;    // between the ray and the normal
};

// A sphere along rays at the distances x to the right and y down, in perspective at unit depth.
// With `off` the distance of the ray from the centre, the limb lies (radius - off) / step pixels
// away, where step is the change of `off` from one pixel to the next.
template <bool Perspective>
KERNEL_INLINE BodyLanes sphere_lanes(const Camera& camera, const Body& body, Wide x, Wide y) {
  const Wide one = wide(1);
  const Wide least = wide(1e-300);
  const Wide radius = wide(body.radius);
  const Wide cx = wide(body.centre[0]);
  const Wide cy = wide(body.centre[1]);
  const Wide cz = wide(body.centre[2]);
  const Wide length2 = Perspective ? hn::MulAdd(x, x, hn::MulAdd(y, y, one)) : one;
  const Wide middle = Perspective ? hn::MulAdd(x, cx, hn::MulAdd(y, cy, cz)) / length2 : cz;
  const Wide at_middle = Perspective ? middle : one;
  const Wide wx = hn::NegMulAdd(at_middle, x, cx);
  const Wide wy = hn::NegMulAdd(at_middle, y, cy);
  const Wide wz = cz - middle;
  const Wide across2 = hn::MulAdd(wx, wx, wy * wy);
  const Wide off = hn::Sqrt(hn::MulAdd(wz, wz, across2));
  const Wide half2 = hn::Max((radius - off) * (radius + off), hn::Zero(WideTag()));
  const Wide half = hn::Sqrt(half2);
  const Wide step = hn::Abs(at_middle) * hn::Sqrt(across2) / hn::Max(off, least);
  const Wide limb = (radius - off) / hn::Max(step * wide(body.pixel), least);
  const Wide depth = middle - half / hn::Sqrt(length2);
  Wide coverage = hn::Min(hn::Max(wide(0.5) + limb, hn::Zero(WideTag())), one);
  if (Perspective) {
    const auto beyond = hn::Ge(depth, wide(static_cast<double>(camera.near)));
    coverage = hn::IfThenElseZero(beyond, coverage);
  }
  return {depth, coverage, half / radius};
}

// The part of a pixel that lies between two edges, where one coordinate of the point that it shows
// is `at` and changes by `step` from one pixel to the next.
KERNEL_INLINE Wide between_edges(Wide at, Wide step, double low, double high) {
  const Wide inverse = wide(1) / hn::Max(step, wide(1e-300));
  const auto inside = [&](Wide distance) {
    const Wide part = hn::MulAdd(distance, inverse, wide(0.5));
    return hn::Min(hn::Max(part, hn::Zero(WideTag())), wide(1));
  };
  return hn::Max(inside(at - wide(low)) + inside(wide(high) - at) - wide(1), hn::Zero(WideTag()));
}

// A horizontal rectangle along the same rays.
template <bool Perspective>
KERNEL_INLINE BodyLanes ground_lanes(const Camera& camera, const Body& body, Wide x, Wide y) {
  Wide from[3];       // the point of the ray at depth 0, from the eye, world axes
  Wide direction[3];  // forward component 1
  for (int a = 0; a < 3; ++a) {
    const Wide aside = hn::MulAdd(x, wide(camera.world_right[a]), y * wide(camera.world_down[a]));
    const Wide forward = wide(camera.world_forward[a]);
    from[a] = Perspective ? hn::Zero(WideTag()) : aside;
    direction[a] = Perspective ? forward + aside : forward;
  }
  const Wide least = wide(1e-12);
  const Wide steep = hn::Abs(direction[2]);
  const Wide fall = hn::IfThenElse(hn::Lt(steep, least), least, direction[2]);
  const Wide inverse = wide(1) / fall;
  const Wide depth = (wide(body.low[2]) - from[2]) * inverse;
  // Change of the point that is shown along `aside`, per unit of depth in perspective.
  const auto change = [&](int a, const double aside[3]) {
    return hn::NegMulAdd(direction[a] * inverse, wide(aside[2]), wide(aside[a]));
  };
  const Wide scale = wide(body.pixel) * (Perspective ? hn::Abs(depth) : wide(1));
  Wide coverage = wide(1);
  for (int a = 0; a < 2; ++a) {
    const Wide right = change(a, camera.world_right);
    const Wide down = change(a, camera.world_down);
    const Wide step = hn::Sqrt(hn::MulAdd(right, right, down * down)) * scale;
    const Wide at = hn::MulAdd(depth, direction[a], from[a]);
    coverage = coverage * between_edges(at, step, body.low[a], body.high[a]);
  }
  if (Perspective) {
    const auto beyond = hn::Ge(depth, wide(static_cast<double>(camera.near)));
    coverage = hn::IfThenElseZero(beyond, coverage);
  }
  const Wide length2 =
      hn::MulAdd(direction[0], direction[0], hn::MulAdd(direction[1], direction[1], steep * steep));
  return {depth, coverage, steep / hn::Sqrt(length2)};
}

template <bool Perspective>
KERNEL_INLINE BodyLanes body_lanes(const Camera& camera, const Body& body, Wide x, Wide y) {
  if (body.shape == body_sphere) return sphere_lanes<Perspective>(camera, body, x, y);
  return ground_lanes<Perspective>(camera, body, x, y);
}

enum class BodyCover { none, part, whole };

// Fills the pixels of a block whose left upper corner is (left, top).
template <bool Perspective>
BodyCover fill_body_block(const Camera& camera, const Body& body, double left, double top,
                          BodyBlock& to) {
  BodyPixels at;
  at.left = left;
  at.top = top;
  for (int l = 0; l < block_pixels; ++l) {
    at.depth[l] = at.coverage[l] = at.cosine[l] = 0;
    at.relief[l] = 1;
    for (double& part : at.normal[l]) part = 0;
  }
  for (int l = 0; body.shape != body_terrain && l < block_pixels; l += wide_lanes) {
    const int row = l / block_side;
    const double down = top + row + 0.5 - static_cast<double>(camera.half_height_px);
    const double right = left + l % block_side + 0.5 - static_cast<double>(camera.half_width_px);
    const Wide x = (wide(right) + hn::Iota(WideTag(), 0)) * wide(body.pixel);
    const BodyLanes lanes = body_lanes<Perspective>(camera, body, x, wide(down * body.pixel));
    hn::Store(lanes.depth, WideTag(), at.depth + l);
    hn::Store(lanes.coverage, WideTag(), at.coverage + l);
    hn::Store(lanes.cosine, WideTag(), at.cosine + l);
  }
  if (body.terrain != nullptr) add_terrain(camera, body, at);
  for (int c = 0; c < 3; ++c) {
    for (float& light : to.rgb[c]) light = body.rgb[c];
  }
  if (body.paint != nullptr) paint_body(camera, body, at, to.rgb);
  alignas(64) float bright[block_pixels];
  for (float& factor : bright) factor = 1;
  if (body.light != nullptr) light_body(camera, body, left, top, at.depth, at.coverage, bright);
  to.nearest = body_nowhere;
  to.farthest = -body_nowhere;
  int covered = 0;
  for (int l = 0; l < block_pixels; ++l) {
    const bool sees = at.coverage[l] > 0;
    const float here = static_cast<float>(at.depth[l] - camera.depth_origin);
    to.depth[l] = sees ? here : body_nowhere;
    to.opacity[l] = static_cast<float>(at.coverage[l]);
    to.behind[l] = 1.0F - to.opacity[l];
    for (auto& channel : to.light) channel[l] = 0;
    const float shade = (body.ambient + (1.0F - body.ambient) * static_cast<float>(at.cosine[l])) *
                        static_cast<float>(at.relief[l]) * bright[l];
    for (auto& channel : to.rgb) channel[l] = smaller(shade * channel[l], 1.0F);
    to.nearest = smaller(to.nearest, to.depth[l]);
    to.farthest = larger(to.farthest, sees ? here : to.farthest);
    covered += to.opacity[l] >= 1.0F ? 1 : 0;
  }
  if (covered == block_pixels) return BodyCover::whole;
  return to.nearest < body_nowhere ? BodyCover::part : BodyCover::none;
}

bool open_body(const Camera& camera, const Body& body, const Tile& tile, TileBody& to) {
  to.nearest = body_nowhere;
  for (int row = 0; row < tile_blocks; ++row) {
    to.seen[row] = to.opaque[row] = 0;
    if (row >= blocks_of(tile.height)) continue;
    for (int column = 0; column < blocks_of(tile.width); ++column) {
      BodyBlock& block = to.blocks[row * tile_blocks + column];
      const double left = tile.x + column * block_side;
      const double top = tile.y + row * block_side;
      const BodyCover cover = camera.perspective != 0
                                  ? fill_body_block<true>(camera, body, left, top, block)
                                  : fill_body_block<false>(camera, body, left, top, block);
      const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
      if (cover != BodyCover::none) to.seen[row] |= bit;
      if (cover == BodyCover::whole) to.opaque[row] |= bit;
      to.nearest = smaller(to.nearest, block.nearest);
    }
  }
  return to.nearest < body_nowhere;
}

void close_surface(const TileBody& body, Tile& tile) {
  for (int row = 0; row < tile_blocks; ++row) {
    for (std::uint32_t left = body.seen[row]; left != 0; left &= left - 1U) {
      const int column = __builtin_ctz(left);
      const BodyBlock& from = body.blocks[row * tile_blocks + column];
      const Channels to = channels_of(block_at(tile, row, column));
      for (int l = 0; l < block_pixels; l += pixel_lanes) {
        const Pixel t = load<Pixel>(to.transmittance + l);
        const Pixel opacity = load<Pixel>(from.opacity + l);
        for (int c = 0; c < 3; ++c) {
          const Pixel light =
              hn::MulAdd(opacity, load<Pixel>(from.rgb[c] + l), load<Pixel>(from.light[c] + l));
          add_product(to.rgb[c] + l, t, light);
        }
        store(t * load<Pixel>(from.behind + l), to.transmittance + l);
      }
    }
  }
}

void close_body(Tile& tile) {
  for (int n = 0; n < tile.layers; ++n) close_surface(tile.layer[n], tile);
  close_surface(*tile.body, tile);
}

inline bool sees(const TileBody& body, int row, int column) {
  return (body.seen[row] >> static_cast<unsigned>(column) & 1U) != 0;
}

// Layers and body of a block, nearest first.
struct Surfaces {
  BodyBlock* of[layers_max + 1];
  int count;
};

inline Surfaces surfaces_at(const Tile& tile, int row, int column) {
  Surfaces found;
  found.count = 0;
  const int at = row * tile_blocks + column;
  for (int n = 0; n < tile.layers; ++n) {
    if (sees(tile.layer[n], row, column)) found.of[found.count++] = &tile.layer[n].blocks[at];
  }
  if (sees(*tile.body, row, column)) found.of[found.count++] = &tile.body->blocks[at];
  return found;
}

// Depths from the camera's depth origin between which a kernel lies.
struct KernelDepths {
  float first, last;
};

// The blocks of a window in which the body hides all of a kernel, and those in which a surface may
// divide it.
struct BodyWindow {
  std::uint64_t hidden, divided;
};

inline BodyWindow at_body(const Tile& tile, const KernelDepths& depths, const Window& window) {
  const TileBody& body = *tile.body;
  BodyWindow found = {0, 0};
  for (std::uint64_t blocks = window.blocks; blocks != 0; blocks &= blocks - 1U) {
    const int at = __builtin_ctzll(blocks);
    const int row = window.row + at / window_side;
    const int column = window.column + at % window_side;
    const int index = row * tile_blocks + column;
    const BodyBlock& block = body.blocks[index];
    const bool behind = sees(body, row, column) && depths.last > block.nearest;
    const bool layered = tile.layers > 0 && sees(tile.layer[0], row, column) &&
                         depths.last > tile.layer[0].blocks[index].nearest;
    if (!behind && !layered) continue;
    const bool opaque = (body.opaque[row] >> static_cast<unsigned>(column) & 1U) != 0;
    const bool all = behind && !layered && opaque && depths.first >= block.farthest;
    (all ? found.hidden : found.divided) |= std::uint64_t{1} << static_cast<unsigned>(at);
  }
  return found;
}

// A kernel that surfaces may divide.
struct DividedKernel {
  const Ribbon* line;  // or null
  const Splat* splat;  // or null
  int near;            // the splat has the near form
  float centre;        // depth of its position from the camera's depth origin
};

// A line at a vector of pixels, with its depth relative to the kernel position.
struct DividedLine {
  Pixel opacity, depth;
  Pixel color[3];
};

template <bool Perspective>
KERNEL_INLINE DividedLine divided_line(const Ribbon& ribbon, Pixel px, Pixel py) {
  constexpr Depth along = Perspective ? Depth::exact : Depth::flat;
  const RibbonLanes r = spread(ribbon);
  const RibbonLane lane = style_of(*ribbon.style) == style_chain
                              ? ribbon_lane<along, style_chain>(r, px - r.x, py - r.y)
                              : ribbon_lane<along, style_general>(r, px - r.x, py - r.y);
  DividedLine line;
  line.opacity = lane.opacity;
  line.depth = hn::MulAdd(lane.f, all<Pixel>(ribbon.depth_rise), all<Pixel>(ribbon.depth));
  for (int c = 0; c < 3; ++c) line.color[c] = line_color<style_general>(r, lane, c);
  return line;
}

// The part of a splat beyond the near plane: its optical depth, and the fractions of it before the
// body and before the line.
struct DividedSplat {
  Pixel tau, x_body, x_line;
};

// Depths are relative to the kernel position.
struct DividingDepths {
  Pixel body, line;
};

template <bool Perspective, From Start>
KERNEL_INLINE DividedSplat divided_from(const Splat& splat, const DividingDepths& at, Pixel px,
                                        Pixel py, Pixel length) {
  const auto s = spread_from<Start>(splat);
  const SplatLane lane = splat_lane<Perspective, Start>(s, px, py, length);
  return {depth_beyond<Start>(lane), fraction_before(s, lane, at.body),
          fraction_before(s, lane, at.line)};
}

template <bool Perspective>
KERNEL_INLINE DividedSplat divided_splat(const DividedKernel& kernel, const DividingDepths& at,
                                         Pixel px, Pixel py, Pixel length) {
  if constexpr (Perspective) {
    if (kernel.near != 0) {
      return divided_from<true, From::near_plane>(*kernel.splat, at, px, py, length);
    }
  }
  return divided_from<Perspective, From::eye>(*kernel.splat, at, px, py, length);
}

// Composites the part of a kernel before the first surface, and separately, where pixels let light
// through, the parts behind each one. A surface divides a splat as a line does: as if it were
// homogeneous over one cell or, if it may reach the near plane, exactly.
template <bool Perspective, int Compositing>
Light divided_block(const DividedKernel& kernel, float x, float y, const float* ray,
                    const Surfaces& surfaces, float* block) {
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel one = all<Pixel>(1.0F);
  const Pixel least = all<Pixel>(1e-6F);
  Light light;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel px = all<Pixel>(x) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(y) + load<Pixel>(lane_y + l);
    DividedLine line = {zero, zero, {zero, zero, zero}};
    if (kernel.line != nullptr) {
      line = divided_line<Perspective>(*kernel.line, px, py);
    }
    const Pixel length = kernel.splat != nullptr && Perspective ? load<Pixel>(ray + l) : one;
    DividedSplat splat = {zero, one, zero};
    Pixel color[3] = {zero, zero, zero};
    for (int c = 0; c < 3 && kernel.splat != nullptr; ++c) {
      color[c] = all<Pixel>(kernel.splat->color[c]);
    }
    // Where each surface ends what is before it: at itself or, in pixels that do not see it, at the
    // next one, so that nothing lies between them.
    Pixel ends[layers_max + 1];
    Pixel next = all<Pixel>(__builtin_inff());
    for (int n = surfaces.count; n-- > 0;) {
      next = hn::Min(next, load<Pixel>(surfaces.of[n]->depth + l) - all<Pixel>(kernel.centre));
      ends[n] = next;
    }
    Pixel begin = all<Pixel>(-__builtin_inff());  // depth of the last surface
    Pixel before = zero;                          // the fraction of the splat before it
    for (int n = 0; n <= surfaces.count; ++n) {
      const bool last = n == surfaces.count;
      const Pixel end = last ? all<Pixel>(__builtin_inff()) : ends[n];
      if (kernel.splat != nullptr && !last) {
        splat = divided_splat<Perspective>(kernel, {end, line.depth}, px, py, length);
      }
      const Pixel until = last ? one : splat.x_body;
      const auto within = hn::And(hn::Ge(line.depth, begin), hn::Lt(line.depth, end));
      const Pixel opacity = hn::IfThenElseZero(within, line.opacity);
      BodyBlock* const nearer = n > 0 ? surfaces.of[n - 1] : nullptr;
      const Channels into =
          nearer == nullptr
              ? channels_of(block)
              : Channels{nearer->behind, {nearer->light[0], nearer->light[1], nearer->light[2]}};
      const Pixel part = until - before;
      const Pixel place = splat.x_line - before;
      begin = end;
      before = until;
      if (Compositing == compositing_or) {
        const Pixel base = nearer == nullptr ? one : one - load<Pixel>(nearer->opacity + l);
        const auto left = add_or(opacity, line.color, base, into, l);
        if (nearer == nullptr) light.see(left);
        continue;
      }
      const Pixel t = load<Pixel>(into.transmittance + l);
      if (nearer != nullptr && hn::AllTrue(PixelTag(), hn::Eq(t, zero))) break;
      const Pixel here = splat.tau * part;
      Pixel left = t;
      if (kernel.line == nullptr) {
        const Attenuation<Pixel> medium = attenuation_by<Compositing>(here);
        for (int c = 0; c < 3; ++c) add_product(into.rgb[c] + l, t * medium.absorbed, color[c]);
        left = bounded_light<Compositing>(t * medium.transmitted);
      } else {
        const Pixel x_here = clamped(place / hn::Max(part, least), 0.0F, 1.0F);
        const CellLight cell = {here,  opacity,   x_here, attenuation_by<Compositing>(here),
                                color, line.color};
        left = bounded_light<Compositing>(t * add_cell<Compositing>(cell, t, into, l));
      }
      store(left, into.transmittance + l);
      if (nearer == nullptr) see_light<Compositing>(left, light);
    }
  }
  return light;
}

using DividedFunction = Light (*)(const DividedKernel& kernel, float x, float y, const float* ray,
                                  const Surfaces& surfaces, float* block);

template <bool Perspective>
inline DividedFunction divided_function(int compositing) {
  switch (compositing) {
    case compositing_simple:
      return divided_block<Perspective, compositing_simple>;
    case compositing_cd_naive:
      return divided_block<Perspective, compositing_cd_naive>;
    case compositing_cd:
      return divided_block<Perspective, compositing_cd>;
    case compositing_cd_euler:
      return divided_block<Perspective, compositing_cd_euler>;
    case compositing_or:
      return divided_block<Perspective, compositing_or>;
    default:
      return divided_block<Perspective, compositing_analytic>;
  }
}

// `lines`, `splats`: blocks of the window that the line and the splat may touch.
template <bool Perspective>
void draw_divided(const DividedKernel& kernel, int compositing, int row, int column,
                  std::uint64_t lines, std::uint64_t splats, Tile& tile) {
  const DividedFunction draw = divided_function<Perspective>(compositing);
  for (std::uint64_t blocks = lines | splats; blocks != 0; blocks &= blocks - 1U) {
    const int at = __builtin_ctzll(blocks);
    const int r = row + at / window_side;
    const int c = column + at % window_side;
    DividedKernel here = kernel;
    if ((lines >> static_cast<unsigned>(at) & 1U) == 0) here.line = nullptr;
    if ((splats >> static_cast<unsigned>(at) & 1U) == 0) here.splat = nullptr;
    const float* ray = here.splat != nullptr && Perspective ? rays_at(tile, r, c) : nullptr;
    const Light light = draw(here, left_of(tile, c), top_of(tile, r), ray, surfaces_at(tile, r, c),
                             block_at(tile, r, c));
    note_light(light, r, std::uint32_t{1} << static_cast<unsigned>(c), tile);
  }
  tile.counters.pixel_updates += std::int64_t{__builtin_popcountll(lines | splats)} * block_pixels;
  if (compositing == compositing_cd_euler) return;
  const int lined = compositing == compositing_analytic ? __builtin_popcountll(lines & splats) : 0;
  tile.counters.exponentials += std::int64_t{__builtin_popcountll(splats) + lined} * block_pixels;
}

}  // namespace
}  // namespace windsplat::engine::kernels
