// Part of the kernel body: one line, one splat or both composited into one block of pixels.
#pragma once

#include "server/engine/kernels/body_lines.hpp"
#include "server/engine/kernels/body_splats.hpp"

namespace windsplat::engine::kernels {
namespace {

// scene::Compositing and scene::LineColor are told by their numbers.
constexpr int compositing_simple = 0;
constexpr int compositing_cd_naive = 1;
constexpr int compositing_cd = 2;
constexpr int compositing_analytic = 3;
constexpr int compositing_cd_euler = 4;

// How a line looks along itself: of one colour, with a head, with a head and a moving texture.
constexpr int style_plain = 0;
constexpr int style_head = 1;
constexpr int style_moving = 2;

// Pixel centres of a block, from its corner.
alignas(64) constexpr float lane_x[block_pixels] = {0.5F, 1.5F, 2.5F, 3.5F, 0.5F, 1.5F, 2.5F, 3.5F,
                                                    0.5F, 1.5F, 2.5F, 3.5F, 0.5F, 1.5F, 2.5F, 3.5F};
alignas(64) constexpr float lane_y[block_pixels] = {0.5F, 0.5F, 0.5F, 0.5F, 1.5F, 1.5F, 1.5F, 1.5F,
                                                    2.5F, 2.5F, 2.5F, 2.5F, 3.5F, 3.5F, 3.5F, 3.5F};

struct RibbonLane {
  float opacity;
  float f;
};

template <bool Perspective, int Style>
inline RibbonLane ribbon_lane(const Ribbon& r, float px, float py) {
  const float dx = px - r.x;
  const float dy = py - r.y;
  const float w = clamped((dx * r.ux + dy * r.uy) * r.inverse_u2 + r.w0, 0.0F, 1.0F);
  const float ex = dx - w * r.ux;
  const float ey = dy - w * r.uy;
  const float distance = square_root(ex * ex + ey * ey);
  const float cover = clamped((r.r2 - distance) * r.inverse_ramp, 0.0F, 1.0F);
  // 1/z is linear on the screen.
  const float f = Perspective ? w * r.depth_ratio / (1.0F + w * (r.depth_ratio - 1.0F)) : w;
  if (Style == style_moving) {
    // W(frac(q + 1/2 - phase)), W(p) = 1 - |2 p - 1|.
    const float place = r.phase + f * r.phase_rise;
    const float p = place >= 1.0F ? place - 1.0F : place;
    return {cover * r.opacity * (1.0F - absolute(2.0F * p - 1.0F)), f};
  }
  return {cover * r.opacity, f};
}

// Where a pixel's ray passes a splat, see Splats.
struct SplatLane {
  float r2;      // squared distance from the centre, cells
  float tau;     // optical depth of the whole splat
  float cells;   // per unit of view depth along the ray
  float behind;  // how far beyond the centre's view depth the ray is closest to it
};

// From: the rays' beginning. `eye`: far before the splat. `near_plane`: the splat reaches it, and
// the part of it that lies before counts no more, as if the splat were even over one cell.
enum class From { eye, near_plane };

template <bool Perspective, From Start>
inline SplatLane splat_lane(const Splat& s, float px, float py, float ray) {
  const float dx = px - s.x;
  const float dy = py - s.y;
  // The quadratic form is never negative; its rounded sum may be.
  const float top = larger(s.xx * (dx * dx) + s.xy * (dx * dy) + s.yy * (dy * dy), 0.0F);
  if constexpr (Perspective) {
    const float ex = px - s.ex;
    const float ey = py - s.ey;
    const float bent = s.dxx * (ex * ex) + s.dxy * (ex * ey) + s.dyy * (ey * ey);
    const float length2 = larger(s.d0 + (s.dx * ex + s.dy * ey + bent), s.d2_least);
    const float inverse = 1.0F / square_root(length2);
    const float inverse2 = inverse * inverse;
    const float r2 = top * inverse2;
    const float tau = s.strength * footprint(r2, square_root(r2)) * (inverse * ray);
    const float cells = length2 * inverse;
    const float behind = (s.b0 + s.bx * ex + s.by * ey - s.z * bent) * inverse2;
    const float beyond = 0.5F + ((s.z - s.near) + behind) * cells;
    const float kept = Start == From::near_plane ? tau * clamped(beyond, 0.0F, 1.0F) : tau;
    return {r2, kept, cells, behind};
  } else {
    const float behind = s.bx * dx + s.by * dy;
    return {top, s.strength * footprint(top, square_root(top)), square_root(s.d0), behind};
  }
}

struct Channels {
  float* transmittance;
  float* alpha;
  float* rgb[3];
};

inline Channels channels_of(float* block) {
  constexpr std::ptrdiff_t lanes = block_pixels;
  return {block, block + lanes, {block + 2 * lanes, block + 3 * lanes, block + 4 * lanes}};
}

// Forward Euler takes the optical depth itself for the absorbed part: stable below 1 alone. Bounded
// so that a picture that diverges stays a number.
inline Attenuation euler_attenuation(float tau) {
  const float bounded = smaller(tau, 1e6F);
  return {bounded, 1.0F - bounded};
}

template <int Compositing>
inline Attenuation attenuation_by(float tau) {
  return Compositing == compositing_cd_euler ? euler_attenuation(tau) : attenuation(tau);
}

inline float bounded_light(float transmittance) { return clamped(transmittance, -1e12F, 1e12F); }

// What is left of a line's light in front of which the part `place` of the medium lies.
template <int Compositing>
inline float light_before(const Attenuation& medium, float tau, float place) {
  if (Compositing == compositing_simple) return medium.transmitted;
  // tau is finite (the plan bounds extinctions), so that 0 times it is 0.
  if (Compositing == compositing_analytic) return attenuation(tau * place).transmitted;
  return 1.0F - place * medium.absorbed;
}

using LineFunction = void (*)(const Ribbon& r, float x, float y, float* block);
using SplatFunction = void (*)(const Splat& s, float x, float y, const float* ray, float* block);
using BothFunction = void (*)(const Ribbon& r, const Splat& s, float x, float y, const float* ray,
                              float* block);

template <bool Perspective, int Style>
void line_block(const Ribbon& ribbon, float x, float y, float* __restrict block) {
  const Ribbon r = ribbon;
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const RibbonLane lane = ribbon_lane<Perspective, Style>(r, x + lane_x[l], y + lane_y[l]);
    const float t = to.transmittance[l];
    const float a = t * lane.opacity;
    for (int c = 0; c < 3; ++c) {
      const float color = Style != style_plain ? r.tail[c] + lane.f * r.rise[c] : r.tail[c];
      to.rgb[c][l] += a * color;
    }
    to.alpha[l] += a;
    to.transmittance[l] = t * (1.0F - lane.opacity);
  }
}

template <bool Perspective, int Compositing, From Start>
void splat_block(const Splat& splat, float x, float y, const float* __restrict ray,
                 float* __restrict block) {
  const Splat s = splat;
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const float length = Perspective ? ray[l] : 1.0F;
    const SplatLane lane = splat_lane<Perspective, Start>(s, x + lane_x[l], y + lane_y[l], length);
    const Attenuation medium = attenuation_by<Compositing>(lane.tau);
    const float t = to.transmittance[l];
    const float a = t * medium.absorbed;
    for (int c = 0; c < 3; ++c) to.rgb[c][l] += a * s.color[c];
    to.alpha[l] += a;
    const float left = t * medium.transmitted;
    to.transmittance[l] = Compositing == compositing_cd_euler ? bounded_light(left) : left;
  }
}

