// Part of the kernel body: accumulation of splats into slabs of view depth, for the slab method.
#pragma once

#include "server/engine/kernels/body_draw.hpp"

namespace windsplat::engine::kernels {
namespace {

// The accumulated medium of the block, cleared at its first use in this slab.
KERNEL_INLINE float* touch(Slab& slab, int row, int column) {
  float* at =
      slab.gathered + static_cast<std::ptrdiff_t>(row * tile_blocks + column) * gathered_floats;
  const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(column);
  if ((slab.touched[row] & bit) == 0) {
    slab.touched[row] |= bit;
    for (int i = 0; i < gathered_floats; i += pixel_lanes) store(hn::Zero(PixelTag()), at + i);
  }
  return at;
}

// The faces of the slabs in reach, with depths relative to the centre of the splat.
struct Faces {
  int count;                     // slabs
  float depth[slabs_ahead + 1];  // their faces, front to back
  Slab* slab[slabs_ahead];
};

// Depth at which the medium ends for pixels that the body covers entirely. Others see the medium
// behind it, too: there the slab in which the body lies counts as homogeneous.
KERNEL_INLINE Pixel body_limit(const BodyBlock& body, int l) {
  const auto covered = hn::Ge(load<Pixel>(body.opacity + l), all<Pixel>(1.0F));
  return hn::IfThenElse(covered, load<Pixel>(body.depth + l), all<Pixel>(body_nowhere));
}

// Whether the body may hide a part of a splat in a block.
inline bool is_limited(const SplatRecord& record, const Tile& tile, int row, int column) {
  const bool seen = (tile.body->seen[row] >> static_cast<unsigned>(column) & 1U) != 0;
  return seen && record.last > tile.body->blocks[row * tile_blocks + column].nearest;
}

// Adds the part of the splat in each slab to one block. Returns the number of slabs changed.
// Limited: without the part behind the body; `middle` is the depth of the splat.
template <bool Perspective, From Start, bool Limited, class Lanes>
KERNEL_INLINE int gather_block(const Lanes& s, const std::int32_t* HWY_RESTRICT partial,
                               const Faces& faces, float middle, const Tile& tile, int row,
                               int column) {
  constexpr float t2 = footprint_t * footprint_t;
  const float* ray = Perspective ? rays_at(tile, row, column) : nullptr;
  std::uint32_t changed = 0;
  for (int l = 0; l < block_pixels; l += pixel_lanes) {
    const Pixel px = all<Pixel>(left_of(tile, column)) + load<Pixel>(lane_x + l);
    const Pixel py = all<Pixel>(top_of(tile, row)) + load<Pixel>(lane_y + l);
    const Pixel length = Perspective ? load<Pixel>(ray + l) : all<Pixel>(1.0F);
    const SplatLane lane = splat_lane<Perspective, Start>(s, px, py, length);
    if (hn::AllFalse(PixelTag(), hn::Lt(lane.r2, all<Pixel>(t2)))) continue;
    // Half the chord in cells; converts the depths of faces to half chords from the middle.
    const Pixel scale = lane.cells / half_chord(lane.r2);
    const Pixel whole = lane.tau * all<Pixel>(1.0F / partial_one);
    const PartialRows rows = partial_rows_at(lane.r2);
    const auto at_face = [&](int n) {
      Pixel depth = all<Pixel>(faces.depth[n]);
      if (Limited) {
        const BodyBlock& body = tile.body->blocks[row * tile_blocks + column];
        depth = hn::Min(depth, body_limit(body, l) - all<Pixel>(middle));
      }
      return clamped((depth - lane.behind) * scale, -1.0F, 1.0F);
    };
    Pixel before = partial_at(partial, rows, at_face(0));
    for (int n = 0; n < faces.count; ++n) {
      const Pixel after = partial_at(partial, rows, at_face(n + 1));
      const Pixel tau = whole * hn::Max(after - before, hn::Zero(PixelTag()));
      before = after;
      if (hn::AllFalse(PixelTag(), hn::Gt(tau, hn::Zero(PixelTag())))) continue;
      changed |= std::uint32_t{1} << static_cast<unsigned>(n);
      float* gathered = touch(*faces.slab[n], row, column) + l;
      add_to(gathered, tau);
      for (int c = 0; c < 3; ++c)
        add_product(gathered + static_cast<std::ptrdiff_t>(1 + c) * block_pixels, tau, s.color[c]);
    }
  }
  return __builtin_popcount(changed);
}

// The part before the near plane is ignored. Body: the tile sees the body.
template <bool Perspective, From Start, bool Body>
void gather_on(const Camera& camera, const SplatRecord& record, Slab* slabs, int first,
               Tile& tile) {
  const auto near = static_cast<float>(static_cast<double>(camera.near) - camera.depth_origin);
  const auto depth_of = [&](float face) {
    return (Perspective ? larger(face, near) : face) - record.middle;
  };
  Faces faces;
  faces.count = 0;
  for (int n = 0; n < slabs_ahead; ++n) {
    Slab& slab = slabs[(first + n) % slabs_ahead];
    if (record.last <= slab.front) break;
    faces.depth[n] = depth_of(slab.front);
    faces.depth[n + 1] = depth_of(slab.back);
    faces.slab[faces.count++] = &slab;
  }
  if (faces.count == 0 || record.last - record.middle <= faces.depth[0]) return;
  const std::uint32_t columns = range_mask({record.column_first, record.column_last});
  const auto lanes = spread_from<Start>(record.splat, record.partial);
  for (int row = record.row_first; row <= record.row_last; ++row) {
    std::uint32_t left = columns & tile.open[row];
    while (left != 0) {
      const int column = __builtin_ctz(left);
      left &= left - 1U;
      const int changed = Body && is_limited(record, tile, row, column)
                              ? gather_block<Perspective, Start, true>(
                                    lanes, record.partial, faces, record.middle, tile, row, column)
                              : gather_block<Perspective, Start, false>(
                                    lanes, record.partial, faces, record.middle, tile, row, column);
      tile.counters.pixel_updates += std::int64_t{changed} * block_pixels;
    }
  }
}

template <bool Perspective, From Start>
void gather_from(const Camera& camera, const SplatRecord& record, Slab* slabs, int first,
                 Tile& tile) {
  if (tile.body != nullptr) {
    gather_on<Perspective, Start, true>(camera, record, slabs, first, tile);
  } else {
    gather_on<Perspective, Start, false>(camera, record, slabs, first, tile);
  }
}

void gather(const Camera& camera, const SplatRecord& record, Slab* slabs, int first, Tile& tile) {
  if (camera.perspective == 0) {
    gather_from<false, From::eye>(camera, record, slabs, first, tile);
  } else if (record.near != 0) {
    gather_from<true, From::near_plane>(camera, record, slabs, first, tile);
  } else {
    gather_from<true, From::eye>(camera, record, slabs, first, tile);
  }
}

template <bool Perspective>
int pack_splats_on(const Prepared& p, SplatRecord* out) {
  const Footing& f = p.footing;
  int n = 0;
  for (std::uint64_t left = p.positions.splats; left != 0; left &= left - 1U) {
    const int l = __builtin_ctzll(left);
    const float middle = p.positions.depth[l];
    const float half = p.splats.half_depth[l];
    out[n++] = {p.pass->partial,
                middle - half,
                middle + half,
                middle,
                splat_at<Perspective>(p, l),
                static_cast<std::int16_t>(f.row_first[l]),
                static_cast<std::int16_t>(f.row_last[l]),
                static_cast<std::int16_t>(f.column_first[l]),
                static_cast<std::int16_t>(f.column_last[l]),
                Perspective && has(p.splats.near, l) ? 1 : 0};
  }
  return n;
}

int pack_splats(const Camera& camera, const Prepared& p, SplatRecord* out) {
  return camera.perspective != 0 ? pack_splats_on<true>(p, out) : pack_splats_on<false>(p, out);
}

}  // namespace
}  // namespace windsplat::engine::kernels
