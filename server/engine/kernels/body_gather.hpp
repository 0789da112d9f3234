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
  bool begins, ends;  // all of the splat lies behind the first face, before the last
  bool fine;          // the slabs are thinner than its cell, or the near plane cuts it
};

// Slabs of at least 0.7 cells along the rays use the coarse partial footprints, unless the
// near plane or the body cuts the splat: what is cut off is not in another slab.
constexpr float coarse_cells2 = 0.5F;

// The squared length of a ray in cells per unit of view depth, near the centre of the splat.
template <From Start>
KERNEL_INLINE float cells2_of(const Splat& s) {
  if constexpr (Start == From::near_plane) {
    const float* d = s.near_form.ahead;
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  } else {
    return s.form.d0;
  }
}

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

constexpr int block_vectors = block_pixels / pixel_lanes;

// The rays of some blocks through a splat, one value for each pixel.
struct SplatRays {
  static constexpr int blocks_max = 16;
  static constexpr int pixels_max = blocks_max * block_pixels;

  int count = 0;  // blocks
  int row[blocks_max], column[blocks_max];
  alignas(64) float tau[pixels_max];
  alignas(64) float behind[pixels_max];
  alignas(64) float scale[pixels_max];   // half chords per unit of view depth
  alignas(64) float before[pixels_max];  // the fraction of the splat before the last face
  alignas(64) float part[pixels_max];    // optical depth within the current slab
  alignas(64) float limit[pixels_max];   // depth of the body, from the centre of the splat
  alignas(64) float term[partial_terms][pixels_max];
};

template <bool Perspective, From Start, class Lanes>
KERNEL_INLINE void find_rays(const Lanes& s, bool fine, const Tile& tile, SplatRays& rays) {
  for (int b = 0; b < rays.count; ++b) {
    const int row = rays.row[b];
    const int column = rays.column[b];
    const float* ray = Perspective ? rays_at(tile, row, column) : nullptr;
    for (int l = 0; l < block_pixels; l += pixel_lanes) {
      const int at = b * block_pixels + l;
      const Pixel px = all<Pixel>(left_of(tile, column)) + load<Pixel>(lane_x + l);
      const Pixel py = all<Pixel>(top_of(tile, row)) + load<Pixel>(lane_y + l);
      const Pixel length = Perspective ? load<Pixel>(ray + l) : all<Pixel>(1.0F);
      const SplatLane lane = splat_lane<Perspective, Start>(s, px, py, length);
      store(lane.tau, rays.tau + at);
      store(lane.behind, rays.behind + at);
      store(lane.cells * inverse_half_chord(lane.r2), rays.scale + at);
      if (fine) {
        const PartialTerms terms = partial_terms_at(lane.r2);
        for (int k = 0; k < partial_terms; ++k) store(terms.q[k], rays.term[k] + at);
      } else {
        store(partial_coarse_term_at(lane.r2), rays.term[0] + at);
      }
    }
  }
}

// The fraction of the splat before a face, for the vector of pixels `at`.
template <bool Fine, bool Limited>
KERNEL_INLINE Pixel fraction_at(const SplatRays& rays, float face, int at) {
  Pixel depth = all<Pixel>(face);
  if (Limited) depth = hn::Min(depth, load<Pixel>(rays.limit + at));
  const Pixel half_chords =
      clamped((depth - load<Pixel>(rays.behind + at)) * load<Pixel>(rays.scale + at), -1.0F, 1.0F);
  if (!Fine) return partial_coarse_at(load<Pixel>(rays.term[0] + at), half_chords);
  PartialTerms terms;
  for (int k = 0; k < partial_terms; ++k) terms.q[k] = load<Pixel>(rays.term[k] + at);
  return partial_at(terms, half_chords);
}

// Finds the optical depths between the last face and the one at `face`; whole: the splat ends
// before it. Returns which blocks have any.
template <bool Fine, bool Limited>
KERNEL_INLINE std::uint32_t find_parts(SplatRays& rays, float face, bool whole) {
  std::uint32_t found = 0;
  for (int b = 0; b < rays.count; ++b) {
    Pixel most = hn::Zero(PixelTag());
    for (int l = 0; l < block_pixels; l += pixel_lanes) {
      const int at = b * block_pixels + l;
      const Pixel after = whole ? all<Pixel>(1.0F) : fraction_at<Fine, Limited>(rays, face, at);
      // Rounded, it may fall.
      const Pixel fraction = hn::Max(after - load<Pixel>(rays.before + at), hn::Zero(PixelTag()));
      const Pixel part = load<Pixel>(rays.tau + at) * fraction;
      store(after, rays.before + at);
      store(part, rays.part + at);
      most = hn::Max(most, part);
    }
    const bool any = !hn::AllFalse(PixelTag(), hn::Gt(most, hn::Zero(PixelTag())));
    found |= static_cast<std::uint32_t>(any) << static_cast<unsigned>(b);
  }
  return found;
}

