// Part of the kernel body: partial footprints, by interpolation in their table (partial.hpp).
#pragma once

#include "server/engine/kernels/body_math.hpp"

namespace windsplat::engine::kernels {
namespace {

// Rows of the table of partial footprints for a vector of rays, and the weights between a row and
// the next.
struct PartialRows {
  SignedOf<Pixel> at;
  Pixel part;
};

KERNEL_INLINE PartialRows partial_rows_at(Pixel r2) {
  constexpr float rows_per_t2 = static_cast<float>(partial_rows - 1) / (footprint_t * footprint_t);
  const Pixel row_position =
      hn::Min(r2 * all<Pixel>(rows_per_t2), all<Pixel>(partial_rows - 1.001F));
  const SignedOf<Pixel> row = truncated(row_position);
  const hn::RebindToSigned<PixelTag> integers;
  return {row * hn::Set(integers, partial_columns - 1), row_position - from_integer<Pixel>(row)};
}

// Interpolates between the two values of a table entry.
KERNEL_INLINE Pixel between_columns(SignedOf<Pixel> entry, Pixel part) {
  const hn::RebindToSigned<PixelTag> integers;
  const hn::RebindToUnsigned<PixelTag> bits;
  const SignedOf<Pixel> low = hn::And(entry, hn::Set(integers, 0xffff));
  const auto high = hn::BitCast(integers, hn::ShiftRight<16>(hn::BitCast(bits, entry)));
  const Pixel a = from_integer<Pixel>(low);
  return hn::MulAdd(part, from_integer<Pixel>(high) - a, a);
}

// F(b^2, v) in units of 1 / partial_one, bilinearly interpolated; v in [-1, 1].
KERNEL_INLINE Pixel partial_at(const std::int32_t* HWY_RESTRICT partial, const PartialRows& rows,
                               Pixel v) {
  const hn::RebindToSigned<PixelTag> integers;
  const Pixel one = all<Pixel>(1.0F);
  // The face lies entirely before or behind the splat on all rays.
  if (hn::AllTrue(PixelTag(), hn::Le(v, hn::Neg(one)))) return hn::Zero(PixelTag());
  if (hn::AllTrue(PixelTag(), hn::Ge(v, one))) return all<Pixel>(partial_one);
  const Pixel column_position = (v + one) * all<Pixel>(0.5F * (partial_columns - 1));
  const SignedOf<Pixel> column =
      hn::Min(truncated(column_position), hn::Set(integers, partial_columns - 2));
  const Pixel part = column_position - from_integer<Pixel>(column);
  const SignedOf<Pixel> at = rows.at + column;
  const Pixel upper = between_columns(hn::GatherIndex(integers, partial, at), part);
  const Pixel lower =
      between_columns(hn::GatherIndex(integers, partial + (partial_columns - 1), at), part);
  return hn::MulAdd(rows.part, lower - upper, upper);
}

// Half the chord of a ray through a splat, in cells, at a squared distance r2 from its centre.
KERNEL_INLINE Pixel half_chord(Pixel r2) {
  constexpr float t2 = footprint_t * footprint_t;
  return hn::Sqrt(hn::Max(all<Pixel>(t2) - r2, all<Pixel>(1e-6F)));
}

}  // namespace
}  // namespace windsplat::engine::kernels
