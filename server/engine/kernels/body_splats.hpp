// Part of the kernel body: splats, from a row's extinctions to footprints on the screen.
#pragma once

#include "server/engine/kernels/body_cells.hpp"

namespace windsplat::engine::kernels {
namespace {

// Half the silhouette's width along one screen axis and its middle, as coordinates at unit
// distance, from M = v v^T - t^2 A A^T; unbounded when the splat reaches the eye's plane. The
// discriminant M13^2 - M11 M33 is written out so that v's own squares never cancel.
struct Extent {
  Stop low, high;
};

KERNEL_INLINE Extent silhouette(Stop v, Stop z, Stop s11, Stop s13, Stop s33) {
  const Stop z2 = z * z;
  const Stop m33 = z2 - s33;
  const Stop inner =
      (z2 * s11 - all<Stop>(2.0F) * v * z * s13 + v * v * s33) - (s11 * s33 - s13 * s13);
  const Stop root = hn::Sqrt(hn::Max(inner, hn::Zero(StopTag())));
  const Stop middle = v * z - s13;
  const auto bounded = hn::Gt(m33, all<Stop>(1e-6F) * z2);
  const Stop inverse = inverse_of(hn::IfThenElse(bounded, m33, all<Stop>(1.0F)));
  return {hn::IfThenElse(bounded, (middle - root) * inverse, all<Stop>(-1e30F)),
          hn::IfThenElse(bounded, (middle + root) * inverse, all<Stop>(1e30F))};
}

// What of the cell a view direction meets: its squares along the camera's axes times t^2, and the
// screen's axes in cells a pixel.
struct Facing {
  Stop s11, s22, s33, s13, s23;
  Three<Stop> right, down;  // cells per pixel
};

template <bool Curved>
KERNEL_INLINE Facing face(const Camera& camera, const CellLanes<Curved>& cells) {
  const Stop zero = hn::Zero(StopTag());
  Facing f = {zero, zero, zero, zero, zero, {}, {}};
  for (int a = 0; a < 3; ++a) {
    const Stop t = all<Stop>(footprint_t);
    const Stop r = t * cells.edge_along(a, camera.right);
    const Stop d = t * cells.edge_along(a, camera.down);
    const Stop w = t * cells.edge_along(a, camera.forward);
    f.s11 = hn::MulAdd(r, r, f.s11);
    f.s22 = hn::MulAdd(d, d, f.s22);
    f.s33 = hn::MulAdd(w, w, f.s33);
    f.s13 = hn::MulAdd(r, w, f.s13);
    f.s23 = hn::MulAdd(d, w, f.s23);
  }
  const Stop pixel = all<Stop>(camera.pixel);
  const Three<Stop> right = cells.to_grid(camera.right);
  const Three<Stop> down = cells.to_grid(camera.down);
  f.right = {right.x * pixel, right.y * pixel, right.z * pixel};
  f.down = {down.x * pixel, down.y * pixel, down.z * pixel};
  return f;
}

// An ellipse about a splat's projected centre, pixels: what lies at height y below its middle is
// within sqrt(half_chord2 - narrowing y^2) of lean y; its rightmost point lies half_width right and
// shear half_width below the middle. Not known: where the picture shows no ellipse, or not from
// near its middle.
struct Oval {
  MaskOf<Stop> known;
  Stop x, y;
  Stop half_chord2, narrowing, lean, half_width, shear;
};

// t^2, and room for rounding.
constexpr float oval_limit = 1.002F * footprint_t * footprint_t;

// xx dx^2 + xy dx dy + yy dy^2 <= limit; det = xx yy - xy^2 / 4, told apart so that it never
// cancels.
KERNEL_INLINE Oval oval_of(Stop xx, Stop xy, Stop yy, Stop det, Stop limit) {
  Oval o;
  const Stop least = all<Stop>(1e-36F);
  const Stop inverse = inverse_of(hn::Max(xx, least));
  const Stop half = all<Stop>(-0.5F) * xy;
  o.half_chord2 = limit * inverse;
  o.narrowing = det * inverse * inverse;
  o.lean = half * inverse;
  o.half_width = hn::Sqrt(yy * limit * inverse_of(hn::Max(det, least)));
  o.shear = half * inverse_of(hn::Max(yy, least));
  o.known = hn::And(hn::Gt(hn::Min(xx, yy), least), hn::Gt(det, least));
  return o;
}

// Where on the picture the silhouette lies, pixels: its box, and an ellipse that it lies in.
struct Outline {
  Extent x, y;
  Oval oval;
};

template <bool Curved>
KERNEL_INLINE Outline perspective_splats(const Camera& camera, const Stops& stops,
                                         const CellLanes<Curved>& cells, int l, Stop rho,
                                         Splats& s) {
  const Facing f = face<Curved>(camera, cells);
  const Stop x = load<Stop>(stops.x + l);
  const Stop y = load<Stop>(stops.y + l);
  const Stop z = load<Stop>(stops.z + l);
  const Stop two = all<Stop>(2.0F);
  const Three<Stop> o = cells.to_grid(cells.from_eye);
  const Three<Stop> ox = cross3(o, f.right);
  const Three<Stop> oy = cross3(o, f.down);
  const Stop xx = dot3(ox, ox);
  const Stop xy = two * dot3(ox, oy);
  const Stop yy = dot3(oy, oy);
  store(xx, s.xx + l);
  store(xy, s.xy + l);
  store(yy, s.yy + l);
  const Stop half_width = all<Stop>(camera.half_width_px);
  const Stop half_height = all<Stop>(camera.half_height_px);
  const Stop inverse_z = inverse_of(z);
  const Stop per_pixel = all<Stop>(camera.inverse_pixel);
  const Stop scale = per_pixel * inverse_z;
  const Stop px = hn::MulAdd(x, scale, half_width);
  const Stop py = hn::MulAdd(y, scale, half_height);
  // The nearest point of the picture; its ray, forward component 1, in cells.
  const Stop ex = clamped(px, hn::Zero(StopTag()), two * half_width);
  const Stop ey = clamped(py, hn::Zero(StopTag()), two * half_height);
  const auto inside = hn::And(hn::Eq(ex, px), hn::Eq(ey, py));
  const Three<Stop> forward = cells.to_grid(camera.forward);
  const Stop from_middle_x = ex - half_width;
  const Stop from_middle_y = ey - half_height;
  const auto ray = [&](Stop own, Stop ahead, Stop right, Stop down) {
    const Stop there = ahead + from_middle_x * right + from_middle_y * down;
    return hn::IfThenElse(inside, own * inverse_z, there);
  };
  const Three<Stop> d = {ray(o.x, forward.x, f.right.x, f.down.x),
                         ray(o.y, forward.y, f.right.y, f.down.y),
                         ray(o.z, forward.z, f.right.z, f.down.z)};
  const Stop d0 = dot3(d, d);
  const Stop dx = two * dot3(d, f.right);
  const Stop dy = two * dot3(d, f.down);
  store(px, s.x + l);
  store(py, s.y + l);
  store(ex, s.ex + l);
  store(ey, s.ey + l);
  store(d0, s.d0 + l);
  store(dx, s.dx + l);
  store(dy, s.dy + l);
  const Stop dxx = dot3(f.right, f.right);
  const Stop dxy = two * dot3(f.right, f.down);
  const Stop dyy = dot3(f.down, f.down);
  const Stop d2_least = inverse_of(cells.edges2());
  store(dxx, s.dxx + l);
  store(dxy, s.dxy + l);
  store(dyy, s.dyy + l);
  store(hn::IfThenElse(inside, hn::Zero(StopTag()), dot3(o, d) - z * d0), s.b0 + l);
  store(dot3(o, f.right) - z * dx, s.bx + l);
  store(dot3(o, f.down) - z * dy, s.by + l);
  store(d2_least, s.d2_least + l);
  store(hn::Sqrt(f.s33), s.half_depth + l);
  store(rho * all<Stop>(1.0F / footprint_integral), s.strength + l);
  const Extent across = silhouette(x, z, f.s11, f.s13, f.s33);
  const Extent along = silhouette(y, z, f.s22, f.s23, f.s33);
  Outline out = {{hn::MulAdd(across.low, per_pixel, half_width),
                  hn::MulAdd(across.high, per_pixel, half_width)},
                 {hn::MulAdd(along.low, per_pixel, half_height),
                  hn::MulAdd(along.high, per_pixel, half_height)},
                 {}};
  // |d|^2 within the box is no more than this.
  const Stop w = hn::Max(px - out.x.low, out.x.high - px);
  const Stop h = hn::Max(py - out.y.low, out.y.high - py);
  const Stop bent = hn::MulAdd(dxx, w * w, hn::MulAdd(hn::Abs(dxy), w * h, dyy * h * h));
  const Stop most =
      hn::Max(d0 + hn::MulAdd(hn::Abs(dx), w, hn::MulAdd(hn::Abs(dy), h, bent)), d2_least);
  const Three<Stop> normal = cross3(ox, oy);
  out.oval = oval_of(xx, xy, yy, dot3(normal, normal), all<Stop>(oval_limit) * most);
  out.oval.x = px;
  out.oval.y = py;
  const auto bounded = hn::Lt(hn::Max(w, h), all<Stop>(1e4F));
  out.oval.known = hn::And(out.oval.known, hn::And(inside, bounded));
  return out;
}

template <bool Curved>
KERNEL_INLINE Outline orthographic_splats(const Camera& camera, const Stops& stops,
                                          const CellLanes<Curved>& cells, int l, Stop rho,
                                          Splats& s) {
  const Facing f = face<Curved>(camera, cells);
  const Three<Stop> forward = cells.to_grid(camera.forward);
  const Stop length2 = dot3(forward, forward);
  const Stop inverse2 = inverse_of(length2);
  const Three<Stop> ox = cross3(f.right, forward);
  const Three<Stop> oy = cross3(f.down, forward);
  const Stop xx = dot3(ox, ox) * inverse2;
  const Stop xy = all<Stop>(2.0F) * dot3(ox, oy) * inverse2;
  const Stop yy = dot3(oy, oy) * inverse2;
  store(xx, s.xx + l);
  store(xy, s.xy + l);
  store(yy, s.yy + l);
  store(length2, s.d0 + l);
  store(hn::Neg(dot3(f.right, forward)) * inverse2, s.bx + l);
  store(hn::Neg(dot3(f.down, forward)) * inverse2, s.by + l);
  store(hn::Sqrt(f.s33), s.half_depth + l);
  store(rho * all<Stop>(1.0F / footprint_integral) / hn::Sqrt(length2), s.strength + l);
  const Stop scale = all<Stop>(camera.inverse_pixel);
  const Stop x = hn::MulAdd(load<Stop>(stops.x + l), scale, all<Stop>(camera.half_width_px));
  const Stop y = hn::MulAdd(load<Stop>(stops.y + l), scale, all<Stop>(camera.half_height_px));
  store(x, s.x + l);
  store(y, s.y + l);
  const Stop wide = hn::Sqrt(f.s11) * scale;
  const Stop tall = hn::Sqrt(f.s22) * scale;
  const Three<Stop> normal = cross3(ox, oy);
  Outline out = {{x - wide, x + wide}, {y - tall, y + tall}, {}};
  out.oval = oval_of(xx, xy, yy, dot3(normal, normal) * inverse2 * inverse2, all<Stop>(oval_limit));
  out.oval.x = x;
  out.oval.y = y;
  return out;
}

// A row's splats from lane i on, made ready.
template <bool Perspective, bool Curved>
KERNEL_INLINE Outline prepare_splats(const Camera& camera, const Stops& stops,
                                     const CellLanes<Curved>& cells, int l, Stop rho, Splats& s) {
  if (Perspective) return perspective_splats<Curved>(camera, stops, cells, l, rho, s);
  return orthographic_splats<Curved>(camera, stops, cells, l, rho, s);
}

}  // namespace
}  // namespace windsplat::engine::kernels
