// Part of the kernel body: segments of curved lines, from vertices to ribbons on the screen.
#pragma once

#include "server/engine/kernels/body_lines.hpp"

namespace windsplat::engine::kernels {
namespace {

// Along right, down and forward.
struct CameraPoints {
  alignas(64) float at[3][pair_kernels];
};

// The segments of a vector of kernel positions: vertices from the eye, and bisectors where they
// meet their neighbours.
struct ChainEnds {
  CameraPoints from, to, from_tangent, to_tangent;
  alignas(64) float q_from[pair_kernels], q_to[pair_kernels];
};

inline void set_point(const Camera& camera, const double world[3], int k, CameraPoints& out) {
  out.at[0][k] = static_cast<float>(dot3(camera.world_right, world));
  out.at[1][k] = static_cast<float>(dot3(camera.world_down, world));
  out.at[2][k] = static_cast<float>(dot3(camera.world_forward, world));
}

// Sums in double, as for kernel positions. What belongs to a vertex depends on the vertex alone.
inline ChainEnds chain_ends(const Camera& camera, const Pass& pass, const Rows& rows, int i) {
  const Chains& chains = pass.line.chains;
  ChainEnds out;
  const auto set = [&](std::int64_t vertex, int k, CameraPoints& point, CameraPoints& tangent) {
    const float* place = pass.places + 3 * vertex;
    double at[3];
    double along[3];
    for (int c = 0; c < 3; ++c) {
      at[c] = static_cast<double>(place[c]) - camera.eye[c];
      along[c] = static_cast<double>(chains.tangent[c][vertex]);
    }
    set_point(camera, at, k, point);
    set_point(camera, along, k, tangent);
  };
  for (int k = 0; k < kernel_lanes; ++k) {
    const std::int64_t vertex = offset_of(rows, i + k);
    set(vertex, k, out.from, out.from_tangent);
    set(vertex + 1, k, out.to, out.to_tangent);
    out.q_from[k] = chains.q[vertex];
    out.q_to[k] = chains.q[vertex + 1];
  }
  return out;
}

KERNEL_INLINE Three<Kernel> load_points(const CameraPoints& points) {
  return {load<Kernel>(points.at[0]), load<Kernel>(points.at[1]), load<Kernel>(points.at[2])};
}

// Coordinates in pixels are multiples of 1/1024: differences from the centres of pixels are then
// exact, and equal for both segments of a joint, in pictures up to 16384 pixels wide.
constexpr float joint_steps = 1024.0F;
KERNEL_INLINE Kernel on_grid(Kernel pixels) {
  return hn::Round(pixels * all<Kernel>(joint_steps)) * all<Kernel>(1.0F / joint_steps);
}

// The direction on the screen of a tangent at a joint.
struct Direction {
  Kernel x, y;
};

template <bool Perspective>
KERNEL_INLINE Direction seen(const Three<Kernel>& joint, const Three<Kernel>& tangent) {
  if (!Perspective) return {tangent.x, tangent.y};
  return {hn::MulSub(tangent.x, joint.z, joint.x * tangent.z),
          hn::MulSub(tangent.y, joint.z, joint.y * tangent.z)};
}

// Where a chain turns back on the screen, a joint has no side for each segment: both keep their
// round ends, and overlap there.
KERNEL_INLINE MaskOf<Kernel> divides(const Direction& at, Kernel ux, Kernel uy,
                                     MaskOf<Kernel> whole) {
  const Kernel along = hn::MulAdd(at.x, ux, at.y * uy);
  return hn::And(whole, hn::Gt(along, hn::Zero(KernelTag())));
}

// The parts of segments that are drawn.
struct Clip {
  alignas(64) float first[pair_kernels], last[pair_kernels];
};

// Projects segments. Sets the part of each that is drawn as q of the whole line. Returns the lanes
// with a visible segment.
template <bool Perspective>
KERNEL_INLINE MaskOf<Kernel> project_chains(const Camera& camera, const LineStyle& line,
                                            const ChainEnds& ends, const KernelPositions& positions,
                                            int l, Segments& s, Clip& clip, Ribbons& r) {
  const Kernel zero = hn::Zero(KernelTag());
  const Kernel one = all<Kernel>(1.0F);
  const Kernel near = all<Kernel>(camera.near);
  const Three<Kernel> a = load_points(ends.from);
  const Three<Kernel> b = load_points(ends.to);
  const Three<Kernel> way = {b.x - a.x, b.y - a.y, b.z - a.z};
  auto from_whole = hn::Ge(zero, zero);
  auto to_whole = from_whole;
  auto shown = from_whole;
  Kernel first = zero;
  Kernel last = one;
  if (Perspective) {
    from_whole = hn::Ge(a.z, near);
    to_whole = hn::Ge(b.z, near);
    shown = hn::Or(from_whole, to_whole);
    const Kernel cut = clamped((near - a.z) / divisor(way.z), 0.0F, 1.0F);
    first = hn::IfThenElse(from_whole, zero, cut);
    last = hn::IfThenElse(to_whole, one, cut);
  }
  const auto point = [&](Kernel part, const Kernel& from, const Kernel& along) {
    return hn::MulAdd(part, along, from);
  };
  const Kernel z0 = hn::IfThenElse(from_whole, a.z, near);
  const Kernel z1 = hn::IfThenElse(to_whole, b.z, near);
  const auto end_x = [&](MaskOf<Kernel> whole, Kernel own, Kernel part, Kernel from, Kernel along) {
    return hn::IfThenElse(whole, own, point(part, from, along));
  };
  const Kernel scale = all<Kernel>(camera.inverse_pixel);
  const Kernel k0 = Perspective ? scale / z0 : scale;
  const Kernel k1 = Perspective ? scale / z1 : scale;
  const Kernel middle_x = all<Kernel>(camera.half_width_px);
  const Kernel middle_y = all<Kernel>(camera.half_height_px);
  const Kernel x0 = on_grid(hn::MulAdd(end_x(from_whole, a.x, first, a.x, way.x), k0, middle_x));
  const Kernel y0 = on_grid(hn::MulAdd(end_x(from_whole, a.y, first, a.y, way.y), k0, middle_y));
  const Kernel ux = on_grid(hn::MulAdd(end_x(to_whole, b.x, last, a.x, way.x), k1, middle_x)) - x0;
  const Kernel uy = on_grid(hn::MulAdd(end_x(to_whole, b.y, last, a.y, way.y), k1, middle_y)) - y0;
  const float least = 1e-6F * line.r2;
  const Kernel u2 = hn::MulAdd(ux, ux, uy * uy);
  const Kernel inverse_u2 = inverse_of(hn::Max(u2, all<Kernel>(least * least)));
  store(x0, r.x + l);
  store(y0, r.y + l);
  store(ux, r.ux + l);
  store(uy, r.uy + l);
  store(ux * inverse_u2, r.wx + l);
  store(uy * inverse_u2, r.wy + l);
  store(hn::NegMulAdd(all<Kernel>(0.5F), u2 * inverse_u2, all<Kernel>(0.5F)), r.w0 + l);
  const Kernel ratio = Perspective ? z0 * inverse_of(z1) : one;
  store(ratio, r.depth_ratio + l);
  store(ratio - one, r.bend + l);
  store(z0 - load<Kernel>(positions.z + l), r.depth + l);
  store(z1 - z0, r.depth_rise + l);
  const Direction from = seen<Perspective>(a, load_points(ends.from_tangent));
  const Direction to = seen<Perspective>(b, load_points(ends.to_tangent));
  const auto cut = divides(from, ux, uy, from_whole);
  const auto end = divides(to, ux, uy, to_whole);
  store(hn::IfThenElseZero(cut, from.x), r.cut_x + l);
  store(hn::IfThenElseZero(cut, from.y), r.cut_y + l);
  store(hn::IfThenElseZero(end, to.x), r.end_x + l);
  store(hn::IfThenElseZero(end, to.y), r.end_y + l);
  store(hn::IfThenElse(end, zero, one), r.end_most + l);
  const Kernel q0 = load<Kernel>(ends.q_from);
  const Kernel rise = load<Kernel>(ends.q_to) - q0;
  s.low = hn::MulAdd(first, rise, q0);
  s.high = hn::MulAdd(last, rise, q0);
  store(s.low + all<Kernel>(0.5F), r.whole + l);
  store(s.high - s.low, r.whole_rise + l);
  store(first, clip.first);
  store(last, clip.last);
  return shown;
}

// Without phase motion the texture is 1 everywhere.
inline void still_ribbons(int l, Ribbons& r) {
  store(all<Kernel>(0.5F), r.phase + l);
  store(hn::Zero(KernelTag()), r.phase_rise + l);
}

// Dashes: their number from the tail of the line, which moves by motion_cycles.
inline void dash_ribbons(const LineStyle& line, const Rows& rows, const Clip& clip, int i, int l,
                         Ribbons& r) {
  for (int k = 0; k < kernel_lanes; ++k) {
    const std::int64_t vertex = offset_of(rows, i + k);
    const auto turn = static_cast<double>(line.chains.turn[vertex]);
    const double from = static_cast<double>(line.chains.phase[vertex]) +
                        static_cast<double>(clip.first[k]) * turn - line.motion_cycles;
    const double rest = from - static_cast<double>(static_cast<std::int64_t>(from));
    r.phase[l + k] = static_cast<float>(rest < 0 ? rest + 1 : rest);
    r.phase_rise[l + k] = static_cast<float>(
        (static_cast<double>(clip.last[k]) - static_cast<double>(clip.first[k])) * turn);
  }
}

// Prepares a vector of segments. Returns the lanes with a visible segment.
template <bool Perspective>
KERNEL_INLINE std::uint32_t prepare_chains(const Camera& camera, const Pass& pass, const Rows& rows,
                                           const KernelPositions& positions, const Vectors& vectors,
                                           int i, int l, Shades& shades, Ribbons& ribbons) {
  const Kernel zero = hn::Zero(KernelTag());
  Segments s;
  s.offset = {zero, zero, zero};
  s.extent = s.offset;
  s.lift = zero;
  s.phase = fetch(pass.line.chains.phase, rows, i);
  const ChainEnds ends = chain_ends(camera, pass, rows, i);
  Clip clip;
  const auto shown =
      project_chains<Perspective>(camera, pass.line, ends, positions, l, s, clip, ribbons);
  shade_ribbons(camera, pass.line, rows, positions, vectors, s, i, l, shades);
  if (pass.line.moving != 0 && pass.line.chains.turn != nullptr) {
    dash_ribbons(pass.line, rows, clip, i, l, ribbons);
  } else if (pass.line.moving != 0) {
    phase_ribbons(pass.line, vectors, s, l, ribbons);
  } else {
    still_ribbons(l, ribbons);
  }
  return bits_of<Kernel>(shown);
}

}  // namespace
}  // namespace windsplat::engine::kernels
