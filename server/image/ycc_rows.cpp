// Linear pixels over a background -> sRGB values -> luma and chroma, compiled once per instruction
// set. Targets with fused multiply-add agree exactly, the others within one code.
#include "server/image/ycc_rows.hpp"

// Vectors of SVE cannot be members; arm64 has NEON always.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/image/ycc_rows.cpp"
#include <hwy/foreach_target.h>  // what follows is compiled for every target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace windsplat::image::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;
using Floats = hn::Vec<Tag>;
constexpr Tag tag;

struct Colours {
  Floats red;
  Floats green;
  Floats blue;
};

struct Values {  // sRGB, 0..255
  alignas(64) std::array<float, row_pixels> red;
  alignas(64) std::array<float, row_pixels> green;
  alignas(64) std::array<float, row_pixels> blue;
};

HWY_INLINE Floats times_plus(Floats a, Floats b, float c) {
  return hn::MulAdd(a, b, hn::Set(tag, c));
}

// 255 times the encoded value, within 1/12 of a code of the formula (srgb_from_linear): the power
// is approximated by a minimax polynomial in the square root on [0.0031308, 1]. The value is not
// rounded before luma and chroma are computed.
HWY_INLINE Floats srgb_value(Floats linear) {
  const Floats zero = hn::Zero(tag);
  const Floats above_zero = hn::IfThenElseZero(hn::Gt(linear, zero), linear);  // NaN becomes 0 too
  const Floats x = hn::Min(above_zero, hn::Set(tag, 1.0F));
  const Floats s = hn::Sqrt(x);
  Floats curve = times_plus(s, hn::Set(tag, 131.912689F), -414.033696F);
  curve = times_plus(curve, s, 518.051721F);
  curve = times_plus(curve, s, -357.697558F);
  curve = times_plus(curve, s, 387.077357F);
  curve = times_plus(curve, s, -10.227942F);
  const Floats line = hn::Mul(x, hn::Set(tag, 255.0F * 12.92F));
  return hn::IfThenElse(hn::Gt(x, hn::Set(tag, 0.0031308F)), curve, line);
}

// ITU-T T.871 (JFIF), section 7.
HWY_INLINE Floats luma_of(const Colours& c) {
  return hn::MulAdd(
      c.red, hn::Set(tag, 0.299F),
      hn::MulAdd(c.green, hn::Set(tag, 0.587F), hn::Mul(c.blue, hn::Set(tag, 0.114F))));
}

HWY_INLINE void store_codes(Floats value, std::uint8_t* to) {
  const hn::Rebind<std::int32_t, Tag> whole;
  const hn::Rebind<std::uint8_t, Tag> bytes;
  const auto rounded = hn::ConvertTo(whole, hn::Add(value, hn::Set(tag, 0.5F)));
  hn::StoreU(hn::DemoteTo(bytes, rounded), bytes, to);
}

HWY_INLINE void store_chroma(const Colours& c, Floats luma, std::uint8_t* blue, std::uint8_t* red) {
  store_codes(times_plus(hn::Sub(c.blue, luma), hn::Set(tag, 1 / 1.772F), 128.0F), blue);
  store_codes(times_plus(hn::Sub(c.red, luma), hn::Set(tag, 1 / 1.402F), 128.0F), red);
}

HWY_INLINE Colours colours_at(const float* rgba, const Background& background) {
  Floats red;
  Floats green;
  Floats blue;
  Floats alpha;
  hn::LoadInterleaved4(tag, rgba, red, green, blue, alpha);
  // Shortcut for empty pixels, which are frequent.
  const hn::RebindToUnsigned<Tag> bits;
  if (hn::AllTrue(bits, hn::Eq(hn::Or(hn::Or(hn::BitCast(bits, red), hn::BitCast(bits, green)),
                                      hn::Or(hn::BitCast(bits, blue), hn::BitCast(bits, alpha))),
                               hn::Zero(bits)))) {
    return {hn::Set(tag, background.value[0]), hn::Set(tag, background.value[1]),
            hn::Set(tag, background.value[2])};
  }
  const Floats rest = hn::Sub(hn::Set(tag, 1.0F), alpha);
  const auto over = [&](Floats linear, float behind) {
    return srgb_value(hn::MulAdd(rest, hn::Set(tag, behind), linear));
  };
  return {over(red, background.linear[0]), over(green, background.linear[1]),
          over(blue, background.linear[2])};
}

void fill_values(const float* rgba, const Background& background, Values& values, RowCodes& luma) {
  for (std::size_t i = 0; i < row_pixels; i += hn::Lanes(tag)) {
    const Colours c = colours_at(rgba + 4 * i, background);
    store_codes(luma_of(c), &luma[i]);
    hn::Store(c.red, tag, &values.red[i]);
    hn::Store(c.green, tag, &values.green[i]);
    hn::Store(c.blue, tag, &values.blue[i]);
  }
}

using Channel = std::array<float, row_pixels>;

HWY_INLINE Floats mean_at(const Channel& upper, const Channel& lower, std::size_t i) {
  Floats a;
  Floats b;
  Floats c;
  Floats d;
  hn::LoadInterleaved2(tag, &upper[2 * i], a, b);
  hn::LoadInterleaved2(tag, &lower[2 * i], c, d);
  return hn::Mul(hn::Add(hn::Add(a, b), hn::Add(c, d)), hn::Set(tag, 0.25F));
}

Background background_here(const std::array<float, 3>& linear) {
  Background background{linear, {}};
  for (std::size_t c = 0; c < 3; ++c) {
    background.value[c] = hn::GetLane(srgb_value(hn::Set(tag, linear[c])));
  }
  return background;
}

void convert_row_here(const float* rgba, const Background& background, YccRow& codes) {
  for (std::size_t i = 0; i < row_pixels; i += hn::Lanes(tag)) {
    const Colours c = colours_at(rgba + 4 * i, background);
    const Floats luma = luma_of(c);
    store_codes(luma, &codes.luma[i]);
    store_chroma(c, luma, &codes.blue[i], &codes.red[i]);
  }
}

void convert_pair_here(const float* upper, const float* lower, const Background& background,
                       YccPair& codes) {
  Values above;
  Values below;
  fill_values(upper, background, above, codes.upper);
  fill_values(lower, background, below, codes.lower);
  for (std::size_t i = 0; i < row_pixels / 2; i += hn::Lanes(tag)) {
    const Colours c{mean_at(above.red, below.red, i), mean_at(above.green, below.green, i),
                    mean_at(above.blue, below.blue, i)};
    store_chroma(c, luma_of(c), &codes.blue[i], &codes.red[i]);
  }
}

}  // namespace
}  // namespace windsplat::image::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace windsplat::image {

HWY_EXPORT(background_here);
HWY_EXPORT(convert_row_here);
HWY_EXPORT(convert_pair_here);

Background background_of(const std::array<float, 3>& linear) {
  return HWY_DYNAMIC_DISPATCH(background_here)(linear);
}

void convert_row(const float* rgba, const Background& background, YccRow& codes) {
  HWY_DYNAMIC_DISPATCH(convert_row_here)(rgba, background, codes);
}

void convert_pair(const float* upper, const float* lower, const Background& background,
                  YccPair& codes) {
  HWY_DYNAMIC_DISPATCH(convert_pair_here)(upper, lower, background, codes);
}

}  // namespace windsplat::image
#endif
