// Part of the kernel body: oriented lines, from vectors to ribbons on the screen.
#pragma once

#include "server/engine/kernels/body_cells.hpp"

namespace windsplat::engine::kernels {
namespace {

// Lines before projection. q runs from -1/2 at the tail to 1/2 at the head; [low, high] is drawn.
struct Segments {
  Three<Kernel> offset;  // from the kernel position to the centre of the line, world units
  Three<Kernel> extent;  // tail to head, world units
  Kernel low, high;
  Kernel lift;   // from the kernel position to the centre of the line along z, cells
  Kernel phase;  // phase of the moving texture
};

// The samples of the data whose lines are drawn. At a coarser level, each is at `place` relative to
// the kernel position along an axis, and the box of its kernel at full detail is `box` wide, both
// in cells of the level.
struct Origins {
  Hash3<UnsignedOf<Kernel>> sample;
  Three<Kernel> place, box;
};

KERNEL_INLINE Origins origins_of(const LineStyle& line, const Rows& rows, int i) {
  const Kernel zero = hn::Zero(KernelTag());
  const Kernel one = all<Kernel>(1.0F);
  Origins out = {drawn_samples(line, rows, i), {zero, zero, zero}, {one, one, one}};
  if (line.merged == 0) return out;
  const hn::RebindToUnsigned<KernelTag> tag;
  const hn::RebindToSigned<KernelTag> integers;
  const auto find = [&](int a, UnsignedOf<Kernel> sample, Kernel& place, Kernel& box) {
    if (line.group_box[a] != nullptr) {
      place = looked_up(line.group_place[a], sample);
      box = looked_up(line.group_box[a], sample);
      return;
    }
    const int halvings = line.halvings[a];
    const auto group = hn::BitCast(tag, hn::Load(integers, rows.sample[a] + i));
    const auto first = hn::ShiftLeftSame(group, halvings);
    const auto size = hn::Set(tag, 1U << static_cast<unsigned>(halvings));
    const auto dims = hn::Set(tag, static_cast<std::uint32_t>(line.data_dims[a]));
    const Kernel count = from_integer<Kernel>(hn::BitCast(integers, hn::Min(size, dims - first)));
    const Kernel middle =
        from_integer<Kernel>(hn::BitCast(integers, sample - first)) + all<Kernel>(0.5F);
    place = middle / count - all<Kernel>(0.5F);
    box = one / count;
    if (line.data_stride == 1) return;
    const auto stride = hn::Set(tag, static_cast<std::uint32_t>(line.data_stride));
    const auto before = divided_by_stride(line, sample) * stride;  // of the kernel
    box = from_integer<Kernel>(hn::BitCast(integers, hn::Min(stride, dims - before))) / count;
  };
  find(0, out.sample.x, out.place.x, out.box.x);
  find(1, out.sample.y, out.place.y, out.box.y);
  find(2, out.sample.z, out.place.z, out.box.z);
  return out;
}

// Liang-Barsky against the kernel box: per axis |in_box + q along| <= half the box.
KERNEL_INLINE void clip_to_box(float half_span, const Three<Kernel>& in_box,
                               const Three<Kernel>& along, Segments& s) {
  s.low = all<Kernel>(-0.5F);
  s.high = all<Kernel>(0.5F);
  const Kernel half = all<Kernel>(half_span);
  const auto reach = [&](Kernel at, Kernel way) {
    return hn::MulAdd(hn::Abs(way), all<Kernel>(0.5F), hn::Abs(at));
  };
  const Kernel most = hn::Max(hn::Max(reach(in_box.x, along.x), reach(in_box.y, along.y)),
                              reach(in_box.z, along.z));
  // Selected per lane, so that a line does not depend on its neighbours.
  const auto inside = hn::Le(most, half);
  if (hn::AllTrue(KernelTag(), inside)) return;
  const auto clip = [&](Kernel at, Kernel way) {
    const Kernel inverse = inverse_of(divisor(way));
    const Kernel enter = (hn::Neg(half) - at) * inverse;
    const Kernel leave = (half - at) * inverse;
    s.low = hn::Max(s.low, hn::IfThenElse(inside, s.low, hn::Min(enter, leave)));
    s.high = hn::Min(s.high, hn::IfThenElse(inside, s.high, hn::Max(enter, leave)));
  };
  clip(in_box.x, along.x);
  clip(in_box.y, along.y);
  clip(in_box.z, along.z);
}

// The drawn vector in world units; for a slice, its part in the plane.
template <bool Curved>
KERNEL_INLINE Three<Kernel> extent_of(const LineStyle& line, const CellLanes<Curved>& cells,
                                      const Vectors& vectors) {
  const Kernel part =
      clamped(vectors.magnitude * all<Kernel>(line.inverse_full_magnitude), 0.0F, 1.0F);
  const Kernel length = all<Kernel>(line.length) * part;
  if constexpr (Curved) {
    const Three<Kernel> bent = bent_direction(line, cells, vectors.direction);
    return {bent.x * length, bent.y * length, bent.z * length};
  } else {
    return {vectors.direction.x * length * all<Kernel>(line.keep[0]),
            vectors.direction.y * length * all<Kernel>(line.keep[1]),
            vectors.direction.z * length * all<Kernel>(line.keep[2])};
  }
}

template <bool Curved>
KERNEL_INLINE Segments place_segments(const LineStyle& line, const Rows& rows,
                                      const CellLanes<Curved>& cells, const Vectors& vectors,
                                      const Hash3<std::uint32_t>& key, int i) {
  const Origins origins = origins_of(line, rows, i);
  const Hash3<UnsignedOf<Kernel>> kernel =
      pcg3d(Hash3<UnsignedOf<Kernel>>{origins.sample.x + repeated(key.x, origins.sample.x),
                                      origins.sample.y + repeated(key.y, origins.sample.y),
                                      origins.sample.z + repeated(key.z, origins.sample.z)});
  const Hash3<UnsignedOf<Kernel>> centre = pcg3d(kernel);
  const Kernel half = all<Kernel>(0.5F);
  const Kernel by_centre = all<Kernel>(line.jitter_center);
  const Kernel by_stride = all<Kernel>(line.jitter_stride);
  const auto centred = [&](UnsignedOf<Kernel> bits) { return unit_interval<Kernel>(bits) - half; };
  // In boxes of the kernels at full detail.
  const Three<Kernel> in_box = {by_centre * centred(centre.x), by_centre * centred(centre.y),
                                by_centre * centred(centre.z)};
  Three<Kernel> moved = {hn::MulAdd(by_stride, centred(kernel.x), in_box.x),
                         hn::MulAdd(by_stride, centred(kernel.y), in_box.y),
                         hn::MulAdd(by_stride, centred(kernel.z), in_box.z)};
  if (line.merged != 0) {
    moved = {hn::MulAdd(moved.x, origins.box.x, origins.place.x),
             hn::MulAdd(moved.y, origins.box.y, origins.place.y),
             hn::MulAdd(moved.z, origins.box.z, origins.place.z)};
  }
  Segments s;
  s.offset = cells.to_world(moved);
  s.extent = extent_of(line, cells, vectors);
  s.lift = moved.z;
  s.phase = hn::Zero(KernelTag());
  if (line.moving != 0) s.phase = unit_interval<Kernel>(pcg3d(centre).x);
  Three<Kernel> along = cells.to_grid(s.extent);
  if (line.merged != 0) {
    along = {along.x / origins.box.x, along.y / origins.box.y, along.z / origins.box.z};
  }
  clip_to_box(line.half_span, in_box, along, s);
  return s;
}

// Projects lines to the screen. Returns the lanes with a visible line.
template <bool Perspective>
KERNEL_INLINE MaskOf<Kernel> project_segments(const Camera& camera, const LineStyle& line,
                                              const KernelPositions& positions, int l,
                                              const Vectors& vectors, Segments& s, Ribbons& r) {
  const Kernel vx = dot3(camera.right, s.extent);
  const Kernel vy = dot3(camera.down, s.extent);
  const Kernel vz = dot3(camera.forward, s.extent);
  const Kernel px = load<Kernel>(positions.x + l) + dot3(camera.right, s.offset);
  const Kernel py = load<Kernel>(positions.y + l) + dot3(camera.down, s.offset);
  const Kernel dz = dot3(camera.forward, s.offset);
  const Kernel pz = load<Kernel>(positions.z + l) + dz;
  const Kernel near = all<Kernel>(camera.near);
  const Kernel one = all<Kernel>(1.0F);
  const Kernel half_way = all<Kernel>(0.5F) * hn::Abs(vz);
  // Negative without a line, or if no part lies in the kernel box or beyond the near plane.
  Kernel shown = hn::Min(vectors.magnitude, s.high - s.low);
  Kernel z0 = one;
  Kernel z1 = one;
  if (Perspective) {
    const auto beyond = hn::Ge(pz - half_way, near);
    if (!hn::AllTrue(KernelTag(), beyond)) {
      // The near plane clips the end nearer to the eye.
      const Kernel q_near = (near - pz) / divisor(vz);
      const Kernel zero = hn::Zero(KernelTag());
      const auto tail_off = hn::AndNot(beyond, hn::Gt(vz, zero));
      const auto head_off = hn::AndNot(beyond, hn::Lt(vz, zero));
      s.low = hn::Max(s.low, hn::IfThenElse(tail_off, q_near, all<Kernel>(-0.5F)));
      s.high = hn::Min(s.high, hn::IfThenElse(head_off, q_near, all<Kernel>(0.5F)));
      shown = hn::Min(vectors.magnitude, s.high - s.low);
      shown = hn::Min(shown, pz + half_way - near);
    }
    z0 = hn::Max(hn::MulAdd(s.low, vz, pz), near);
    z1 = hn::Max(hn::MulAdd(s.high, vz, pz), near);
  }
  const Kernel scale = all<Kernel>(camera.inverse_pixel);
  const Kernel k0 = Perspective ? scale / z0 : scale;
  const Kernel inverse_z1 = Perspective ? inverse_of(z1) : one;
  const Kernel ax = hn::MulAdd(s.low, vx, px);
  const Kernel ay = hn::MulAdd(s.low, vy, py);
  const Kernel x0 = ax * k0;
  const Kernel y0 = ay * k0;
  // b / z1 - a / z0 with b = a + l v and z1 = z0 + l v_z is l (v z0 - a v_z) / (z0 z1): avoids the
  // cancellation of pixel coordinates for lines seen end-on.
  const Kernel part = (s.high - s.low) * k0;
  const Kernel ux = Perspective ? hn::MulSub(vx, z0, ax * vz) * (part * inverse_z1) : vx * part;
  const Kernel uy = Perspective ? hn::MulSub(vy, z0, ay * vz) * (part * inverse_z1) : vy * part;
  const float least = 1e-6F * line.r2;
  const Kernel u2 = hn::MulAdd(ux, ux, uy * uy);
  const Kernel inverse_u2 = inverse_of(hn::Max(u2, all<Kernel>(least * least)));
  store(x0 + all<Kernel>(camera.half_width_px), r.x + l);
  store(y0 + all<Kernel>(camera.half_height_px), r.y + l);
  store(ux, r.ux + l);
  store(uy, r.uy + l);
  store(ux * inverse_u2, r.wx + l);
  store(uy * inverse_u2, r.wy + l);
  store(hn::NegMulAdd(all<Kernel>(0.5F), u2 * inverse_u2, all<Kernel>(0.5F)), r.w0 + l);
  const Kernel ratio = Perspective ? z0 * inverse_z1 : one;
  store(ratio, r.depth_ratio + l);
  store(ratio - one, r.bend + l);
  store(hn::MulAdd(s.low, vz, dz), r.depth + l);
  store((s.high - s.low) * vz, r.depth_rise + l);
  return hn::Ge(shown, hn::Zero(KernelTag()));
}

// Phase of the texture of each line; at full magnitude it advances by motion_cycles.
void phase_ribbons(const LineStyle& line, const Vectors& vectors, const Segments& s, int l,
                   Ribbons& r) {
  alignas(64) float magnitude[pair_kernels], phase[pair_kernels], low[pair_kernels],
      high[pair_kernels];
  store(vectors.magnitude, magnitude);
  store(s.phase, phase);
  store(s.low, low);
  store(s.high, high);
  for (int k = 0; k < kernel_lanes; ++k) {
    const float part = limited(magnitude[k] * line.inverse_full_magnitude, 0.0F, 1.0F);
    const double cycles = static_cast<double>(phase[k]) + line.motion_cycles * part;
    const double rest = cycles - static_cast<double>(static_cast<std::int64_t>(cycles));
    const double turn = rest < 0 ? rest + 1 : rest;
    r.phase[l + k] = static_cast<float>(static_cast<double>(low[k]) + 1.5 - turn);
    r.phase_rise[l + k] = high[k] - low[k];
  }
}

// The compass bearing of a vector in degrees, 0 along y, 90 along x, in [0, 360). atan on [0, 1] by
// a polynomial (1e-6 radians).
KERNEL_INLINE Kernel bearing(Kernel x, Kernel y) {
  const Kernel ax = hn::Abs(x);
  const Kernel ay = hn::Abs(y);
  const Kernel t = hn::Min(ax, ay) / hn::Max(hn::Max(ax, ay), all<Kernel>(1e-30F));
  const Kernel t2 = t * t;
  Kernel p = all<Kernel>(-0.0117212F);
  p = hn::MulAdd(p, t2, all<Kernel>(0.05265332F));
  p = hn::MulAdd(p, t2, all<Kernel>(-0.11643287F));
  p = hn::MulAdd(p, t2, all<Kernel>(0.19354346F));
  p = hn::MulAdd(p, t2, all<Kernel>(-0.33262347F));
  p = hn::MulAdd(p, t2, all<Kernel>(0.99997726F));
  const Kernel zero = hn::Zero(KernelTag());
  const Kernel from_axis = p * t * all<Kernel>(57.29577951F);  // 0 .. 45 degrees
  // Clockwise from north.
  const Kernel first = hn::IfThenElse(hn::Gt(ax, ay), all<Kernel>(90.0F) - from_axis, from_axis);
  const Kernel half = hn::IfThenElse(hn::Lt(y, zero), all<Kernel>(180.0F) - first, first);
  const Kernel whole = hn::IfThenElse(hn::Lt(x, zero), all<Kernel>(360.0F) - half, half);
  return hn::IfThenElse(hn::Lt(whole, all<Kernel>(360.0F)), whole, zero);
}

// The quantity that determines the colour. On a curved lattice, heights are those of the uncurved
// one.
KERNEL_INLINE Kernel color_value(const LineStyle& line, const Rows& rows, const Vectors& vectors,
                                 const Segments& s, Kernel depth, int i) {
  // Of segments, the value is that in their middle.
  if (line.chains.q != nullptr && line.color_by != 1) return fetch(line.chains.color, rows, i);
  const Kernel z =
      hn::MulAdd(s.lift, load<Kernel>(rows.cell[2] + i), load<Kernel>(rows.height + i));
  switch (line.color_by) {
    case 0:
      return z;
    case 1:
      return depth;
    case 2: {
      // The vector itself, even if a slice draws only its part in the plane.
      const Kernel part =
          clamped(vectors.magnitude * all<Kernel>(line.inverse_full_magnitude), 0.0F, 1.0F);
      const Kernel height =
          hn::MulAdd(z, all<Kernel>(line.height_scale), all<Kernel>(line.rise_shift));
      return hn::MulAdd(vectors.direction.z * part, all<Kernel>(line.rise_scale), height);
    }
    case 3:
      return vectors.magnitude;
    case 4:
      return bearing(vectors.direction.x * all<Kernel>(line.keep[0]),
                     vectors.direction.y * all<Kernel>(line.keep[1]));
    case 5:
      return fetch(line.color_values, rows, i);
    default:
      return hn::Zero(KernelTag());
  }
}

using ColorTag = hn::CappedTag<float, color_floats>;

// Red, green and blue between a table's entry and the next.
KERNEL_INLINE void blend(const float* entry, float part, float* rgb) {
  const ColorTag tag;
  for (std::size_t c = 0; c < color_floats; c += hn::MaxLanes(tag)) {
    const auto a = hn::LoadU(tag, entry + c);
    const auto b = hn::LoadU(tag, entry + color_floats + c);
    hn::Store(hn::MulAdd(hn::Set(tag, part), b - a, a), tag, rgb + c);
  }
}

// Colours of one line from its table colour in `tail`: dimmed, and desaturated by `grey` at the
// tail and a further `more` at the head; the parts `tail_light` and `head_light` remain.
KERNEL_INLINE void shade(float dim, float grey, float more, float tail_light, float head_light,
                         float* tail, float* rise) {
  const ColorTag tag;
  const float top = dim * larger(larger(tail[0], tail[1]), tail[2]);
  for (std::size_t c = 0; c < color_floats; c += hn::MaxLanes(tag)) {
    const auto rgb = hn::Load(tag, tail + c) * hn::Set(tag, dim);
    const auto to_grey = hn::Set(tag, top) - rgb;
    const auto lit = hn::MulAdd(hn::Set(tag, grey), to_grey, rgb);
    hn::Store(hn::Set(tag, tail_light) * lit, tag, tail + c);
    const auto dark = hn::Set(tag, head_light - tail_light) * lit;
    hn::Store(hn::MulAdd(hn::Set(tag, head_light * more), to_grey, dark), tag, rise + c);
  }
}

// Inputs of the colours of lines, computed for a vector of kernel positions at a time.
struct Shades {
  alignas(64) std::int32_t entry[brick_kernels];  // entry of the table; `part`: weight of the next
                                                  // entry
  alignas(64) float part[brick_kernels];
  alignas(64) float dim[brick_kernels];
  alignas(64) float grey[brick_kernels];
  alignas(64) float more[brick_kernels];
  std::uint64_t unknown;  // bit l set: the field that determines the colour is masked
};

// Table position and dimming by magnitude and depth.
KERNEL_INLINE void shade_ribbons(const Camera& camera, const LineStyle& line, const Rows& rows,
                                 const KernelPositions& positions, const Vectors& vectors,
                                 const Segments& s, int i, int l, Shades& shades) {
  const Kernel depth = load<Kernel>(positions.depth + l) + dot3(camera.forward, s.offset);
  const Kernel one = all<Kernel>(1.0F);
  const Kernel strong = clamped(
      (vectors.magnitude - all<Kernel>(line.intensity_low)) * all<Kernel>(line.intensity_scale),
      0.0F, 1.0F);
  const Kernel far =
      clamped((depth - all<Kernel>(line.cue_near)) * all<Kernel>(line.cue_scale), 0.0F, 1.0F);
  const Kernel dim = hn::NegMulAdd(all<Kernel>(line.intensity), one - strong, one) *
                     hn::NegMulAdd(all<Kernel>(line.cue_strength), far, one);
  const Kernel value = color_value(line, rows, vectors, s, depth, i);
  const auto masked = is_masked(value);
  const ColorTable& table = line.color;
  const Kernel known = hn::IfThenElse(masked, all<Kernel>(table.low), value);
  const Kernel position = clamped((known - all<Kernel>(table.low)) * all<Kernel>(table.scale), 0.0F,
                                  static_cast<float>(table.entries - 1));
  const SignedOf<Kernel> entry = truncated(position);
  hn::Store(entry, hn::RebindToSigned<KernelTag>(), shades.entry + l);
  store(position - from_integer<Kernel>(entry), shades.part + l);
  store(dim, shades.dim + l);
  const Kernel desaturation = all<Kernel>(line.head_desaturation);
  store(desaturation * (s.low + all<Kernel>(0.5F)), shades.grey + l);
  store(desaturation * (s.high - s.low), shades.more + l);
  shades.unknown |= static_cast<std::uint64_t>(bits_of<Kernel>(masked)) << static_cast<unsigned>(l);
}

// Computes the colours of the remaining lines.
inline void color_ribbons(const LineStyle& line, const Shades& shades, std::uint64_t lines,
                          Ribbons& r) {
  // Of a segment of a chain, the light at both ends is that of the whole line there.
  const bool chained = line.chains.q != nullptr;
  const auto finish = [&](int l) {
    const float dark = 1.0F - line.tail_light;
    const float tail = chained ? 1.0F - dark * (1.0F - r.whole[l]) : line.tail_light;
    const float head = chained ? 1.0F - dark * (1.0F - (r.whole[l] + r.whole_rise[l])) : 1.0F;
    shade(shades.dim[l], shades.grey[l], shades.more[l], tail, head, r.tail[l], r.rise[l]);
  };
  for (std::uint64_t left = lines; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    blend(line.color.rgb + color_floats * static_cast<std::ptrdiff_t>(shades.entry[l]),
          shades.part[l], r.tail[l]);
    finish(l);
  }
  // Mid-grey where the field that determines the colour is masked.
  for (std::uint64_t left = lines & shades.unknown; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    for (float& c : r.tail[l]) c = 0.5F;
    finish(l);
  }
}

// Prepares a vector of lines. Returns the lanes with a visible line.
template <bool Perspective, bool Curved>
KERNEL_INLINE std::uint32_t prepare_ribbons(const Camera& camera, const Pass& pass,
                                            const Rows& rows, const KernelPositions& positions,
                                            const CellLanes<Curved>& cells, const Vectors& vectors,
                                            const Hash3<std::uint32_t>& key, int i, int l,
                                            Shades& shades, Ribbons& ribbons) {
  Segments s = place_segments<Curved>(pass.line, rows, cells, vectors, key, i);
  const auto shown =
      project_segments<Perspective>(camera, pass.line, positions, l, vectors, s, ribbons);
  shade_ribbons(camera, pass.line, rows, positions, vectors, s, i, l, shades);
  if (pass.line.moving != 0) phase_ribbons(pass.line, vectors, s, l, ribbons);
  return bits_of<Kernel>(shown);
}

}  // namespace
}  // namespace windsplat::engine::kernels
