// Part of the kernel body: splats, from the extinctions of a row to footprints on the screen.
#pragma once

#include "server/engine/kernels/body_cells.hpp"

namespace windsplat::engine::kernels {
namespace {

// Half the width of the silhouette along one screen axis and its centre, as coordinates at unit
// distance, from M = v v^T - t^2 A A^T; unbounded if the splat reaches the plane of the eye or
// nearly does, where the bounds would cancel. The discriminant M13^2 - M11 M33 is expanded so that
// the squares of v never cancel.
struct Extent {
  Kernel low, high;
};

KERNEL_INLINE Extent silhouette(Kernel v, Kernel z, Kernel s11, Kernel s13, Kernel s33) {
  const Kernel z2 = z * z;
  const Kernel m33 = z2 - s33;
  const Kernel inner =
      (z2 * s11 - all<Kernel>(2.0F) * v * z * s13 + v * v * s33) - (s11 * s33 - s13 * s13);
  const Kernel root = hn::Sqrt(hn::Max(inner, hn::Zero(KernelTag())));
  const Kernel middle = v * z - s13;
  const auto bounded = hn::Gt(m33, all<Kernel>(1e-2F) * z2);
  const Kernel inverse = inverse_of(hn::IfThenElse(bounded, m33, all<Kernel>(1.0F)));
  return {hn::IfThenElse(bounded, (middle - root) * inverse, all<Kernel>(-1e30F)),
          hn::IfThenElse(bounded, (middle + root) * inverse, all<Kernel>(1e30F))};
}

// The cell in camera space: squares and products of its extents along the camera axes times t^2,
// and the axes of the screen in cells per pixel.
struct Facing {
  Kernel s11, s22, s33, s13, s23;
  Three<Kernel> right, down;  // cells per pixel
};

template <bool Curved>
KERNEL_INLINE Facing face(const Camera& camera, const CellLanes<Curved>& cells) {
  const Kernel zero = hn::Zero(KernelTag());
  Facing f = {zero, zero, zero, zero, zero, {}, {}};
  for (int a = 0; a < 3; ++a) {
    const Kernel t = all<Kernel>(footprint_t);
    const Kernel r = t * cells.edge_along(a, camera.right);
    const Kernel d = t * cells.edge_along(a, camera.down);
    const Kernel w = t * cells.edge_along(a, camera.forward);
    f.s11 = hn::MulAdd(r, r, f.s11);
    f.s22 = hn::MulAdd(d, d, f.s22);
    f.s33 = hn::MulAdd(w, w, f.s33);
    f.s13 = hn::MulAdd(r, w, f.s13);
    f.s23 = hn::MulAdd(d, w, f.s23);
  }
  const Kernel pixel = all<Kernel>(camera.pixel);
  const Three<Kernel> right = cells.to_grid(camera.right);
  const Three<Kernel> down = cells.to_grid(camera.down);
  f.right = {right.x * pixel, right.y * pixel, right.z * pixel};
  f.down = {down.x * pixel, down.y * pixel, down.z * pixel};
  return f;
}

// An ellipse about the projected centre of a splat, in pixels: at distance y below its centre it
// spans lean y +- sqrt(half_chord2 - narrowing y^2); its rightmost point is half_width right of and
// shear half_width below the centre. Undefined if the outline is not an ellipse or is too large.
struct Oval {
  MaskOf<Kernel> known;
  Kernel x, y;
  Kernel half_chord2, narrowing, lean, half_width, shear;
};

// xx dx^2 + xy dx dy + yy dy^2, and det = xx yy - xy^2 / 4, computed separately to avoid
// cancellation.
struct Form {
  Kernel xx, xy, yy, det;
};

// |dx a + dy b|^2 scale.
KERNEL_INLINE Form form_of(const Three<Kernel>& a, const Three<Kernel>& b, Kernel scale) {
  const Three<Kernel> normal = cross3(a, b);
  return {dot3(a, a) * scale, all<Kernel>(2.0F) * dot3(a, b) * scale, dot3(b, b) * scale,
          dot3(normal, normal) * scale * scale};
}

KERNEL_INLINE void store_form(const Form& form, int l, Splats& s) {
  store(form.xx, s.xx + l);
  store(form.xy, s.xy + l);
  store(form.yy, s.yy + l);
}

// t^2 with a margin for rounding.
constexpr float oval_limit = 1.002F * footprint_t * footprint_t;

// The ellipse on which the form equals `limit`.
KERNEL_INLINE Oval oval_of(const Form& form, Kernel limit) {
  Oval o;
  const Kernel least = all<Kernel>(1e-36F);
  const Kernel inverse = inverse_of(hn::Max(form.xx, least));
  const Kernel half = all<Kernel>(-0.5F) * form.xy;
  o.half_chord2 = limit * inverse;
  o.narrowing = form.det * inverse * inverse;
  o.lean = half * inverse;
  o.half_width = hn::Sqrt(form.yy * limit * inverse_of(hn::Max(form.det, least)));
  o.shear = half * inverse_of(hn::Max(form.yy, least));
  o.known = hn::And(hn::Gt(hn::Min(form.xx, form.yy), least), hn::Gt(form.det, least));
  return o;
}

// Bounding box and bounding ellipse of the silhouette, in pixels.
struct Outline {
  Extent x, y;
  Oval oval;
};

// |d|^2 as a function of the offset from a point of the picture; see Splats.
struct RaySquares {
  Kernel d0, dx, dy, dxx, dxy, dyy, least;

