// Part of the kernel body: records the lines of the slab method for the blocks they cross.
#pragma once

#include "server/engine/kernels/body_gather.hpp"

namespace windsplat::engine::kernels {
namespace {

inline RibbonRecord ribbon_record(const LineStyle& line, const Prepared& p, int l) {
  RibbonRecord out = {ribbon_at(line, p.ribbons, l), line.moving, 0};
  out.ribbon.depth += p.positions.depth[l];
  out.bent = absolute(out.ribbon.bend) > series_bend_max ? 1 : 0;
  return out;
}

// The range of depths of a line at the pixels of the blocks of one row, one lane per column.
struct DepthRange {
  Pixel first, last;
};

template <bool Perspective>
KERNEL_INLINE DepthRange row_depths(const Ribbon& r, float margin, Pixel x, float y) {
  constexpr float farthest = 0.5F * (block_side - 1);  // largest distance of pixel centres from the
                                                       // block centre
  const auto depth_at = [&](Pixel along) {
    const Pixel w = clamped(along, 0.0F, 1.0F);
    const Pixel one = all<Pixel>(1.0F);
    const Pixel f =
        Perspective ? w * all<Pixel>(r.depth_ratio) / hn::MulAdd(w, all<Pixel>(r.bend), one) : w;
    return hn::MulAdd(f, all<Pixel>(r.depth_rise), all<Pixel>(r.depth));
  };
  const Pixel w =
      hn::MulAdd(x - all<Pixel>(r.x), all<Pixel>(r.wx), all<Pixel>((y - r.y) * r.wy + r.w0));
  const Pixel reach = all<Pixel>(farthest * (absolute(r.wx) + absolute(r.wy)));
  const Pixel a = depth_at(w - reach);
  const Pixel b = depth_at(w + reach);
  // Margin for rounding of the depths of the line and of the slab faces.
  constexpr float rounding = 1e-6F;
  const Pixel slack =
      hn::MulAdd(hn::Max(hn::Abs(a), hn::Abs(b)), all<Pixel>(rounding), all<Pixel>(margin));
  return {hn::Min(a, b) - slack, hn::Max(a, b) + slack};
}

// Lists the open blocks that line l may touch. Returns their number.
template <bool Perspective>
KERNEL_INLINE int list_hits(const RibbonRecord& line, const Footing& f, int l, std::uint32_t slot,
                            float margin, const Tile& tile, Hit* hits) {
  constexpr float middle = 0.5F * block_side;
  int n = 0;
  for (int row = f.line_first[l], k = 0; row <= f.line_last[l]; ++row, ++k) {
    std::uint32_t left = f.line_columns[k][l] & tile.open[row];
    while (left != 0) {
      const int from = __builtin_ctz(left);
      const Pixel x = hn::MulAdd(hn::Iota(PixelTag(), 0), all<Pixel>(block_side),
                                 all<Pixel>(left_of(tile, from) + middle));
      const DepthRange range =
          row_depths<Perspective>(line.ribbon, margin, x, top_of(tile, row) + middle);
      alignas(64) float first[block_pixels];
      alignas(64) float last[block_pixels];
      store(range.first, first);
      store(range.last, last);
      std::uint32_t here = left >> static_cast<unsigned>(from) & ((2U << (pixel_lanes - 1)) - 1U);
      left &= ~(here << static_cast<unsigned>(from));
      for (; here != 0; here &= here - 1U) {
        const int c = __builtin_ctz(here);
        hits[n++] = {slot, row * tile_blocks + from + c, first[c], last[c]};
      }
    }
  }
  return n;
}

template <bool Perspective>
int pack_lines_on(const Prepared& p, float slab_depth, const std::uint32_t* slots, const Tile& tile,
                  RibbonRecord* records, Hit* hits, int* counts) {
  const float margin = 1e-4F * slab_depth;
  int n = 0;
  for (std::uint64_t left = p.positions.lines; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    RibbonRecord& record = records[slots[n]];
    record = ribbon_record(p.pass->line, p, l);
    const int count = list_hits<Perspective>(record, p.footing, l, slots[n], margin, tile, hits);
    if (count == 0) continue;
    hits += count;
    counts[n++] = count;
  }
  return n;
}

int pack_lines(const Camera& camera, const Prepared& p, float slab_depth,
               const std::uint32_t* slots, const Tile& tile, RibbonRecord* records, Hit* hits,
               int* counts) {
  return camera.perspective != 0
             ? pack_lines_on<true>(p, slab_depth, slots, tile, records, hits, counts)
             : pack_lines_on<false>(p, slab_depth, slots, tile, records, hits, counts);
}

}  // namespace
}  // namespace windsplat::engine::kernels