// A line inside its homogeneous cell, at x = tf / tau of the way through it:
// A = -expm1(-tau) + a exp(-tau), I = c_s A + a exp(-tf) (c_v - c_s).
template <bool Perspective, int Compositing, int Style, From Start>
void both_block(const Ribbon& ribbon, const Splat& splat, float x, float y,
                const float* __restrict ray, float* __restrict block) {
  const Ribbon r = ribbon;
  const Splat s = splat;
  const Channels to = channels_of(block);
  for (int l = 0; l < block_pixels; ++l) {
    const float px = x + lane_x[l];
    const float py = y + lane_y[l];
    const RibbonLane line = ribbon_lane<Perspective, Style>(r, px, py);
    const SplatLane lane = splat_lane<Perspective, Start>(s, px, py, Perspective ? ray[l] : 1.0F);
    const Attenuation medium = attenuation_by<Compositing>(lane.tau);
    const float past = (r.depth + line.f * r.depth_rise) - lane.behind;
    const float place = clamped(0.5F + past * lane.cells, 0.0F, 1.0F);
    const float t = to.transmittance[l];
    if (Compositing == compositing_cd_naive) {
      // The paper's first form: front part, line and back part one over the other, where the ray
      // meets the line at all.
      const float met = line.opacity > 0 ? place : 1.0F;
      const float front = met * medium.absorbed;
      const float back = (1.0F - met) * medium.absorbed;
      const float own = (1.0F - front) * line.opacity;
      const float rest = (1.0F - front) * (1.0F - line.opacity);
      const float absorbed = front + rest * back;
      for (int c = 0; c < 3; ++c) {
        const float color = r.tail[c] + line.f * r.rise[c];
        to.rgb[c][l] += t * (s.color[c] * absorbed + own * color);
      }
      to.alpha[l] += t * (absorbed + own);
      to.transmittance[l] = t * (rest * (1.0F - back));
      continue;
    }
    const float before = light_before<Compositing>(medium, lane.tau, place);
    const float a = medium.absorbed + line.opacity * medium.transmitted;
    const float own = line.opacity * before;
    for (int c = 0; c < 3; ++c) {
      const float color = r.tail[c] + line.f * r.rise[c];
      to.rgb[c][l] += t * (s.color[c] * a + own * (color - s.color[c]));
    }
    to.alpha[l] += t * a;
    const float left = t * (medium.transmitted * (1.0F - line.opacity));
    to.transmittance[l] = Compositing == compositing_cd_euler ? bounded_light(left) : left;
  }
}

