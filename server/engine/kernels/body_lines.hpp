// Part of the kernel body: oriented lines, from vectors to ribbons on the screen.
#pragma once

#include "server/engine/kernels/body_cells.hpp"

namespace windsplat::engine::kernels {
namespace {

// Lines before projection. q runs from -1/2 at the tail to 1/2 at the head; [low, high] is drawn.
struct Segments {
  Three<Stop> offset;  // of the centre of the line from the kernel position, world units
  Three<Stop> extent;  // tail to head, world units
  Stop low, high;
  Stop lift;   // of the centre of the line from the kernel position along z, cells
  Stop phase;  // of the texture's motion
};

KERNEL_INLINE UnsignedOf<Stop> hashed_sample(const Rows& rows, int a, int i, std::uint32_t key) {
  const hn::RebindToUnsigned<StopTag> tag;
  const hn::RebindToSigned<StopTag> integers;
  return hn::BitCast(tag, hn::Load(integers, rows.sample[a] + i)) + hn::Set(tag, key);
}

// Liang-Barsky against the kernel box: per axis |in_box + q along| <= half the box.
KERNEL_INLINE void clip_to_box(float half_span, const Three<Stop>& in_box, const Three<Stop>& along,
                               Segments& s) {
  s.low = all<Stop>(-0.5F);
  s.high = all<Stop>(0.5F);
  const Stop half = all<Stop>(half_span);
  const auto reach = [&](Stop at, Stop way) {
    return hn::MulAdd(hn::Abs(way), all<Stop>(0.5F), hn::Abs(at));
  };
  const Stop most = hn::Max(hn::Max(reach(in_box.x, along.x), reach(in_box.y, along.y)),
                            reach(in_box.z, along.z));
  // Selected per lane, so that a line does not depend on its neighbours.
  const auto inside = hn::Le(most, half);
  if (hn::AllTrue(StopTag(), inside)) return;
  const auto clip = [&](Stop at, Stop way) {
    const Stop inverse = inverse_of(divisor(way));
    const Stop enter = (hn::Neg(half) - at) * inverse;
    const Stop leave = (half - at) * inverse;
    s.low = hn::Max(s.low, hn::IfThenElse(inside, s.low, hn::Min(enter, leave)));
    s.high = hn::Min(s.high, hn::IfThenElse(inside, s.high, hn::Max(enter, leave)));
  };
  clip(in_box.x, along.x);
  clip(in_box.y, along.y);
  clip(in_box.z, along.z);
}

// The drawn vector in world units; for a slice, its part in the plane.
template <bool Curved>
KERNEL_INLINE Three<Stop> extent_of(const LineStyle& line, const CellLanes<Curved>& cells,
                                    const Vectors& vectors) {
  const Stop part = clamped(vectors.magnitude * all<Stop>(line.inverse_full_magnitude), 0.0F, 1.0F);
  const Stop length = all<Stop>(line.length) * part;
  if constexpr (Curved) {
    const Three<Stop> bent = bent_direction(line, cells, vectors.direction);
    return {bent.x * length, bent.y * length, bent.z * length};
  } else {
    return {vectors.direction.x * length * all<Stop>(line.keep[0]),
            vectors.direction.y * length * all<Stop>(line.keep[1]),
            vectors.direction.z * length * all<Stop>(line.keep[2])};
  }
}

template <bool Curved>
KERNEL_INLINE Segments place_segments(const LineStyle& line, const Rows& rows,
                                      const CellLanes<Curved>& cells, const Vectors& vectors,
                                      const Hash3<std::uint32_t>& key, int i) {
  const Hash3<UnsignedOf<Stop>> kernel = pcg3d(
      Hash3<UnsignedOf<Stop>>{hashed_sample(rows, 0, i, key.x), hashed_sample(rows, 1, i, key.y),
                              hashed_sample(rows, 2, i, key.z)});
  const Hash3<UnsignedOf<Stop>> centre = pcg3d(kernel);
  const Stop half = all<Stop>(0.5F);
  const Stop by_centre = all<Stop>(line.jitter_center);
  const Stop by_stride = all<Stop>(line.jitter_stride);
  const auto centred = [&](UnsignedOf<Stop> bits) { return unit_interval<Stop>(bits) - half; };
  const Three<Stop> in_box = {by_centre * centred(centre.x), by_centre * centred(centre.y),
                              by_centre * centred(centre.z)};
  const Three<Stop> moved = {hn::MulAdd(by_stride, centred(kernel.x), in_box.x),
                             hn::MulAdd(by_stride, centred(kernel.y), in_box.y),
                             hn::MulAdd(by_stride, centred(kernel.z), in_box.z)};
  Segments s;
  s.offset = cells.to_world(moved);
  s.extent = extent_of(line, cells, vectors);
  s.lift = moved.z;
  s.phase = hn::Zero(StopTag());
  if (line.moving != 0) s.phase = unit_interval<Stop>(pcg3d(centre).x);
  clip_to_box(line.half_span, in_box, cells.to_grid(s.extent), s);
  return s;
}

// Projects lines to the screen. Returns the lanes with a visible line.
template <bool Perspective>
KERNEL_INLINE MaskOf<Stop> project_segments(const Camera& camera, const LineStyle& line,
                                            const Stops& stops, int l, const Vectors& vectors,
                                            Segments& s, Ribbons& r) {
  const Stop vx = dot3(camera.right, s.extent);
  const Stop vy = dot3(camera.down, s.extent);
  const Stop vz = dot3(camera.forward, s.extent);
  const Stop px = load<Stop>(stops.x + l) + dot3(camera.right, s.offset);
  const Stop py = load<Stop>(stops.y + l) + dot3(camera.down, s.offset);
  const Stop dz = dot3(camera.forward, s.offset);
  const Stop pz = load<Stop>(stops.z + l) + dz;
  const Stop near = all<Stop>(camera.near);
  const Stop one = all<Stop>(1.0F);
  const Stop half_way = all<Stop>(0.5F) * hn::Abs(vz);
  // Negative without a line, or if no part lies in the kernel box or beyond the near plane.
  Stop shown = hn::Min(vectors.magnitude, s.high - s.low);
  Stop z0 = one;
  Stop z1 = one;
  if (Perspective) {
    const auto beyond = hn::Ge(pz - half_way, near);
    if (!hn::AllTrue(StopTag(), beyond)) {
      // The near plane clips the end nearer to the eye.
      const Stop q_near = (near - pz) / divisor(vz);
      const Stop zero = hn::Zero(StopTag());
      const auto tail_off = hn::AndNot(beyond, hn::Gt(vz, zero));
      const auto head_off = hn::AndNot(beyond, hn::Lt(vz, zero));
      s.low = hn::Max(s.low, hn::IfThenElse(tail_off, q_near, all<Stop>(-0.5F)));
      s.high = hn::Min(s.high, hn::IfThenElse(head_off, q_near, all<Stop>(0.5F)));
      shown = hn::Min(vectors.magnitude, s.high - s.low);
      shown = hn::Min(shown, pz + half_way - near);
    }
    z0 = hn::Max(hn::MulAdd(s.low, vz, pz), near);
    z1 = hn::Max(hn::MulAdd(s.high, vz, pz), near);
  }
  const Stop scale = all<Stop>(camera.inverse_pixel);
  const Stop k0 = Perspective ? scale / z0 : scale;
  const Stop inverse_z1 = Perspective ? inverse_of(z1) : one;
  const Stop ax = hn::MulAdd(s.low, vx, px);
  const Stop ay = hn::MulAdd(s.low, vy, py);
  const Stop x0 = ax * k0;
  const Stop y0 = ay * k0;
  // b / z1 - a / z0 with b = a + l v and z1 = z0 + l v_z is l (v z0 - a v_z) / (z0 z1): avoids the
  // cancellation of pixel coordinates for lines seen end-on.
  const Stop part = (s.high - s.low) * k0;
  const Stop ux = Perspective ? hn::MulSub(vx, z0, ax * vz) * (part * inverse_z1) : vx * part;
  const Stop uy = Perspective ? hn::MulSub(vy, z0, ay * vz) * (part * inverse_z1) : vy * part;
  const float least = 1e-6F * line.r2;
  const Stop u2 = hn::MulAdd(ux, ux, uy * uy);
  const Stop inverse_u2 = inverse_of(hn::Max(u2, all<Stop>(least * least)));
  store(x0 + all<Stop>(camera.half_width_px), r.x + l);
  store(y0 + all<Stop>(camera.half_height_px), r.y + l);
  store(ux, r.ux + l);
  store(uy, r.uy + l);
  store(ux * inverse_u2, r.wx + l);
  store(uy * inverse_u2, r.wy + l);
  store(hn::NegMulAdd(all<Stop>(0.5F), u2 * inverse_u2, all<Stop>(0.5F)), r.w0 + l);
  const Stop ratio = Perspective ? z0 * inverse_z1 : one;
  store(ratio, r.depth_ratio + l);
  store(ratio - one, r.bend + l);
  store(hn::MulAdd(s.low, vz, dz), r.depth + l);
  store((s.high - s.low) * vz, r.depth_rise + l);
  return hn::Ge(shown, hn::Zero(StopTag()));
}

// Phase of the texture of each line; at full magnitude it advances by motion_cycles.
void phase_ribbons(const LineStyle& line, const Vectors& vectors, const Segments& s, int l,
                   Ribbons& r) {
  alignas(64) float magnitude[pair_stops], phase[pair_stops], low[pair_stops], high[pair_stops];
  store(vectors.magnitude, magnitude);
  store(s.phase, phase);
  store(s.low, low);
  store(s.high, high);
  for (int k = 0; k < stop_lanes; ++k) {
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
KERNEL_INLINE Stop bearing(Stop x, Stop y) {
  const Stop ax = hn::Abs(x);
  const Stop ay = hn::Abs(y);
  const Stop t = hn::Min(ax, ay) / hn::Max(hn::Max(ax, ay), all<Stop>(1e-30F));
  const Stop t2 = t * t;
  Stop p = all<Stop>(-0.0117212F);
  p = hn::MulAdd(p, t2, all<Stop>(0.05265332F));
  p = hn::MulAdd(p, t2, all<Stop>(-0.11643287F));
  p = hn::MulAdd(p, t2, all<Stop>(0.19354346F));
  p = hn::MulAdd(p, t2, all<Stop>(-0.33262347F));
  p = hn::MulAdd(p, t2, all<Stop>(0.99997726F));
  const Stop zero = hn::Zero(StopTag());
  const Stop from_axis = p * t * all<Stop>(57.29577951F);  // 0 .. 45 degrees
  // Clockwise from north.
  const Stop first = hn::IfThenElse(hn::Gt(ax, ay), all<Stop>(90.0F) - from_axis, from_axis);
  const Stop half = hn::IfThenElse(hn::Lt(y, zero), all<Stop>(180.0F) - first, first);
  const Stop whole = hn::IfThenElse(hn::Lt(x, zero), all<Stop>(360.0F) - half, half);
  return hn::IfThenElse(hn::Lt(whole, all<Stop>(360.0F)), whole, zero);
}

// The quantity that determines the colour. On a curved lattice, heights are those of the uncurved
// one.
KERNEL_INLINE Stop color_value(const LineStyle& line, const Rows& rows, const Vectors& vectors,
                               const Segments& s, Stop view_distance, int i) {
  const Stop z = hn::MulAdd(s.lift, load<Stop>(rows.cell[2] + i), load<Stop>(rows.height + i));
  switch (line.color_by) {
    case 0:
      return z;
    case 1:
      return view_distance;
    case 2: {
      const Stop height = (z - all<Stop>(line.box_low_z)) * all<Stop>(line.inverse_box_height);
      const Stop half = all<Stop>(0.5F);
      const Stop rise = hn::MulAdd(vectors.direction.z * all<Stop>(line.keep[2]), half, half);
      return all<Stop>(1.0F - line.rise_weight) * height + all<Stop>(line.rise_weight) * rise;
    }
    case 3:
      return vectors.magnitude;
    case 4:
      return bearing(vectors.direction.x * all<Stop>(line.keep[0]),
                     vectors.direction.y * all<Stop>(line.keep[1]));
    case 5:
      return fetch(line.color_values, rows, i);
    default:
      return hn::Zero(StopTag());
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

// Colours of one line from that of its table in `tail`: dimmed, and desaturated by `grey` at the
// tail and a further `more` at the head.
KERNEL_INLINE void shade(float dim, float grey, float more, float* tail, float* rise) {
  const ColorTag tag;
  const float top = dim * larger(larger(tail[0], tail[1]), tail[2]);
  for (std::size_t c = 0; c < color_floats; c += hn::MaxLanes(tag)) {
    const auto rgb = hn::Load(tag, tail + c) * hn::Set(tag, dim);
    const auto to_grey = hn::Set(tag, top) - rgb;
    hn::Store(hn::MulAdd(hn::Set(tag, grey), to_grey, rgb), tag, tail + c);
    hn::Store(hn::Set(tag, more) * to_grey, tag, rise + c);
  }
}

// Inputs of the colours of lines, computed for a vector of kernel positions at a time.
struct Shades {
  alignas(64) std::int32_t entry[brick_stops];  // of the table; `part`: weight of the next entry
  alignas(64) float part[brick_stops];
  alignas(64) float dim[brick_stops];
  alignas(64) float grey[brick_stops];
  alignas(64) float more[brick_stops];
  std::uint64_t unknown;  // bit l set: the field that determines the colour is masked
};

// Table position and dimming by magnitude and view distance.
KERNEL_INLINE void shade_ribbons(const Camera& camera, const LineStyle& line, const Rows& rows,
                                 const Stops& stops, const Vectors& vectors, const Segments& s,
                                 int i, int l, Shades& shades) {
  const Stop distance = load<Stop>(stops.z + l) + dot3(camera.forward, s.offset);
  const Stop one = all<Stop>(1.0F);
  const Stop strong =
      clamped((vectors.magnitude - all<Stop>(line.intensity_low)) * all<Stop>(line.intensity_scale),
              0.0F, 1.0F);
  const Stop far =
      clamped((distance - all<Stop>(line.cue_near)) * all<Stop>(line.cue_scale), 0.0F, 1.0F);
  const Stop dim = hn::NegMulAdd(all<Stop>(line.intensity), one - strong, one) *
                   hn::NegMulAdd(all<Stop>(line.cue_strength), far, one);
  const Stop value = color_value(line, rows, vectors, s, distance, i);
  const auto masked = is_masked(value);
  const ColorTable& table = line.color;
  const Stop known = hn::IfThenElse(masked, all<Stop>(table.low), value);
  const Stop place = clamped((known - all<Stop>(table.low)) * all<Stop>(table.scale), 0.0F,
                             static_cast<float>(table.entries - 1));
  const SignedOf<Stop> entry = truncated(place);
  hn::Store(entry, hn::RebindToSigned<StopTag>(), shades.entry + l);
  store(place - from_integer<Stop>(entry), shades.part + l);
  store(dim, shades.dim + l);
  const Stop desaturation = all<Stop>(line.head_desaturation);
  store(desaturation * (s.low + all<Stop>(0.5F)), shades.grey + l);
  store(desaturation * (s.high - s.low), shades.more + l);
  shades.unknown |= static_cast<std::uint64_t>(bits_of<Stop>(masked)) << static_cast<unsigned>(l);
}

// Computes the colours of the remaining lines.
inline void color_ribbons(const ColorTable& table, const Shades& shades, std::uint64_t lines,
                          Ribbons& r) {
  for (std::uint64_t left = lines; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    blend(table.rgb + color_floats * static_cast<std::ptrdiff_t>(shades.entry[l]), shades.part[l],
          r.tail[l]);
    shade(shades.dim[l], shades.grey[l], shades.more[l], r.tail[l], r.rise[l]);
  }
  // Mid-grey where the field that determines the colour is masked.
  for (std::uint64_t left = lines & shades.unknown; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    for (float& c : r.tail[l]) c = 0.5F;
    shade(shades.dim[l], shades.grey[l], shades.more[l], r.tail[l], r.rise[l]);
  }
}

// Prepares a vector of lines. Returns the lanes with a visible line.
template <bool Perspective, bool Curved>
KERNEL_INLINE std::uint32_t prepare_ribbons(const Camera& camera, const Pass& pass,
                                            const Rows& rows, const Stops& stops,
                                            const CellLanes<Curved>& cells, const Vectors& vectors,
                                            const Hash3<std::uint32_t>& key, int i, int l,
                                            Shades& shades, Ribbons& ribbons) {
  Segments s = place_segments<Curved>(pass.line, rows, cells, vectors, key, i);
  const auto shown =
      project_segments<Perspective>(camera, pass.line, stops, l, vectors, s, ribbons);
  shade_ribbons(camera, pass.line, rows, stops, vectors, s, i, l, shades);
  if (pass.line.moving != 0) phase_ribbons(pass.line, vectors, s, l, ribbons);
  return bits_of<Stop>(shown);
}

}  // namespace
}  // namespace windsplat::engine::kernels