// Adds the parts of the splat in each slab to the blocks of `rays`. Returns the number of blocks
// of slabs changed. Limited: without the part behind the body.
template <bool Fine, bool Limited, class Lanes>
KERNEL_INLINE int gather_rays(const Lanes& s, const Faces& faces, SplatRays& rays) {
  int changed = 0;
  for (int at = 0; at < rays.count * block_pixels; at += pixel_lanes) {
    store(
        faces.begins ? hn::Zero(PixelTag()) : fraction_at<Fine, Limited>(rays, faces.depth[0], at),
        rays.before + at);
  }
  for (int n = 0; n < faces.count; ++n) {
    const bool whole = n + 1 == faces.count && faces.ends && !Limited;
    std::uint32_t found = find_parts<Fine, Limited>(rays, faces.depth[n + 1], whole);
    changed += __builtin_popcount(found);
    for (; found != 0; found &= found - 1U) {
      const int b = __builtin_ctz(found);
      float* block = touch(*faces.slab[n], rays.row[b], rays.column[b]);
      for (int l = 0; l < block_pixels; l += pixel_lanes) {
        float* gathered = block + l;
        const Pixel part = load<Pixel>(&rays.part[b * block_pixels + l]);
        add_to(gathered, part);
        for (int c = 0; c < 3; ++c) {
          add_product(gathered + static_cast<std::ptrdiff_t>(1 + c) * block_pixels, part,
                      s.color[c]);
        }
      }
    }
  }
  return changed;
}

// Body: the tile sees the body.
template <bool Perspective, From Start, bool Body, class Lanes>
KERNEL_INLINE void gather_blocks(const Lanes& s, const SplatRecord& record, const Faces& faces,
                                 SplatRays& rays, Tile& tile) {
  bool limited = false;
  if (Body) {
    for (int b = 0; b < rays.count; ++b) {
      const bool here = is_limited(record, tile, rays.row[b], rays.column[b]);
      const BodyBlock& body = tile.body->blocks[rays.row[b] * tile_blocks + rays.column[b]];
      for (int l = 0; l < block_pixels; l += pixel_lanes) {
        const Pixel depth = here ? body_limit(body, l) : all<Pixel>(body_nowhere);
        store(depth - all<Pixel>(record.middle), &rays.limit[b * block_pixels + l]);
      }
      limited = limited || here;
    }
  }
  const bool fine = faces.fine || limited;
  find_rays<Perspective, Start>(s, fine, tile, rays);
  int changed = 0;
  if (limited) {
    changed = gather_rays<true, true>(s, faces, rays);
  } else {
    changed =
        fine ? gather_rays<true, false>(s, faces, rays) : gather_rays<false, false>(s, faces, rays);
  }
  tile.counters.pixel_updates += std::int64_t{changed} * block_pixels;
  rays.count = 0;
}

// The part before the near plane is ignored.
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
  const float thickness = slabs[0].back - slabs[0].front;
  faces.fine = thickness * thickness * cells2_of<Start>(record.splat) < coarse_cells2 ||
               (Perspective && near > record.first);
  faces.begins = faces.depth[0] <= record.first - record.middle;
  faces.ends = faces.depth[faces.count] >= record.last - record.middle;
  const std::uint32_t columns = range_mask({record.column_first, record.column_last});
  const bool windowed = record.row_last - record.row_first < window_side &&
                        record.column_last - record.column_first < window_side;
  const std::uint64_t window = joined(record.window_high, record.window_low);
  const auto lanes = spread_from<Start>(record.splat);
  SplatRays rays;
  for (int row = record.row_first; row <= record.row_last; ++row) {
    const auto k = static_cast<unsigned>(row - record.row_first);
    const std::uint32_t touched =
        windowed ? static_cast<std::uint32_t>(window >> window_side * k & 0xFFU)
                       << static_cast<unsigned>(record.column_first)
                 : columns;
    for (std::uint32_t left = touched & tile.open[row]; left != 0; left &= left - 1U) {
      rays.row[rays.count] = row;
      rays.column[rays.count] = __builtin_ctz(left);
      if (++rays.count < SplatRays::blocks_max) continue;
      gather_blocks<Perspective, Start, Body>(lanes, record, faces, rays, tile);
    }
  }
  if (rays.count > 0) gather_blocks<Perspective, Start, Body>(lanes, record, faces, rays, tile);
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
    out[n++] = {middle - half,
                middle + half,
                middle,
                splat_at<Perspective>(p, l),
                static_cast<std::int16_t>(f.row_first[l]),
                static_cast<std::int16_t>(f.row_last[l]),
                static_cast<std::int16_t>(f.column_first[l]),
                static_cast<std::int16_t>(f.column_last[l]),
                f.splat_low[l],
                f.splat_high[l],
                Perspective && has(p.splats.near, l) ? 1 : 0};
  }
  return n;
}

int pack_splats(const Camera& camera, const Prepared& p, SplatRecord* out) {
  return camera.perspective != 0 ? pack_splats_on<true>(p, out) : pack_splats_on<false>(p, out);
}

}  // namespace
}  // namespace windsplat::engine::kernels
