// Part of the kernel body: contributions of one line and of one splat to a vector of pixels.
#pragma once

#include "server/engine/kernels/body_partial.hpp"
#include "server/engine/kernels/lines/body_marks.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine::kernels {
namespace {

// Style of a line: uniform colour, with a head, or with a head and, decided for each line, a moving
// texture, a mark or both.
constexpr int style_plain = 0;
constexpr int style_head = 1;
constexpr int style_general = 2;
constexpr int style_chain = 3;  // a segment of a chain, with a head and a moving texture

// The style that draws a line of any colours.
inline int style_of(const LineStyle& line) {
  if (line.chains.q != nullptr) return style_chain;
  return line.moving != 0 || line.marked != 0 ? style_general : style_head;
}

// Pixel centres of a block, relative to its corner.
alignas(64) constexpr float lane_x[block_pixels] = {0.5F, 1.5F, 2.5F, 3.5F, 0.5F, 1.5F, 2.5F, 3.5F,
                                                    0.5F, 1.5F, 2.5F, 3.5F, 0.5F, 1.5F, 2.5F, 3.5F};
alignas(64) constexpr float lane_y[block_pixels] = {0.5F, 0.5F, 0.5F, 0.5F, 1.5F, 1.5F, 1.5F, 1.5F,
                                                    2.5F, 2.5F, 2.5F, 2.5F, 3.5F, 3.5F, 3.5F, 3.5F};

// Constants of a line, broadcast to all lanes.
struct RibbonLanes {
  Pixel x, y, ux, uy;
  Pixel wx, wy, w0;   // w = wx dx + wy dy + w0
  Pixel ratio, bend;  // depth ratio, and depth ratio - 1
  Pixel tail[3], rise[3];
  Pixel phase, phase_rise;
  Pixel reach, steep, opacity;  // the ramp: clamp(reach - steep distance, 0, opacity)
  Pixel blur;                   // half of the dashes that a pixel has
  int moving, marked;
  int dashed;                                  // of a segment of a chain
  MarkLanes mark;                              // set if marked
  Pixel cut_x, cut_y, end_x, end_y, end_most;  // of a segment of a chain
};

// A line on the screen: from f = 0 to f = 1, what part of the whole line that is, and how many
// dashes it has.
struct RibbonSpan {
  float ux, uy, wx, wy;
  float whole, whole_rise, turns;
};

// Dashes are averaged over a pixel along the line, at least 1e-3 of a dash, where differences of
// integrals are exact enough, and at most 8, where none can be told apart.
inline float dash_blur(const RibbonSpan& span) {
  const float each = __builtin_sqrtf(span.wx * span.wx + span.wy * span.wy);
  return limited(0.5F * absolute(span.turns) * each, 1e-3F, 8.0F);
}

KERNEL_INLINE void spread_style(const LineStyle& line, const RibbonSpan& span, RibbonLanes& to) {
  to.reach = all<Pixel>(line.reach);
  to.steep = all<Pixel>(line.steep);
  to.opacity = all<Pixel>(line.opacity);
  to.moving = line.moving;
  to.marked = line.marked;
  to.dashed = line.chains.turn != nullptr && line.moving != 0 ? 1 : 0;
  to.blur = all<Pixel>(to.dashed != 0 ? dash_blur(span) : 0.0F);
  if (line.marked != 0) {
    to.mark = spread_mark(line, span.ux, span.uy, {span.whole, span.whole_rise});
  }
}

KERNEL_INLINE RibbonLanes spread(const Ribbon& r) {
  const auto lanes = [](float v) { return all<Pixel>(v); };
  RibbonLanes out;
  out.x = lanes(r.x);
  out.y = lanes(r.y);
  out.ux = lanes(r.ux);
  out.uy = lanes(r.uy);
  out.wx = lanes(r.wx);
  out.wy = lanes(r.wy);
  out.w0 = lanes(r.w0);
  out.ratio = lanes(r.depth_ratio);
  out.bend = lanes(r.bend);
  for (int c = 0; c < 3; ++c) {
    out.tail[c] = lanes(r.tail[c]);
    out.rise[c] = lanes(r.rise[c]);
  }
  out.phase = lanes(r.phase);
  out.phase_rise = lanes(r.phase_rise);
  out.cut_x = lanes(r.cut_x);
  out.cut_y = lanes(r.cut_y);
  out.end_x = lanes(r.end_x);
  out.end_y = lanes(r.end_y);
  out.end_most = lanes(r.end_most);
  spread_style(*r.style, {r.ux, r.uy, r.wx, r.wy, r.whole, r.whole_rise, r.phase_rise}, out);
  return out;
}

// The same from the arrays of a brick.
KERNEL_INLINE RibbonLanes spread(const LineStyle& line, const Ribbons& r, int l) {
  const auto lanes = [&](const float* v) { return all<Pixel>(v[l]); };
  const auto one = [](float v) { return all<Pixel>(v); };
  const float* tail = r.tail[l];
  const float* rise = r.rise[l];
  RibbonLanes out;
  out.x = lanes(r.x);
  out.y = lanes(r.y);
  out.ux = lanes(r.ux);
  out.uy = lanes(r.uy);
  out.wx = lanes(r.wx);
  out.wy = lanes(r.wy);
  out.w0 = lanes(r.w0);
  out.ratio = lanes(r.depth_ratio);
  out.bend = lanes(r.bend);
  for (int c = 0; c < 3; ++c) {
    out.tail[c] = one(tail[c]);
    out.rise[c] = one(rise[c]);
  }
  out.phase = out.phase_rise = hn::Zero(PixelTag());
  const int style = style_of(line);
  if (style == style_chain || line.moving != 0) {
    out.phase = lanes(r.phase);
    out.phase_rise = lanes(r.phase_rise);
  }
  out.cut_x = out.cut_y = out.end_x = out.end_y = out.end_most = hn::Zero(PixelTag());
  if (style == style_chain) {
    out.cut_x = lanes(r.cut_x);
    out.cut_y = lanes(r.cut_y);
    out.end_x = lanes(r.end_x);
    out.end_y = lanes(r.end_y);
    out.end_most = lanes(r.end_most);
  }
  RibbonSpan span = {r.ux[l], r.uy[l], r.wx[l], r.wy[l], 0, 1, 0};
  if (style == style_chain) {
    span.whole = r.whole[l];
    span.whole_rise = r.whole_rise[l];
    span.turns = r.phase_rise[l];
  }
  spread_style(line, span, out);
  return out;
}

struct RibbonLane {
  Pixel opacity;
  Pixel f;
  Pixel light;  // part of the opacity that has light: less than 1 in a halo; of style_general
};

// How f is computed from w, the position along the line on the screen, where 1/z is linear. The
// error of the series is below bend^2 / 6.
enum class Depth { flat, series, exact };
constexpr float series_bend_max = 4e-3F;

template <Depth Along>
KERNEL_INLINE Pixel along_ribbon(const RibbonLanes& r, Pixel w) {
  const Pixel one = all<Pixel>(1.0F);
  if (Along == Depth::exact) return w * r.ratio / hn::MulAdd(w, r.bend, one);
  if (Along == Depth::series) {
    return hn::MulAdd(hn::NegMulAdd(w, w, w), r.bend, w);
  }
  return w;
}

// The integral of W over [0, p].
KERNEL_INLINE Pixel dash_integral(Pixel p) {
  const Pixel half = all<Pixel>(0.5F);
  const Pixel whole = hn::Floor(p);
  const Pixel part = p - whole;
  const Pixel square = part * part;
  const Pixel falling = hn::MulAdd(all<Pixel>(2.0F), part, hn::Neg(square)) - half;
  return hn::MulAdd(half, whole, hn::IfThenElse(hn::Lt(part, half), square, falling));
}

// The mean of W over [p - blur, p + blur].
KERNEL_INLINE Pixel mean_dash(Pixel p, Pixel blur) {
  const Pixel mean = (dash_integral(p + blur) - dash_integral(p - blur)) / (blur + blur);
  return clamped(mean, hn::Zero(PixelTag()), all<Pixel>(1.0F));
}

// dx, dy: pixels from the point f = 0 of the line.
template <Depth Along, int Style>
KERNEL_INLINE RibbonLane ribbon_lane(const RibbonLanes& r, Pixel dx, Pixel dy) {
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel one = all<Pixel>(1.0F);
  const Pixel along = hn::MulAdd(dx, r.wx, hn::MulAdd(dy, r.wy, r.w0));
  const Pixel w = clamped(along, zero, one);
  Pixel light = one;
  Pixel cover = zero;
  if ((Style == style_general || Style == style_chain) && r.marked != 0) {
    const MarkCover found = mark_cover(r.mark, {r.ux, r.uy, r.steep, r.opacity}, along, w, dx, dy);
    cover = found.whole;
    light = found.line / hn::Max(found.whole, all<Pixel>(1e-30F));
  } else {
    const Pixel ex = hn::NegMulAdd(w, r.ux, dx);
    const Pixel ey = hn::NegMulAdd(w, r.uy, dy);
    const Pixel distance = hn::Sqrt(hn::MulAdd(ex, ex, ey * ey));
    cover = clamped(hn::NegMulAdd(distance, r.steep, r.reach), zero, r.opacity);
  }
  if (Style == style_chain) {
    // The next segment computes its cut from the same numbers in the same order as this its end.
    const Pixel from_cut = hn::MulAdd(r.cut_x, dx, r.cut_y * dy);
    const Pixel to_end = hn::MulAdd(r.end_x, dx - r.ux, r.end_y * (dy - r.uy));
    cover = hn::IfThenElseZero(hn::And(hn::Ge(from_cut, zero), hn::Lt(to_end, r.end_most)), cover);
  }
  if (Style == style_plain) return {cover, zero, one};
  const Pixel f = along_ribbon<Along>(r, w);
  if (Style == style_chain || (Style == style_general && r.moving != 0)) {
    // W(frac(q + 1/2 - phase)), W(p) = 1 - |2 p - 1|.
    const Pixel shifted = hn::MulAdd(f, r.phase_rise, r.phase);
    if (Style == style_chain && r.dashed != 0) {
      return {cover * mean_dash(shifted, r.blur), f, light};
    }
    const Pixel p = hn::IfThenElse(hn::Ge(shifted, one), shifted - one, shifted);
    cover = cover * (one - hn::Abs(hn::MulSub(all<Pixel>(2.0F), p, one)));
  }
  return {cover, f, light};
}

// One channel of the straight colour of a line at a vector of pixels.
template <int Style>
KERNEL_INLINE Pixel line_color(const RibbonLanes& r, const RibbonLane& lane, int c) {
  if (Style == style_plain) return r.tail[c];
  const Pixel color = hn::MulAdd(lane.f, r.rise[c], r.tail[c]);
  return Style == style_general || Style == style_chain ? color * lane.light : color;
}

// Constants of a splat, broadcast to all lanes.
struct SplatLanes {
  Pixel x, y, ex, ey, xx, xy, yy;
  Pixel b0, bx, by, d0, dx, dy, dxx, dxy, dyy, d2_least;
  Pixel z, near, strength;
  Pixel color[3];
};

KERNEL_INLINE SplatLanes spread(const Splat& s) {
  const auto lanes = [](float v) { return all<Pixel>(v); };
  const SplatForm& f = s.form;
  return {
      lanes(f.x),    lanes(f.y),        lanes(f.ex),
      lanes(f.ey),   lanes(f.xx),       lanes(f.xy),
      lanes(f.yy),   lanes(f.b0),       lanes(f.bx),
      lanes(f.by),   lanes(f.d0),       lanes(f.dx),
      lanes(f.dy),   lanes(f.dxx),      lanes(f.dxy),
      lanes(f.dyy),  lanes(f.d2_least), lanes(s.z),
      lanes(s.near), lanes(s.strength), {lanes(s.color[0]), lanes(s.color[1]), lanes(s.color[2])}};
}

// The same for a splat that may reach the near plane.
struct NearLanes {
  Pixel x, y;
  Three<Pixel> centre, ahead, right, down;
  Pixel d2_least, z, near, strength;
  Pixel color[3];
};

KERNEL_INLINE NearLanes spread_near(const Splat& s) {
  const auto lanes = [](float v) { return all<Pixel>(v); };
  const auto three = [&](const float v[3]) {
    return Three<Pixel>{lanes(v[0]), lanes(v[1]), lanes(v[2])};
  };
  const NearForm& f = s.near_form;
  return {lanes(f.x),
          lanes(f.y),
          three(f.centre),
          three(f.ahead),
          three(f.right),
          three(f.down),
          lanes(f.d2_least),
          lanes(s.z),
          lanes(s.near),
          lanes(s.strength),
          {lanes(s.color[0]), lanes(s.color[1]), lanes(s.color[2])}};
}

// A splat along the rays of pixels; see Splats.
struct SplatLane {
  Pixel r2;      // squared distance from the centre, cells
  Pixel tau;     // optical depth of the whole splat
  Pixel cells;   // ray length in cells per unit of view depth
  Pixel behind;  // view depth of the point closest to the centre minus that of the centre
  Pixel before;  // near plane only: part of the splat before it
};

// Start of the rays. `eye`: the splat lies beyond the near plane. `eye_inside`: the same, and its
// centre lies in the picture, so that (ex, ey) is (x, y). `near_plane`: the splat may reach the
// near plane; the part before it is removed. `afar`: as `eye_inside`, with AfarLanes.
enum class From { eye, eye_inside, near_plane, afar };

// Constants of a splat seen from afar (Splats::afar), broadcast to all lanes: the form and |d|^2 -
// d0 over d0, and the strength over |d| at the centre.
struct AfarLanes {
  Pixel x, y, xx, xy, yy, dx, dy, dxx, dxy, dyy;
  Pixel strength;
  Pixel color[3];
};

KERNEL_INLINE AfarLanes spread_afar(const Splats& s, const float* color, int l) {
  const Pixel inverse = all<Pixel>(s.inverse[l]);
  const Pixel inverse2 = inverse * inverse;
  const auto over = [&](const float* v) { return all<Pixel>(v[l]) * inverse2; };
  return {all<Pixel>(s.x[l]),
          all<Pixel>(s.y[l]),
          over(s.xx),
          over(s.xy),
          over(s.yy),
          over(s.dx),
          over(s.dy),
          over(s.dxx),
          over(s.dxy),
          over(s.dyy),
          all<Pixel>(s.strength[l]) * inverse,
          {all<Pixel>(color[0]), all<Pixel>(color[1]), all<Pixel>(color[2])}};
}

template <From Start>
KERNEL_INLINE auto spread_from(const Splat& s) {
  if constexpr (Start == From::near_plane) {
    return spread_near(s);
  } else {
    return spread(s);
  }
}

// Pixels from the two points of a splat to those of a vector: (dx, dy) from its projected centre,
// (ex, ey) from the point of the picture near it.
struct SplatPixels {
  Pixel dx, dy, ex, ey;

