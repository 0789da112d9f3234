// Part of the kernel body: the blocks of a tile that lines and splats may touch.
#pragma once

#include "server/engine/kernels/body_lines.hpp"
#include "server/engine/kernels/body_splats.hpp"

namespace windsplat::engine::kernels {
namespace {

// Clamps the first column: for outlines right of the tile it exceeds the bits of a word.
KERNEL_INLINE UnsignedOf<Stop> shift_of(StopInteger first) {
  const auto most = hn::Set(StopIntegers(), tile_blocks - 1);
  return hn::BitCast(hn::RebindToUnsigned<StopTag>(), hn::Min(first, most));
}

// The bits from first to last; none if last < first.
KERNEL_INLINE UnsignedOf<Stop> range_masks(const Ranges& range) {
  const hn::RebindToUnsigned<StopTag> tag;
  const auto one = hn::Set(tag, 1U);
  const auto above =
      hn::Shl(one + one, hn::BitCast(tag, hn::Max(range.last, hn::Zero(StopIntegers()))));
  const auto below = hn::Shl(one, shift_of(range.first));
  const auto bits = hn::AndNot(below - one, above - one);
  const auto none = hn::Gt(range.first, range.last);
  return hn::IfThenZeroElse(hn::RebindMask(tag, none), bits);
}

// The largest of the lanes selected by `bits`, at least 0.
KERNEL_INLINE int most_of(StopInteger value, std::uint32_t bits) {
  const auto among = hn::RebindMask(StopIntegers(), mask_of<Stop>(bits));
  return hn::GetLane(hn::MaxOfLanes(
      StopIntegers(), hn::Max(hn::IfThenElseZero(among, value), hn::Zero(StopIntegers()))));
}

// The lines of a vector of kernel positions as segments relative to the corner of the tile.
struct LineSpans {
  Stop x, y, ux, uy;
  Ranges rows, columns;
};

KERNEL_INLINE LineSpans line_spans(const LineStyle& line, const Ribbons& r, const Tile& tile,
                                   int l) {
  const Stop radius = all<Stop>(line.r2);
  LineSpans s;
  s.x = load<Stop>(r.x + l) - all<Stop>(static_cast<float>(tile.x));
  s.y = load<Stop>(r.y + l) - all<Stop>(static_cast<float>(tile.y));
  s.ux = load<Stop>(r.ux + l);
  s.uy = load<Stop>(r.uy + l);
  const Stop bottom = s.y + s.uy;
  const Stop end = s.x + s.ux;
  s.rows = blocks_between(hn::Min(s.y, bottom) - radius, hn::Max(s.y, bottom) + radius,
                          blocks_of(tile.height));
  s.columns =
      blocks_between(hn::Min(s.x, end) - radius, hn::Max(s.x, end) + radius, blocks_of(tile.width));
  return s;
}

// Computes the rows of blocks that lines may touch. Returns which of `bits` touch any. `most` is
// updated to the largest number of rows after the first of any line.
KERNEL_INLINE std::uint32_t find_line_rows(const LineStyle& line, const Ribbons& r,
                                           const Tile& tile, int l, std::uint32_t bits,
                                           StopInteger& most, Footing& f) {
  const LineSpans s = line_spans(line, r, tile, l);
  const auto missing =
      hn::Or(hn::Gt(s.rows.first, s.rows.last), hn::Gt(s.columns.first, s.columns.last));
  const StopInteger tall = s.rows.last - s.rows.first;
  const auto within = hn::Set(StopIntegers(), window_side);
  const auto windowed =
      hn::And(hn::Lt(tall, within), hn::Lt(s.columns.last - s.columns.first, within));
  const std::uint64_t small = bits_of<Stop>(hn::RebindMask(StopTag(), windowed));
  f.windowed |= small << static_cast<unsigned>(l);
  store(s.rows.first, f.line_first + l);
  store(s.rows.last, f.line_last + l);
  store(s.columns.first, f.line_column + l);
  store(s.columns.last, f.line_column_last + l);
  const std::uint32_t touching = bits & ~bits_of<Stop>(hn::RebindMask(StopTag(), missing));
  if (touching == 0) return 0;
  // Lanes without a line may hold NaN, so their comparisons are meaningless.
  const auto among = hn::RebindMask(StopIntegers(), mask_of<Stop>(touching));
  most = hn::Max(most, hn::IfThenElseZero(among, tall));
  return touching;
}

// Computes the columns of blocks that lines may touch in each of their rows, up to `most` after the
// first: those of the part of the segment within r2 of the pixel centres of the row, widened by r2.
KERNEL_INLINE void find_line_columns(const LineStyle& line, const Ribbons& r, const Tile& tile,
                                     int l, int most, Footing& f) {
  const LineSpans s = line_spans(line, r, tile, l);
  const int columns = blocks_of(tile.width);
  const Stop radius = all<Stop>(line.r2);
  const Stop zero = hn::Zero(StopTag());
  const Stop one = all<Stop>(1.0F);
  // A horizontal line uses its whole length in every row.
  const auto level = hn::Le(hn::Abs(s.uy), all<Stop>(1e-3F));
  const Stop inverse = inverse_of(hn::IfThenElse(level, one, s.uy));
  const Stop widen = hn::IfThenElseZero(level, all<Stop>(1e6F));
  const Stop first = from_integer<Stop>(s.rows.first);
  const StopInteger tall = s.rows.last - s.rows.first;
  const hn::RebindToUnsigned<StopTag> masks;
  const auto column = shift_of(s.columns.first);
  auto low = hn::Zero(masks);
  auto high = hn::Zero(masks);
  for (int k = 0; k <= most; ++k) {
    const Stop row = first + all<Stop>(static_cast<float>(k));
    const Stop top = hn::MulAdd(row, all<Stop>(block_side), all<Stop>(0.5F)) - s.y;
    const Stop a = (top - radius) * inverse;
    const Stop b = (top + all<Stop>(block_side - 1) + radius) * inverse;
    const Stop from = clamped(hn::Min(a, b) - widen, zero, one);
    const Stop to = clamped(hn::Max(a, b) + widen, zero, one);
    const Stop xa = hn::MulAdd(from, s.ux, s.x);
    const Stop xb = hn::MulAdd(to, s.ux, s.x);
    const auto here =
        range_masks(blocks_between(hn::Min(xa, xb) - radius, hn::Max(xa, xb) + radius, columns));
    hn::Store(here, masks, f.line_columns[k] + l);
    // Discard the bits of lines that end before row k.
    const auto ends = hn::Gt(hn::Set(StopIntegers(), k), tall);
    const auto shifted = hn::IfThenZeroElse(hn::RebindMask(masks, ends), hn::Shr(here, column));
    if (k < window_side / 2) {
      low = low | hn::ShiftLeftSame(shifted, window_side * k);
    } else if (k < window_side) {
      high = high | hn::ShiftLeftSame(shifted, window_side * (k - window_side / 2));
    }
  }
  hn::Store(low, masks, f.window_low + l);
  hn::Store(high, masks, f.window_high + l);
}

// Horizontal extent of an ellipse between two heights below its centre, relative to the centre. Its
// rightmost and leftmost points are at heights `turn` and -turn.
KERNEL_INLINE Extent oval_between(const Oval& o, Stop top, Stop bottom) {
  const Stop turn = o.shear * o.half_width;
  const auto chord = [&](Stop y, Stop side) {
    const Stop half2 =
        hn::Max(hn::NegMulAdd(o.narrowing, y * y, o.half_chord2), hn::Zero(StopTag()));
    return hn::MulAdd(side, hn::Sqrt(half2), o.lean * y);
  };
  const Stop one = all<Stop>(1.0F);
  return {chord(clamped(hn::Neg(turn), top, bottom), hn::Neg(one)),
          chord(clamped(turn, top, bottom), one)};
}

// Computes the columns that the ellipse of a splat touches in each row of its box of blocks.
KERNEL_INLINE void find_splat_columns(const Outline& outline, const Ranges& across,
                                      const Ranges& down, const Tile& tile, int l, int most,
                                      Footing& f) {
  const hn::RebindToUnsigned<StopTag> masks;
  const int columns = blocks_of(tile.width);
  const Stop x = outline.oval.x - all<Stop>(static_cast<float>(tile.x));
  const Stop from_middle = hn::MulAdd(from_integer<Stop>(down.first), all<Stop>(block_side),
                                      all<Stop>(0.5F + static_cast<float>(tile.y))) -
                           outline.oval.y;
  const StopInteger tall = down.last - down.first;
  const auto column = shift_of(across.first);
  const auto box = range_masks(across);
  auto low = hn::Zero(masks);
  auto high = hn::Zero(masks);
  for (int k = 0; k <= most; ++k) {
    const Stop top = from_middle + all<Stop>(static_cast<float>(k * block_side));
    const Extent here = oval_between(outline.oval, top, top + all<Stop>(block_side - 1));
    const auto met = range_masks(blocks_between(x + here.low, x + here.high, columns));
    const auto kept = hn::IfThenElse(hn::RebindMask(masks, outline.oval.known), box & met, box);
    const auto ends = hn::Gt(hn::Set(StopIntegers(), k), tall);
    const auto shifted = hn::IfThenZeroElse(hn::RebindMask(masks, ends), hn::Shr(kept, column));
    if (k < window_side / 2) {
      low = low | hn::ShiftLeftSame(shifted, window_side * k);
    } else {
      high = high | hn::ShiftLeftSame(shifted, window_side * (k - window_side / 2));
    }
  }
  hn::Store(low, masks, f.splat_low + l);
  hn::Store(high, masks, f.splat_high + l);
}

// Computes the blocks that splats may touch. Returns which of `bits` touch any.
KERNEL_INLINE std::uint32_t find_splat_blocks(const Outline& outline, const Tile& tile, int l,
                                              std::uint32_t bits, Footing& f) {
  const Stop left = all<Stop>(static_cast<float>(tile.x));
  const Stop top = all<Stop>(static_cast<float>(tile.y));
  const Ranges across =
      blocks_between(outline.x.low - left, outline.x.high - left, blocks_of(tile.width));
  const Ranges down =
      blocks_between(outline.y.low - top, outline.y.high - top, blocks_of(tile.height));
  store(across.first, f.column_first + l);
  store(across.last, f.column_last + l);
  store(down.first, f.row_first + l);
  store(down.last, f.row_last + l);
  const auto missing = hn::Or(hn::Gt(across.first, across.last), hn::Gt(down.first, down.last));
  const std::uint32_t touching = bits & ~bits_of<Stop>(hn::RebindMask(StopTag(), missing));
  if (touching == 0) return 0;
  const auto within = hn::Set(StopIntegers(), window_side);
  const StopInteger tall = down.last - down.first;
  const auto small = hn::And(hn::Lt(tall, within), hn::Lt(across.last - across.first, within));
  const StopInteger rows = hn::IfThenElseZero(small, tall);
  find_splat_columns(outline, across, down, tile, l, most_of(rows, touching), f);
  return touching;
}

}  // namespace
}  // namespace windsplat::engine::kernels
