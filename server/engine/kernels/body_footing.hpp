// Part of the kernel body: the blocks of a tile that lines and splats may touch.
#pragma once

#include "server/engine/kernels/body_lines.hpp"
#include "server/engine/kernels/body_splats.hpp"

namespace windsplat::engine::kernels {
namespace {

// Clamps the first column: for outlines right of the tile it exceeds the bits of a word.
KERNEL_INLINE UnsignedOf<Kernel> shift_of(KernelInteger first) {
  const auto most = hn::Set(KernelIntegers(), tile_blocks - 1);
  return hn::BitCast(hn::RebindToUnsigned<KernelTag>(), hn::Min(first, most));
}

// The bits from first to last; none if last < first.
KERNEL_INLINE UnsignedOf<Kernel> range_masks(const Ranges& range) {
  const hn::RebindToUnsigned<KernelTag> tag;
  const auto one = hn::Set(tag, 1U);
  const auto above =
      hn::Shl(one + one, hn::BitCast(tag, hn::Max(range.last, hn::Zero(KernelIntegers()))));
  const auto below = hn::Shl(one, shift_of(range.first));
  const auto bits = hn::AndNot(below - one, above - one);
  const auto none = hn::Gt(range.first, range.last);
  return hn::IfThenZeroElse(hn::RebindMask(tag, none), bits);
}

// The largest of the lanes selected by `bits`, at least 0.
KERNEL_INLINE int most_of(KernelInteger value, std::uint32_t bits) {
  const auto among = hn::RebindMask(KernelIntegers(), mask_of<Kernel>(bits));
  return hn::GetLane(hn::MaxOfLanes(
      KernelIntegers(), hn::Max(hn::IfThenElseZero(among, value), hn::Zero(KernelIntegers()))));
}

// The lines of a vector of kernel positions as segments relative to the corner of the tile.
struct LineSpans {
  Kernel x, y, ux, uy;
  Ranges rows, columns;
};

KERNEL_INLINE LineSpans line_spans(const LineStyle& line, const Ribbons& r, const Tile& tile,
                                   int l) {
  const Kernel radius = all<Kernel>(line.outer);
  LineSpans s;
  s.x = load<Kernel>(r.x + l) - all<Kernel>(static_cast<float>(tile.x));
  s.y = load<Kernel>(r.y + l) - all<Kernel>(static_cast<float>(tile.y));
  s.ux = load<Kernel>(r.ux + l);
  s.uy = load<Kernel>(r.uy + l);
  const Kernel bottom = s.y + s.uy;
  const Kernel end = s.x + s.ux;
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
                                           KernelInteger& most, Footing& f) {
  const LineSpans s = line_spans(line, r, tile, l);
  const auto missing =
      hn::Or(hn::Gt(s.rows.first, s.rows.last), hn::Gt(s.columns.first, s.columns.last));
  const KernelInteger tall = s.rows.last - s.rows.first;
  const auto within = hn::Set(KernelIntegers(), window_side);
  const auto windowed =
      hn::And(hn::Lt(tall, within), hn::Lt(s.columns.last - s.columns.first, within));
  const std::uint64_t small = bits_of<Kernel>(hn::RebindMask(KernelTag(), windowed));
  f.windowed |= small << static_cast<unsigned>(l);
  store(s.rows.first, f.line_first + l);
  store(s.rows.last, f.line_last + l);
  store(s.columns.first, f.line_column + l);
  store(s.columns.last, f.line_column_last + l);
  const std::uint32_t touching = bits & ~bits_of<Kernel>(hn::RebindMask(KernelTag(), missing));
  if (touching == 0) return 0;
  // Lanes without a line may hold NaN, so their comparisons are meaningless.
  const auto among = hn::RebindMask(KernelIntegers(), mask_of<Kernel>(touching));
  most = hn::Max(most, hn::IfThenElseZero(among, tall));
  return touching;
}

// Computes the columns of blocks that lines may touch in each of their rows, up to `most` after the
// first: those of the part of the segment within `outer` of the pixel centres of the row, widened
// by it.
KERNEL_INLINE void find_line_columns(const LineStyle& line, const Ribbons& r, const Tile& tile,
                                     int l, int most, Footing& f) {
  const LineSpans s = line_spans(line, r, tile, l);
  const int columns = blocks_of(tile.width);
  const Kernel radius = all<Kernel>(line.outer);
  const Kernel zero = hn::Zero(KernelTag());
  const Kernel one = all<Kernel>(1.0F);
  // A horizontal line uses its whole length in every row.
  const auto level = hn::Le(hn::Abs(s.uy), all<Kernel>(1e-3F));
  const Kernel inverse = inverse_of(hn::IfThenElse(level, one, s.uy));
  const Kernel widen = hn::IfThenElseZero(level, all<Kernel>(1e6F));
  const Kernel first = from_integer<Kernel>(s.rows.first);
  const KernelInteger tall = s.rows.last - s.rows.first;
  const hn::RebindToUnsigned<KernelTag> masks;
  const auto column = shift_of(s.columns.first);
  auto low = hn::Zero(masks);
  auto high = hn::Zero(masks);
  for (int k = 0; k <= most; ++k) {
    const Kernel row = first + all<Kernel>(static_cast<float>(k));
    const Kernel top = hn::MulAdd(row, all<Kernel>(block_side), all<Kernel>(0.5F)) - s.y;
    const Kernel a = (top - radius) * inverse;
    const Kernel b = (top + all<Kernel>(block_side - 1) + radius) * inverse;
    const Kernel from = clamped(hn::Min(a, b) - widen, zero, one);
    const Kernel to = clamped(hn::Max(a, b) + widen, zero, one);
    const Kernel xa = hn::MulAdd(from, s.ux, s.x);
    const Kernel xb = hn::MulAdd(to, s.ux, s.x);
    const auto here =
        range_masks(blocks_between(hn::Min(xa, xb) - radius, hn::Max(xa, xb) + radius, columns));
    hn::Store(here, masks, f.line_columns[k] + l);
    // Discard the bits of lines that end before row k.
    const auto ends = hn::Gt(hn::Set(KernelIntegers(), k), tall);
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
KERNEL_INLINE Extent oval_between(const Oval& o, Kernel top, Kernel bottom) {
  const Kernel turn = o.shear * o.half_width;
  const auto chord = [&](Kernel y, Kernel side) {
    const Kernel half2 =
        hn::Max(hn::NegMulAdd(o.narrowing, y * y, o.half_chord2), hn::Zero(KernelTag()));
    return hn::MulAdd(side, hn::Sqrt(half2), o.lean * y);
  };
  const Kernel one = all<Kernel>(1.0F);
  return {chord(clamped(hn::Neg(turn), top, bottom), hn::Neg(one)),
          chord(clamped(turn, top, bottom), one)};
}

// Computes the columns that the ellipse of a splat touches in each row of its box of blocks.
KERNEL_INLINE void find_splat_columns(const Outline& outline, const Ranges& across,
                                      const Ranges& down, const Tile& tile, int l, int most,
                                      Footing& f) {
  const hn::RebindToUnsigned<KernelTag> masks;
  const int columns = blocks_of(tile.width);
  const Kernel x = outline.oval.x - all<Kernel>(static_cast<float>(tile.x));
  const Kernel from_middle = hn::MulAdd(from_integer<Kernel>(down.first), all<Kernel>(block_side),
                                        all<Kernel>(0.5F + static_cast<float>(tile.y))) -
                             outline.oval.y;
  const KernelInteger tall = down.last - down.first;
  const auto column = shift_of(across.first);
  const auto box = range_masks(across);
  auto low = hn::Zero(masks);
  auto high = hn::Zero(masks);
  for (int k = 0; k <= most; ++k) {
    const Kernel top = from_middle + all<Kernel>(static_cast<float>(k * block_side));
    const Extent here = oval_between(outline.oval, top, top + all<Kernel>(block_side - 1));
    const auto touched = range_masks(blocks_between(x + here.low, x + here.high, columns));
    const auto kept = hn::IfThenElse(hn::RebindMask(masks, outline.oval.known), box & touched, box);
    const auto ends = hn::Gt(hn::Set(KernelIntegers(), k), tall);
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
  const Kernel left = all<Kernel>(static_cast<float>(tile.x));
  const Kernel top = all<Kernel>(static_cast<float>(tile.y));
  const Ranges across =
      blocks_between(outline.x.low - left, outline.x.high - left, blocks_of(tile.width));
  const Ranges down =
      blocks_between(outline.y.low - top, outline.y.high - top, blocks_of(tile.height));
  store(across.first, f.column_first + l);
  store(across.last, f.column_last + l);
  store(down.first, f.row_first + l);
  store(down.last, f.row_last + l);
  const auto missing = hn::Or(hn::Gt(across.first, across.last), hn::Gt(down.first, down.last));
  const std::uint32_t touching = bits & ~bits_of<Kernel>(hn::RebindMask(KernelTag(), missing));
  if (touching == 0) return 0;
  const auto within = hn::Set(KernelIntegers(), window_side);
  const KernelInteger tall = down.last - down.first;
  const auto small = hn::And(hn::Lt(tall, within), hn::Lt(across.last - across.first, within));
  const KernelInteger rows = hn::IfThenElseZero(small, tall);
  find_splat_columns(outline, across, down, tile, l, most_of(rows, touching), f);
  return touching;
}

}  // namespace
}  // namespace windsplat::engine::kernels
