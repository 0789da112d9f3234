// Part of the kernel body: partial footprints, the fraction of a splat's footprint that lies in
// front of a point of a ray.
#pragma once

#include "server/engine/kernels/body_math.hpp"

namespace windsplat::engine::kernels {
namespace {

// F(b^2, v): b is the distance of the ray from the centre in strides, v the position along the ray
// from its middle in half chords sqrt(t^2 - b^2). It is the integral of the kernel K whose
// projection is the footprint g (inverse Abel transform; a = sqrt(t^2 - r^2), c = sqrt(s^2 - r^2)):
//   r < s:       pi K = 2 c / (s t) + 2 / (t (t - s)) (t ln((t + a) / (s + c)) - (a - c))
//   s <= r < t:  pi K = 2 / (t (t - s)) (t ln((t + a) / r) - a)
// With w = v^2 and y = 1 - w, fitted by
//   F = 1/2 + v (1/2 + y (1/4 + y (3/16 + y (q0 + q1 w + q2 w^2 + ...))))
// which rises monotonically from 0 at v = -1 to 1 at v = 1 and is level there. The terms q are
// polynomials in b^2, others below s than beyond. The error is 9e-4 at most, 2e-4 RMS below s and
// 1e-4 beyond.
constexpr int partial_terms = 5;
constexpr float partial_inner[partial_terms][4] = {{0.0855844F, 0.23892F, 3.37065F, -13.2898F},
                                                   {0.59694F, 1.88703F, -63.9974F, 152.747F},
                                                   {-2.9509F, -23.9174F, 327.417F, -636.777F},
                                                   {4.64447F, 61.1997F, -633.848F, 1081.12F},
                                                   {-2.59135F, -45.8709F, 410.941F, -636.059F}};
constexpr float partial_outer[partial_terms - 1][5] = {
    {0.289183F, -0.770765F, 0.752115F, -0.369274F, 0.0696005F},
    {-0.800177F, 2.43022F, -2.98983F, 1.60222F, -0.315608F},
    {1.29155F, -4.45275F, 5.76793F, -3.20129F, 0.644157F},
    {-0.935199F, 2.97857F, -4.05032F, 2.28663F, -0.465138F}};

// The terms q for a vector of rays.
struct PartialTerms {
  Pixel q[partial_terms];
};

template <int Terms, int Powers>
KERNEL_INLINE PartialTerms partial_terms_by(const float (&factors)[Terms][Powers], Pixel r2) {
  PartialTerms out;
  for (int k = 0; k < Terms; ++k) {
    out.q[k] = all<Pixel>(factors[k][Powers - 1]);
    for (int power = Powers - 2; power >= 0; --power) {
      out.q[k] = hn::MulAdd(out.q[k], r2, all<Pixel>(factors[k][power]));
    }
  }
  for (int k = Terms; k < partial_terms; ++k) out.q[k] = hn::Zero(PixelTag());
  return out;
}

KERNEL_INLINE PartialTerms partial_terms_at(Pixel r2) {
  const auto inner = hn::Lt(r2, all<Pixel>(footprint_s * footprint_s));
  PartialTerms out =
      partial_terms_by(partial_outer, hn::Min(r2, all<Pixel>(footprint_t * footprint_t)));
  if (hn::AllFalse(PixelTag(), inner)) return out;
  const PartialTerms within = partial_terms_by(partial_inner, r2);
  for (int k = 0; k < partial_terms; ++k) {
    out.q[k] = hn::IfThenElse(inner, within.q[k], out.q[k]);
  }
  return out;
}

// v in [-1, 1].
KERNEL_INLINE Pixel partial_at(const PartialTerms& terms, Pixel v) {
  const Pixel w = v * v;
  const Pixel y = all<Pixel>(1.0F) - w;
  Pixel p = terms.q[partial_terms - 1];
  for (int k = partial_terms - 2; k >= 0; --k) p = hn::MulAdd(p, w, terms.q[k]);
  for (const float factor : {0.1875F, 0.25F, 0.5F}) p = hn::MulAdd(p, y, all<Pixel>(factor));
  return hn::MulAdd(v, p, all<Pixel>(0.5F));
}

// The same with q = q0 + q1 b^2 alone, for slabs of about a cell or more: there the error,
// 9e-3 at most and 4e-3 RMS, is a hundredth of what a homogeneous slab displaces.
constexpr float partial_coarse[2] = {0.127539F, -0.139941F};

KERNEL_INLINE Pixel partial_coarse_term_at(Pixel r2) {
  return hn::MulAdd(r2, all<Pixel>(partial_coarse[1]), all<Pixel>(partial_coarse[0]));
}

// v in [-1, 1].
KERNEL_INLINE Pixel partial_coarse_at(Pixel term, Pixel v) {
  const Pixel y = hn::NegMulAdd(v, v, all<Pixel>(1.0F));
  Pixel p = term;
  for (const float factor : {0.1875F, 0.25F, 0.5F}) p = hn::MulAdd(p, y, all<Pixel>(factor));
  return hn::MulAdd(v, p, all<Pixel>(0.5F));
}

// 1 / sqrt(t^2 - r2), the inverse of half the chord of a ray in cells.
KERNEL_INLINE Pixel inverse_half_chord(Pixel r2) {
  constexpr float t2 = footprint_t * footprint_t;
  return inverse_root(hn::Max(all<Pixel>(t2) - r2, all<Pixel>(1e-6F)));
}

void partial(int count, const float* r2, const float* v, float* before) {
  for (int first = 0; first < count; first += pixel_lanes) {
    const int here = count - first < pixel_lanes ? count - first : pixel_lanes;
    alignas(64) float lanes[2][block_pixels] = {};
    for (int l = 0; l < here; ++l) {
      lanes[0][l] = r2[first + l];
      lanes[1][l] = v[first + l];
    }
    store(partial_at(partial_terms_at(load<Pixel>(lanes[0])), load<Pixel>(lanes[1])), lanes[0]);
    for (int l = 0; l < here; ++l) before[first + l] = lanes[0][l];
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
