// Part of the kernel body: small scalar and vector functions.
#pragma once

#include "server/engine/kernels/simd.hpp"

namespace windsplat::engine::kernels {
namespace {

inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }
inline float limited(float v, float low, float high) { return smaller(larger(v, low), high); }
inline float absolute(float v) { return __builtin_fabsf(v); }
inline float square_root(float v) { return __builtin_sqrtf(v); }

inline bool is_masked(float v) {
  return (__builtin_bit_cast(std::uint32_t, v) & 0x7fffffffU) > 0x7f800000U;
}

template <class V>
struct Attenuation {
  V absorbed;     // -expm1(-tau)
  V transmitted;  // exp(-tau)
};

// -expm1(-t) for |t| <= ln2 / 2 (2.5e-8 relative).
template <class V>
KERNEL_INLINE V short_absorbed(V t) {
  // Pairs of terms, so that the operations depend on each other in a shorter chain.
  const V t2 = t * t;
  const V low = hn::NegMulAdd(all<V>(1.6666575217e-1F), t, all<V>(0.5F));
  const V middle = hn::NegMulAdd(all<V>(8.3634724672e-3F), t, all<V>(4.1666552403e-2F));
  const V high = hn::MulAdd(all<V>(1.3926550429e-3F), t2, middle);
  return hn::NegMulAdd(t2, hn::MulAdd(high, t2, low), t);
}

// tau = n ln2 + r, |r| <= ln2 / 2. For n = 0 there is no cancellation, so tau = 1e-30 absorbs
// 1e-30; for tau >= 17 exactly 1 is absorbed. Most splats are thin in every pixel; the shortcut for
// n = 0 gives identical bits.
template <class V>
KERNEL_INLINE Attenuation<V> attenuation(V tau) {
  const V one = all<V>(1.0F);
  constexpr float thin = 0.3465F;
  if (HWY_LIKELY(hn::AllTrue(TagOf<V>(), hn::Le(tau, all<V>(thin))))) {
    const V absorbed = short_absorbed(tau);
    return {absorbed, one - absorbed};
  }
  const V t = clamped(tau, 0.0F, 88.0F);  // 2^-n is 0 from there on
  // Non-negative, so truncation of x + 0.5 rounds to nearest.
  const auto n = truncated(hn::MulAdd(t, all<V>(1.44269504F), all<V>(0.5F)));
  const V whole = from_integer<V>(n);
  const V r =
      hn::MulAdd(whole, all<V>(2.12194440e-4F), hn::NegMulAdd(whole, all<V>(0.693359375F), t));
  const V short_part = short_absorbed(r);
  const hn::RebindToSigned<TagOf<V>> integers;
  const V scale = hn::BitCast(TagOf<V>(), hn::ShiftLeft<23>(hn::Sub(hn::Set(integers, 127), n)));
  return {hn::MulAdd(scale, short_part, one - scale), hn::NegMulAdd(scale, short_part, scale)};
}

// The footprint of a splat [Max91] in strides, not normalised; its integral over the plane.
constexpr float footprint_s = 0.48F;
constexpr float footprint_t = static_cast<float>(footprint_radius);
constexpr float footprint_integral = 1.4476982547F;

template <class V>
KERNEL_INLINE V footprint(V r, V r2) {
  const V inner = hn::NegMulAdd(r2, all<V>(1.0F / (footprint_s * footprint_t)), all<V>(1.0F));
  // The root of 1 / (t (t - s)).
  constexpr float scale = 0.905617306F;
  const V rest =
      hn::Max(hn::NegMulAdd(r, all<V>(scale), all<V>(scale * footprint_t)), hn::Zero(TagOf<V>()));
  return hn::IfThenElse(hn::Lt(r, all<V>(footprint_s)), inner, rest * rest);
}

// pcg3d (Jarzynski & Olano 2020), scalar or per lane.
template <class U>
struct Hash3 {
  U x, y, z;
};

inline std::uint32_t high_half(std::uint32_t v) { return v >> 16U; }
template <class U>
KERNEL_INLINE U high_half(U v) {
  return hn::ShiftRight<16>(v);
}
inline std::uint32_t repeated(std::uint32_t value, std::uint32_t /*like*/) { return value; }
template <class U>
KERNEL_INLINE U repeated(std::uint32_t value, U /*like*/) {
  return hn::Set(TagOf<U>(), value);
}

template <class U>
KERNEL_INLINE Hash3<U> pcg3d(Hash3<U> v) {
  const U factor = repeated(1664525U, v.x);
  const U term = repeated(1013904223U, v.x);
  v.x = v.x * factor + term;
  v.y = v.y * factor + term;
  v.z = v.z * factor + term;
  v.x = v.x + v.y * v.z;
  v.y = v.y + v.z * v.x;
  v.z = v.z + v.x * v.y;
  v.x = v.x ^ high_half(v.x);
  v.y = v.y ^ high_half(v.y);
  v.z = v.z ^ high_half(v.z);
  v.x = v.x + v.y * v.z;
  v.y = v.y + v.z * v.x;
  v.z = v.z + v.x * v.y;
  return v;
}

// Seed and epoch are hashed first, so that neighbouring seeds are uncorrelated.
inline Hash3<std::uint32_t> hash_key(std::uint32_t seed, std::uint32_t epoch) {
  return pcg3d(Hash3<std::uint32_t>{seed, epoch, 0x9e3779b9U});
}

inline float unit_interval(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8U)) * 0x1p-24F;
}