  KERNEL_INLINE SplatPixels moved(Pixel x, Pixel y) const {
    return {dx + x, dy + y, ex + x, ey + y};
  }
};

template <From Start>
KERNEL_INLINE SplatPixels pixels_from(const SplatLanes& s, Pixel px, Pixel py) {
  const Pixel dx = px - s.x;
  const Pixel dy = py - s.y;
  if (Start == From::eye_inside) return {dx, dy, dx, dy};
  return {dx, dy, px - s.ex, py - s.ey};
}

template <From Start>
KERNEL_INLINE SplatPixels pixels_from(const AfarLanes& s, Pixel px, Pixel py) {
  const Pixel dx = px - s.x;
  const Pixel dy = py - s.y;
  return {dx, dy, dx, dy};
}

template <From Start>
KERNEL_INLINE SplatPixels pixels_from(const NearLanes& s, Pixel px, Pixel py) {
  const Pixel zero = hn::Zero(PixelTag());
  return {px - s.x, py - s.y, zero, zero};
}

// xx dx^2 + xy dx dy + yy dy^2, which is not negative, but its rounded sum may be.
template <class Lanes>
KERNEL_INLINE Pixel quadratic_at(const Lanes& s, const SplatPixels& p) {
  const Pixel slope = hn::MulAdd(s.xx, p.dx, s.xy * p.dy);
  return hn::Max(hn::MulAdd(slope, p.dx, s.yy * p.dy * p.dy), hn::Zero(PixelTag()));
}

// The optical depth of a whole splat, which lies beyond the near plane.
template <bool Perspective, From Start>
KERNEL_INLINE Pixel splat_depth(const SplatLanes& s, const SplatPixels& p, Pixel ray) {
  static_assert(Start != From::near_plane, "such splats have the near form");
  const Pixel top = quadratic_at(s, p);
  const Pixel root = hn::Sqrt(top);
  if (!Perspective) return s.strength * footprint(root, top);
  const Pixel ex = Start == From::eye_inside ? p.dx : p.ex;
  const Pixel ey = Start == From::eye_inside ? p.dy : p.ey;
  const Pixel across = hn::MulAdd(s.dxx, ex, hn::MulAdd(s.dxy, ey, s.dx));
  const Pixel along = hn::MulAdd(s.dyy, ey, s.dy);
  const Pixel length2 = hn::Max(hn::MulAdd(across, ex, hn::MulAdd(along, ey, s.d0)), s.d2_least);
  const Pixel inverse = inverse_root(length2);
  const Pixel r = root * inverse;  // neither root waits for the other
  return footprint(r, r * r) * (inverse * (s.strength * ray));
}

// The same from afar: (1 + q)^(-1/2) by four terms, whose error is below q^4 / 3.
template <bool Perspective, From Start>
KERNEL_INLINE Pixel splat_depth(const AfarLanes& s, const SplatPixels& p, Pixel ray) {
  static_assert(Perspective && Start == From::afar, "only such splats have these lanes");
  const Pixel root = hn::Sqrt(quadratic_at(s, p));
  const Pixel across = hn::MulAdd(s.dxx, p.dx, hn::MulAdd(s.dxy, p.dy, s.dx));
  const Pixel along = hn::MulAdd(s.dyy, p.dy, s.dy);
  const Pixel q = hn::MulAdd(across, p.dx, along * p.dy);
  const Pixel bend =
      hn::MulAdd(hn::NegMulAdd(q, all<Pixel>(0.3125F), all<Pixel>(0.375F)), q, all<Pixel>(-0.5F));
  const Pixel inverse = hn::MulAdd(bend, q, all<Pixel>(1.0F));
  const Pixel r = root * inverse;
  return footprint(r, r * r) * (inverse * (s.strength * ray));
}

template <bool Perspective, From Start>
KERNEL_INLINE SplatLane splat_lane(const SplatLanes& s, const SplatPixels& p, Pixel ray) {
  static_assert(Start != From::near_plane, "such splats have the near form");
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel dx = p.dx;
  const Pixel dy = p.dy;
  const Pixel top = quadratic_at(s, p);
  if constexpr (Perspective) {
    const Pixel ex = Start == From::eye_inside ? dx : p.ex;
    const Pixel ey = Start == From::eye_inside ? dy : p.ey;
    const Pixel across = hn::MulAdd(s.dxx, ex, s.dxy * ey);
    const Pixel along = s.dyy * ey;
    const Pixel bent = hn::MulAdd(across, ex, along * ey);
    const Pixel length2 =
        hn::Max(hn::MulAdd(s.dx + across, ex, hn::MulAdd(s.dy + along, ey, s.d0)), s.d2_least);
    const Pixel inverse = inverse_root(length2);
    const Pixel inverse2 = inverse * inverse;
    const Pixel r = hn::Sqrt(top) * inverse;  // neither root waits for the other
    const Pixel r2 = r * r;
    const Pixel tau = s.strength * footprint(r, r2) * (inverse * ray);
    const Pixel cells = length2 * inverse;
    const Pixel behind =
        hn::NegMulAdd(s.z, bent, hn::MulAdd(s.bx, ex, hn::MulAdd(s.by, ey, s.b0))) * inverse2;
    return {r2, tau, cells, behind, zero};
  } else {
    const Pixel behind = hn::MulAdd(s.bx, dx, s.by * dy);
    return {top, s.strength * footprint(hn::Sqrt(top), top), hn::Sqrt(s.d0), behind, zero};
  }
}

// The part of a splat before a view depth relative to its centre's.
KERNEL_INLINE Pixel part_before(const SplatLane& lane, Pixel depth) {
  const Pixel half_chords = (depth - lane.behind) * (lane.cells * inverse_half_chord(lane.r2));
  return partial_at(partial_terms_at(lane.r2), clamped(half_chords, -1.0F, 1.0F));
}

// From vectors, because the projected centre of a splat beside the eye is at infinity.
template <bool Perspective, From Start>
KERNEL_INLINE SplatLane splat_lane(const NearLanes& s, const SplatPixels& p, Pixel ray) {
  static_assert(Perspective && Start == From::near_plane, "only such splats have the near form");
  const Pixel right = p.dx;
  const Pixel down = p.dy;
  const auto along = [&](Pixel ahead, Pixel by_right, Pixel by_down) {
    return hn::MulAdd(right, by_right, hn::MulAdd(down, by_down, ahead));
  };
  const Three<Pixel> d = {along(s.ahead.x, s.right.x, s.down.x),
                          along(s.ahead.y, s.right.y, s.down.y),
                          along(s.ahead.z, s.right.z, s.down.z)};
  const Three<Pixel> normal = cross3(s.centre, d);
  const Pixel length2 = hn::Max(dot3(d, d), s.d2_least);
  const Pixel inverse = inverse_root(length2);
  const Pixel inverse2 = inverse * inverse;
  SplatLane lane;
  lane.r2 = dot3(normal, normal) * inverse2;
  lane.tau = s.strength * footprint(hn::Sqrt(lane.r2), lane.r2) * (inverse * ray);
  lane.cells = length2 * inverse;
  lane.behind = hn::MulSub(dot3(s.centre, d), inverse2, s.z);
  lane.before = part_before(lane, s.near - s.z);
  return lane;
}

// The same at pixels of the picture.
template <bool Perspective, From Start, class Lanes>
KERNEL_INLINE SplatLane splat_lane(const Lanes& s, Pixel px, Pixel py, Pixel ray) {
  return splat_lane<Perspective, Start>(s, pixels_from<Start>(s, px, py), ray);
}

// Optical depth of the part of a splat beyond the near plane.
template <From Start>
KERNEL_INLINE Pixel depth_beyond(const SplatLane& lane) {
  if constexpr (Start != From::near_plane) {
    return lane.tau;
  } else {
    return lane.tau * (all<Pixel>(1.0F) - lane.before);
  }
}

template <bool Perspective, From Start>
KERNEL_INLINE Pixel splat_depth(const NearLanes& s, const SplatPixels& p, Pixel ray) {
  return depth_beyond<Start>(splat_lane<Perspective, Start>(s, p, ray));
}

// The fraction of that part in front of a surface whose depth relative to the centre is `depth`.
KERNEL_INLINE Pixel fraction_before(const SplatLanes& /*s*/, const SplatLane& lane, Pixel depth) {
  return clamped(hn::MulAdd(depth - lane.behind, lane.cells, all<Pixel>(0.5F)), 0.0F, 1.0F);
}

KERNEL_INLINE Pixel fraction_before(const NearLanes& /*s*/, const SplatLane& lane, Pixel depth) {
  const Pixel rest = hn::Max(all<Pixel>(1.0F) - lane.before, all<Pixel>(1e-6F));
  return clamped((part_before(lane, depth) - lane.before) / rest, 0.0F, 1.0F);
}

}  // namespace
}  // namespace windsplat::engine::kernels
