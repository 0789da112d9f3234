// Part of the kernel body: small functions of one lane.
#pragma once

#include "server/engine/kernels/frame_data.hpp"

// Ahead of a loop over lanes whose arrays never overlap.
#if defined(__clang__)
#define WINDSPLAT_LANES _Pragma("clang loop vectorize(enable)")
#else
#define WINDSPLAT_LANES _Pragma("GCC ivdep")
#endif

namespace windsplat::engine::kernels {
namespace {

// Masked samples are NaN; arithmetic is compiled as if there were none.
inline bool is_masked(float v) {
  return (__builtin_bit_cast(std::uint32_t, v) & 0x7fffffffU) > 0x7f800000U;
}

inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }
inline float clamped(float v, float low, float high) { return smaller(larger(v, low), high); }
inline float absolute(float v) { return __builtin_fabsf(v); }
inline float square_root(float v) { return __builtin_sqrtf(v); }

// A divisor that is never zero, its sign kept.
inline float divisor(float v) { return absolute(v) < 1e-30F ? __builtin_copysignf(1e-30F, v) : v; }

struct Attenuation {
  float absorbed;     // -expm1(-tau)
  float transmitted;  // exp(-tau)
};

// tau = n ln2 + r, |r| <= ln2 / 2; expm1(-r) by a polynomial (2.5e-8 relative). With n = 0 nothing
// is subtracted from 1, so tau = 1e-30 absorbs 1e-30; from tau = 17 on exactly 1 is absorbed.
inline Attenuation attenuation(float tau) {
  const float t = clamped(tau, 0.0F, 87.0F);
  const float rounded = t * 1.44269504F + 0.5F;
  const int n = static_cast<int>(rounded);  // never negative: rounds to the nearest
  const float whole = static_cast<float>(n);
  const float r = -((t - whole * 0.693359375F) - whole * -2.12194440e-4F);
  float p = 1.3926550429e-3F;
  p = p * r + 8.3634724672e-3F;
  p = p * r + 4.1666552403e-2F;
  p = p * r + 1.6666575217e-1F;
  p = p * r + 0.5F;
  const float expm1_r = r + r * (r * p);
  const float scale = __builtin_bit_cast(float, (127 - n) << 23);
  return {(1.0F - scale) - scale * expm1_r, scale + scale * expm1_r};
}

// The splat's footprint (Max 1991) in strides, normalised by its integral over the plane.
constexpr float footprint_s = 0.48F;
constexpr float footprint_t = static_cast<float>(footprint_radius);
constexpr float footprint_integral = 1.4476982547F;

inline float footprint(float r2, float r) {
  const float inner = 1.0F - r2 * (1.0F / (footprint_s * footprint_t));
  const float rest = footprint_t - r;
  const float outer = rest * rest * (1.0F / (footprint_t * (footprint_t - footprint_s)));
  const float inside = r < footprint_s ? inner : outer;
  return r < footprint_t ? inside : 0.0F;
}

struct Hash3 {
  std::uint32_t x, y, z;
};

inline Hash3 pcg3d(Hash3 v) {
  v.x = v.x * 1664525U + 1013904223U;
  v.y = v.y * 1664525U + 1013904223U;
  v.z = v.z * 1664525U + 1013904223U;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v.x ^= v.x >> 16U;
  v.y ^= v.y >> 16U;
  v.z ^= v.z >> 16U;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  return v;
}

inline Hash3 stop_hash(std::uint32_t seed, std::uint32_t epoch, int i, int j, int k) {
  // Seed and epoch go through the hash first: neighbouring seeds then share nothing.
  const Hash3 key = pcg3d({seed, epoch, 0x9e3779b9U});
  return pcg3d({static_cast<std::uint32_t>(i) + key.x, static_cast<std::uint32_t>(j) + key.y,
                static_cast<std::uint32_t>(k) + key.z});
}

inline float unit_interval(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8U)) * 0x1p-24F;
}

void jitter(std::uint32_t seed, std::uint32_t epoch, int i, int j, int k, float* six) {
  const Hash3 a = stop_hash(seed, epoch, i, j, k);
  const Hash3 b = pcg3d(a);
  six[0] = unit_interval(a.x);
  six[1] = unit_interval(a.y);
  six[2] = unit_interval(a.z);
  six[3] = unit_interval(b.x);
  six[4] = unit_interval(b.y);
  six[5] = unit_interval(b.z);
}

void attenuate(int count, const float* tau, float* absorbed, float* transmitted) {
  for (int l = 0; l < count; ++l) {
    const Attenuation a = attenuation(tau[l]);
    absorbed[l] = a.absorbed;
    transmitted[l] = a.transmitted;
  }
}

// Linear interpolation between a table's entries, clamped at its ends.
inline void look_up(const ColorTable& table, float value, float rgb[3]) {
  const float last = static_cast<float>(table.entries - 1);
  const float place = clamped((value - table.low) * table.scale, 0.0F, last);
  const int whole = static_cast<int>(place);
  const int next = whole + 1 < table.entries ? whole + 1 : whole;
  const float part = place - static_cast<float>(whole);
  const float* a = table.rgb + 3 * static_cast<std::ptrdiff_t>(whole);
  const float* b = table.rgb + 3 * static_cast<std::ptrdiff_t>(next);
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