template <class V>
KERNEL_INLINE V unit_interval(UnsignedOf<V> bits) {
  const hn::RebindToSigned<TagOf<V>> integers;
  return from_integer<V>(hn::BitCast(integers, hn::ShiftRight<8>(bits))) * all<V>(0x1p-24F);
}

void jitter(std::uint32_t seed, std::uint32_t epoch, int i, int j, int k, float* six) {
  const Hash3<std::uint32_t> key = hash_key(seed, epoch);
  const Hash3<std::uint32_t> a = pcg3d(Hash3<std::uint32_t>{static_cast<std::uint32_t>(i) + key.x,
                                                            static_cast<std::uint32_t>(j) + key.y,
                                                            static_cast<std::uint32_t>(k) + key.z});
  const Hash3<std::uint32_t> b = pcg3d(a);
  six[0] = unit_interval(a.x);
  six[1] = unit_interval(a.y);
  six[2] = unit_interval(a.z);
  six[3] = unit_interval(b.x);
  six[4] = unit_interval(b.y);
  six[5] = unit_interval(b.z);
}

void attenuate(int count, const float* tau, float* absorbed, float* transmitted) {
  for (int first = 0; first < count; first += pixel_lanes) {
    const int here = count - first < pixel_lanes ? count - first : pixel_lanes;
    alignas(64) float lanes[3][block_pixels] = {};
    for (int l = 0; l < here; ++l) lanes[0][l] = tau[first + l];
    const Attenuation<Pixel> a = attenuation(load<Pixel>(lanes[0]));
    store(a.absorbed, lanes[1]);
    store(a.transmitted, lanes[2]);
    for (int l = 0; l < here; ++l) {
      absorbed[first + l] = lanes[1][l];
      transmitted[first + l] = lanes[2][l];
    }
  }
}

// Linear interpolation between a table's entries, clamped at its ends.
inline void look_up(const ColorTable& table, float value, float rgb[3]) {
  const float last = static_cast<float>(table.entries - 1);
  const float position = limited((value - table.low) * table.scale, 0.0F, last);
  const int whole = static_cast<int>(position);
  const float part = position - static_cast<float>(whole);
  const float* a = table.rgb + color_floats * static_cast<std::ptrdiff_t>(whole);
  const float* b = a + color_floats;
  for (int c = 0; c < 3; ++c) rgb[c] = a[c] + part * (b[c] - a[c]);
}

inline float extinction_at(const Extinction& extinction, float value) {
  float rho = extinction.y[0];
  for (int p = 0; p < extinction.points; ++p) {
    const float here = extinction.y[p] + extinction.slope[p] * (value - extinction.x[p]);
    rho = value >= extinction.x[p] ? here : rho;
  }
  return rho;
}

}  // namespace
}  // namespace windsplat::engine::kernels
