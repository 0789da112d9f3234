// Part of the kernel body: Highway vectors in the width of the target. A lane is either a kernel
// position of a brick or a pixel of a block.
#pragma once

#include <hwy/highway.h>

#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"

// Functions of hot loops, always inlined. Sanitizer builds leave inlining to the compiler: with
// their checks, forced inlining makes compilation take minutes.
#if defined(WINDSPLAT_SANITIZED)
#define KERNEL_INLINE inline
#else
#define KERNEL_INLINE HWY_INLINE
#endif

namespace windsplat::engine::kernels {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Two consecutive rows of a brick, which are prepared together.
constexpr int pair_kernels = 2 * brick_side;

using KernelTag = hn::CappedTag<float, pair_kernels>;
using PixelTag = hn::CappedTag<float, block_pixels>;
using Kernel = hn::Vec<KernelTag>;  // a lane per kernel position
using Pixel = hn::Vec<PixelTag>;    // a lane per pixel
constexpr int kernel_lanes = static_cast<int>(hn::MaxLanes(KernelTag()));
constexpr int pixel_lanes = static_cast<int>(hn::MaxLanes(PixelTag()));
static_assert(pair_kernels % kernel_lanes == 0 && block_pixels % pixel_lanes == 0);

template <class V>
using TagOf = hn::DFromV<V>;
template <class V>
using SignedOf = hn::Vec<hn::RebindToSigned<TagOf<V>>>;
template <class V>
using UnsignedOf = hn::Vec<hn::RebindToUnsigned<TagOf<V>>>;
template <class V>
using MaskOf = hn::Mask<TagOf<V>>;

template <class V>
KERNEL_INLINE V all(float value) {
  return hn::Set(TagOf<V>(), value);
}

template <class V>
KERNEL_INLINE V load(const float* from) {
  return hn::Load(TagOf<V>(), from);
}

template <class V>
KERNEL_INLINE V load_unaligned(const float* from) {
  return hn::LoadU(TagOf<V>(), from);
}

template <class V>
KERNEL_INLINE void store(V value, float* to) {
  hn::Store(value, TagOf<V>(), to);
}

template <class V>
KERNEL_INLINE V clamped(V v, V low, V high) {
  return hn::Min(hn::Max(v, low), high);
}

template <class V>
KERNEL_INLINE V clamped(V v, float low, float high) {
  return clamped(v, all<V>(low), all<V>(high));
}

template <class V>
KERNEL_INLINE SignedOf<V> truncated(V v) {
  return hn::ConvertTo(hn::RebindToSigned<TagOf<V>>(), v);
}

template <class V>
KERNEL_INLINE V from_integer(SignedOf<V> v) {
  return hn::ConvertTo(TagOf<V>(), v);
}

// The lanes of a mask as the lowest bits of an integer.
template <class V>
KERNEL_INLINE std::uint32_t bits_of(MaskOf<V> mask) {
  std::uint8_t bytes[8] = {0};
  hn::StoreMaskBits(TagOf<V>(), mask, bytes);
  std::uint32_t bits = bytes[0];
  if (hn::MaxLanes(TagOf<V>()) > 8) bits |= static_cast<std::uint32_t>(bytes[1]) << 8U;
  return bits;
}

template <class V>
KERNEL_INLINE MaskOf<V> mask_of(std::uint32_t bits) {
  const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(bits),
                                 static_cast<std::uint8_t>(bits >> 8U)};
  return hn::LoadMaskBits(TagOf<V>(), bytes);
}

// Masked samples are NaN, tested by their bits as in the scalar version (body_math.hpp).
template <class V>
KERNEL_INLINE MaskOf<V> is_masked(V v) {
  const hn::RebindToSigned<TagOf<V>> integers;
  const auto magnitude = hn::And(hn::BitCast(integers, v), hn::Set(integers, 0x7fffffff));
  return hn::RebindMask(TagOf<V>(), hn::Gt(magnitude, hn::Set(integers, 0x7f800000)));
}

// Keeps the sign of a divisor and bounds its magnitude away from zero.
template <class V>
KERNEL_INLINE V divisor(V v) {
  const V least = all<V>(1e-30F);
  return hn::IfThenElse(hn::Lt(hn::Abs(v), least), hn::CopySign(least, v), v);
}

template <class V>
KERNEL_INLINE V inverse_of(V v) {
  return hn::Div(all<V>(1.0F), v);
}

// 1 / sqrt(v) of positive, normal numbers, relative error 3e-7: the approximation of the processor
// and one Newton step, or two, as that of NEON has 8 bits and that of x86-64 has 12.
template <class V>
KERNEL_INLINE V inverse_root(V v) {
#if HWY_TARGET == HWY_SCALAR
  return inverse_of(hn::Sqrt(v));
#else
  V guess = hn::ApproximateReciprocalSqrt(v);
  constexpr int steps = HWY_TARGET == HWY_NEON ? 2 : 1;
  for (int step = 0; step < steps; ++step) {
    const V half = all<V>(0.5F) * v * guess;
    guess = guess * hn::NegMulAdd(half, guess, all<V>(1.5F));
  }
  return guess;
#endif
}

// Three components of one quantity.
template <class V>
struct Three {
  V x, y, z;
};

template <class V>
KERNEL_INLINE V dot3(const Three<V>& a, const Three<V>& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, a.x * b.x));
}

template <class V>
KERNEL_INLINE V dot3(const float axis[3], const Three<V>& v) {
  return hn::MulAdd(all<V>(axis[2]), v.z, hn::MulAdd(all<V>(axis[1]), v.y, all<V>(axis[0]) * v.x));
}

template <class V>
KERNEL_INLINE Three<V> cross3(const Three<V>& a, const Three<V>& b) {
  return {hn::MulSub(a.y, b.z, a.z * b.y), hn::MulSub(a.z, b.x, a.x * b.z),
          hn::MulSub(a.x, b.y, a.y * b.x)};
}

}  // namespace
}  // namespace windsplat::engine::kernels
