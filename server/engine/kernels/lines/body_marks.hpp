// Part of the kernel body: lines of varying width, with an arrow head or with a halo; the formulas
// of "Marks" in docs/design/rendering-model.md.
#pragma once

#include "server/engine/kernels/body_math.hpp"
#include "server/engine/kernels/frame_data.hpp"

namespace windsplat::engine::kernels {
namespace {

// The half width changes by at most half a pixel a pixel, and a head takes at most half a line, so
// that marks vanish continuously from lines seen end-on.
constexpr float narrowing_of_length = 0.25F;
constexpr float head_of_length = 0.5F;

// Constants of the mark of a line, broadcast to all lanes; lengths in pixels.
struct MarkLanes {
  Pixel reach, widen;            // the ramp's reach at the tail, and its change to the head
  Pixel shaft;                   // part of the length before the head of an arrow
  Pixel length, inverse_length;  // of the line
  Pixel head, head_half;         // length and half width of the head
  Pixel head_slope, head_steep;
  Pixel halo;
  int arrow;
};

// The part of a whole line that is drawn: 0 and 1 of a straight line. A segment of a chain narrows
// as a straight line of the length that the whole would have, were all of it as long as this part.
struct PartOfLine {
  float from, rise;
};

KERNEL_INLINE MarkLanes spread_mark(const LineStyle& line, float ux, float uy,
                                    const PartOfLine& part) {
  const float length = __builtin_sqrtf(ux * ux + uy * uy);
  const float least = 1e-6F * line.r2;
  const float most = narrowing_of_length * length / larger(part.rise, 1e-6F);
  const float narrowing = limited(line.narrowing, -most, most);
  const float head = smaller(line.head_length, head_of_length * length);
  const float inverse = 1.0F / larger(length, least);
  MarkLanes out;
  out.reach = all<Pixel>(line.steep * (line.half_width + narrowing * (1.0F - 2.0F * part.from)) +
                         0.5F * line.opacity);
  out.widen = all<Pixel>(-2.0F * line.steep * narrowing * part.rise);
  out.shaft = all<Pixel>(1.0F - head * inverse);
  out.length = all<Pixel>(length);
  out.inverse_length = all<Pixel>(inverse);
  out.head = all<Pixel>(head);
  out.head_half = all<Pixel>(head * line.head_slope);
  out.head_slope = all<Pixel>(line.head_slope);
  out.head_steep = all<Pixel>(line.head_steep);
  out.halo = all<Pixel>(line.halo);
  out.arrow = line.head_length > 0 ? 1 : 0;
  return out;
}

struct MarkedLine {
  Pixel ux, uy;  // tail to head, pixels
  Pixel steep, opacity;
};

// Opacity of the line, and of the line with its halo.
struct MarkCover {
  Pixel line, whole;
};

// A shape at a signed distance inside its edge, as opacity times (1/2 + distance over the width of
// the ramp); broad: the same for its whole width across.
KERNEL_INLINE MarkCover cover_of(Pixel inside, Pixel broad, Pixel halo, Pixel opacity) {
  const Pixel zero = hn::Zero(PixelTag());
  const Pixel most = hn::Min(hn::Max(broad, zero), opacity);
  const Pixel wider = hn::Min(hn::Max(hn::MulAdd(all<Pixel>(2.0F), halo, broad), zero), opacity);
  return {clamped(inside, zero, most), clamped(inside + halo, zero, wider)};
}

// The triangular head of an arrow. along: position along the line, unclamped.
KERNEL_INLINE MarkCover head_cover(const MarkLanes& m, const MarkedLine& line, Pixel along,
                                   Pixel dx, Pixel dy) {
  const Pixel from_point = hn::NegMulAdd(along, m.length, m.length);
  const Pixel across = hn::Abs(hn::MulSub(dx, line.uy, dy * line.ux)) * m.inverse_length;
  const Pixel edge = line.opacity * all<Pixel>(0.5F);
  const Pixel half = from_point * m.head_slope;
  const Pixel side = hn::MulAdd(half - across, m.head_steep, edge);
  const Pixel base = hn::MulAdd(m.head - from_point, line.steep, edge);
  const Pixel corner = hn::MulAdd(m.head_half - across, line.steep, edge);
  const Pixel front = hn::MulAdd(from_point, line.steep, edge);
  const Pixel inside = hn::Min(hn::Min(side, base), hn::Min(corner, front));
  return cover_of(inside, (half + half) * m.head_steep, m.halo, line.opacity);
}

// along: position along the line, unclamped; w: clamped to [0, 1]. dx, dy: pixels from its tail.
KERNEL_INLINE MarkCover mark_cover(const MarkLanes& m, const MarkedLine& line, Pixel along, Pixel w,
                                   Pixel dx, Pixel dy) {
  const Pixel at = hn::Min(w, m.shaft);
  const Pixel ex = hn::NegMulAdd(at, line.ux, dx);
  const Pixel ey = hn::NegMulAdd(at, line.uy, dy);
  const Pixel distance = hn::Sqrt(hn::MulAdd(ex, ex, ey * ey));
  const Pixel reach = hn::MulAdd(at, m.widen, m.reach);
  MarkCover cover =
      cover_of(hn::NegMulAdd(distance, line.steep, reach),
               hn::MulSub(all<Pixel>(2.0F), reach, line.opacity), m.halo, line.opacity);
  if (m.arrow == 0) return cover;
  const MarkCover head = head_cover(m, line, along, dx, dy);
  cover.line = hn::Max(cover.line, head.line);
  cover.whole = hn::Max(hn::Max(cover.whole, head.whole), cover.line);
  return cover;
}

}  // namespace
}  // namespace windsplat::engine::kernels