  // Upper bound within w and h pixels of the point.
  KERNEL_INLINE Kernel most(Kernel w, Kernel h) const {
    const Kernel bent = hn::MulAdd(dxx, w * w, hn::MulAdd(hn::Abs(dxy), w * h, dyy * h * h));
    return hn::Max(d0 + hn::MulAdd(hn::Abs(dx), w, hn::MulAdd(hn::Abs(dy), h, bent)), least);
  }
};

KERNEL_INLINE void store_squares(const RaySquares& r, int l, Splats& s) {
  store(r.d0, s.d0 + l);
  store(r.dx, s.dx + l);
  store(r.dy, s.dy + l);
  store(r.dxx, s.dxx + l);
  store(r.dxy, s.dxy + l);
  store(r.dyy, s.dyy + l);
  store(r.least, s.d2_least + l);
}

// The splats whose |d|^2 varies little in every block that their box may touch; see Splats::afar.
// Outside of its silhouette a flat cell may be crossed at quite another angle, where the series
// diverges.
KERNEL_INLINE MaskOf<Kernel> is_afar(const RaySquares& rays, Kernel w, Kernel h) {
  const Kernel block = all<Kernel>(block_side);
  return hn::Lt(rays.most(w + block, h + block), all<Kernel>(1.0F + afar_most) * rays.d0);
}

// The outline of splats whose projected centres are (px, py). Within the ellipse the form is at
// most t^2 times the largest |d|^2 of the box.
KERNEL_INLINE Outline perspective_outline(const Camera& camera, const KernelPositions& positions,
                                          int l, const Facing& f, const Form& form,
                                          const RaySquares& rays, Kernel px, Kernel py,
                                          MaskOf<Kernel> inside, Splats& s) {
  const Kernel z = load<Kernel>(positions.z + l);
  const auto span = [&](const float* at, Kernel s11, Kernel s13, float half) {
    const Extent e = silhouette(load<Kernel>(at + l), z, s11, s13, f.s33);
    const Kernel scale = all<Kernel>(camera.inverse_pixel);
    return Extent{hn::MulAdd(e.low, scale, all<Kernel>(half)),
                  hn::MulAdd(e.high, scale, all<Kernel>(half))};
  };
  const Extent across = span(positions.x, f.s11, f.s13, camera.half_width_px);
  const Extent along = span(positions.y, f.s22, f.s23, camera.half_height_px);
  const Kernel w = hn::Max(px - across.low, across.high - px);
  const Kernel h = hn::Max(py - along.low, along.high - py);
  const std::uint64_t afar = bits_of<Kernel>(hn::And(inside, is_afar(rays, w, h)));
  s.afar |= afar << static_cast<unsigned>(l);
  Oval oval = oval_of(form, all<Kernel>(oval_limit) * rays.most(w, h));
  oval.x = px;
  oval.y = py;
  const auto bounded = hn::Lt(hn::Max(w, h), all<Kernel>(1e4F));
  oval.known = hn::And(oval.known, hn::And(inside, bounded));
  return {across, along, oval};
}

KERNEL_INLINE void store_three(const Three<Kernel>& v, float to[3][brick_kernels], int l) {
  store(v.x, to[0] + l);
  store(v.y, to[1] + l);
  store(v.z, to[2] + l);
}

// Splats whose cells may reach the near plane, on any ray.
KERNEL_INLINE MaskOf<Kernel> reach_near(const Camera& camera, Kernel z, Kernel half_depth) {
  return hn::Lt(hn::NegMulAdd(all<Kernel>(2.0F), half_depth, z), all<Kernel>(camera.near));
}

// Empties the outlines of splats that lie before the near plane.
KERNEL_INLINE void drop_before_near(const Camera& camera, Kernel z, Kernel half_depth,
                                    Outline& outline) {
  const auto gone = hn::Le(z + half_depth, all<Kernel>(camera.near));
  outline.x.low = hn::IfThenElse(gone, all<Kernel>(1e30F), outline.x.low);
  outline.x.high = hn::IfThenElse(gone, all<Kernel>(-1e30F), outline.x.high);
}

template <bool Curved>
KERNEL_INLINE Outline perspective_splats(const Camera& camera, const KernelPositions& positions,
                                         const CellLanes<Curved>& cells, int l, Kernel rho,
                                         Prepared& out) {
  Splats& s = out.splats;
  const Facing f = face<Curved>(camera, cells);
  const Kernel z = load<Kernel>(positions.z + l);
  const Kernel two = all<Kernel>(2.0F);
  const Three<Kernel> o = cells.to_grid(cells.from_eye);
  const Form form = form_of(cross3(o, f.right), cross3(o, f.down), all<Kernel>(1.0F));
  store_form(form, l, s);
  const Kernel half_width = all<Kernel>(camera.half_width_px);
  const Kernel half_height = all<Kernel>(camera.half_height_px);
  const Kernel inverse_z = inverse_of(z);
  const Kernel scale = all<Kernel>(camera.inverse_pixel) * inverse_z;
  const Kernel px = hn::MulAdd(load<Kernel>(positions.x + l), scale, half_width);
  const Kernel py = hn::MulAdd(load<Kernel>(positions.y + l), scale, half_height);
  // The nearest point of the picture, and its ray in cells with forward component 1.
  const Kernel ex = clamped(px, hn::Zero(KernelTag()), two * half_width);
  const Kernel ey = clamped(py, hn::Zero(KernelTag()), two * half_height);
  const auto inside = hn::And(hn::Eq(ex, px), hn::Eq(ey, py));
  const Three<Kernel> forward = cells.to_grid(camera.forward);
  const Kernel from_middle_x = ex - half_width;
  const Kernel from_middle_y = ey - half_height;
  const auto ray = [&](Kernel own, Kernel ahead, Kernel right, Kernel down) {
    const Kernel there = ahead + from_middle_x * right + from_middle_y * down;
    return hn::IfThenElse(inside, own * inverse_z, there);
  };
  const Three<Kernel> d = {ray(o.x, forward.x, f.right.x, f.down.x),
                           ray(o.y, forward.y, f.right.y, f.down.y),
                           ray(o.z, forward.z, f.right.z, f.down.z)};
  const RaySquares rays = {dot3(d, d),
                           two * dot3(d, f.right),
                           two * dot3(d, f.down),
                           dot3(f.right, f.right),
                           two * dot3(f.right, f.down),
                           dot3(f.down, f.down),
                           inverse_of(cells.edges2())};
  store_squares(rays, l, s);
  store(inverse_root(hn::Max(rays.d0, rays.least)), s.inverse + l);
  store(px, s.x + l);
  store(py, s.y + l);
  store(ex, s.ex + l);
  store(ey, s.ey + l);
  store(hn::IfThenElse(inside, hn::Zero(KernelTag()), dot3(o, d) - z * rays.d0), s.b0 + l);
  store(dot3(o, f.right) - z * rays.dx, s.bx + l);
  store(dot3(o, f.down) - z * rays.dy, s.by + l);
  const Kernel half_depth = hn::Sqrt(f.s33);
  store(half_depth, s.half_depth + l);
  store(rho * all<Kernel>(1.0F / footprint_integral), s.strength + l);
  Outline outline = perspective_outline(camera, positions, l, f, form, rays, px, py, inside, s);
  const std::uint64_t near = bits_of<Kernel>(reach_near(camera, z, half_depth));
  if (near != 0) {
    s.near |= near << static_cast<unsigned>(l);
    s.afar &= ~s.near;
    store_three(o, out.near_splats.centre, l);
    store_three(forward, out.near_splats.ahead, l);
    store_three(f.right, out.near_splats.right, l);
    store_three(f.down, out.near_splats.down, l);
    drop_before_near(camera, z, half_depth, outline);
  }
  return outline;
}

template <bool Curved>
KERNEL_INLINE Outline orthographic_splats(const Camera& camera, const KernelPositions& positions,
                                          const CellLanes<Curved>& cells, int l, Kernel rho,
                                          Splats& s) {
  const Facing f = face<Curved>(camera, cells);
  const Three<Kernel> forward = cells.to_grid(camera.forward);
  const Kernel length2 = dot3(forward, forward);
  const Kernel inverse2 = inverse_of(length2);
  const Form form = form_of(cross3(f.right, forward), cross3(f.down, forward), inverse2);
  store_form(form, l, s);
  store(length2, s.d0 + l);
  store(hn::Neg(dot3(f.right, forward)) * inverse2, s.bx + l);
  store(hn::Neg(dot3(f.down, forward)) * inverse2, s.by + l);
  store(hn::Sqrt(f.s33), s.half_depth + l);
  store(rho * all<Kernel>(1.0F / footprint_integral) / hn::Sqrt(length2), s.strength + l);
  const Kernel scale = all<Kernel>(camera.inverse_pixel);
  const Kernel x =
      hn::MulAdd(load<Kernel>(positions.x + l), scale, all<Kernel>(camera.half_width_px));
  const Kernel y =
      hn::MulAdd(load<Kernel>(positions.y + l), scale, all<Kernel>(camera.half_height_px));
  store(x, s.x + l);
  store(y, s.y + l);
  const Kernel wide = hn::Sqrt(f.s11) * scale;
  const Kernel tall = hn::Sqrt(f.s22) * scale;
  Oval oval = oval_of(form, all<Kernel>(oval_limit));
  oval.x = x;
  oval.y = y;
  return {{x - wide, x + wide}, {y - tall, y + tall}, oval};
}

// Prepares the splats of a vector of kernel positions.
template <bool Perspective, bool Curved>
KERNEL_INLINE Outline prepare_splats(const Camera& camera, const KernelPositions& positions,
                                     const CellLanes<Curved>& cells, int l, Kernel rho,
                                     Prepared& out) {
  if (Perspective) return perspective_splats<Curved>(camera, positions, cells, l, rho, out);
  return orthographic_splats<Curved>(camera, positions, cells, l, rho, out.splats);
}

}  // namespace
}  // namespace windsplat::engine::kernels