// The functions that a pass composites with, chosen once a brick.
struct Compositor {
  LineFunction line;
  SplatFunction splat, near_splat;
  BothFunction both, near_both;
  int splat_exponentials;  // a pixel
  int both_exponentials;
};

inline int style_of(const LineStyle& line) {
  if (line.moving != 0) return style_moving;
  return line.head_desaturation > 0 ? style_head : style_plain;
}

template <bool Perspective, int Compositing>
inline Compositor compositor_with(int style) {
  constexpr From near = Perspective ? From::near_plane : From::eye;
  constexpr bool euler = Compositing == compositing_cd_euler;
  constexpr int splat = euler ? 0 : 1;
  constexpr int both = Compositing == compositing_analytic ? 2 : splat;
  Compositor c = {line_block<Perspective, style_plain>,
                  splat_block<Perspective, Compositing, From::eye>,
                  splat_block<Perspective, Compositing, near>,
                  both_block<Perspective, Compositing, style_head, From::eye>,
                  both_block<Perspective, Compositing, style_head, near>,
                  splat,
                  both};
  if (style == style_head) c.line = line_block<Perspective, style_head>;
  if (style == style_moving) {
    c.line = line_block<Perspective, style_moving>;
    c.both = both_block<Perspective, Compositing, style_moving, From::eye>;
    c.near_both = both_block<Perspective, Compositing, style_moving, near>;
  }
  return c;
}

template <bool Perspective>
inline Compositor compositor_of(const Pass& pass) {
  const int style = style_of(pass.line);
  switch (pass.compositing) {
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
