// Part of the kernel body: prepares a brick for a tile. Each stage processes all rows before the
// next begins, so that a mispredicted branch of one row does not delay the others.
#pragma once

#include "server/engine/kernels/body_footing.hpp"
#include "server/engine/kernels/lines/body_chains.hpp"

namespace windsplat::engine::kernels {
namespace {

inline bool has(std::uint64_t bits, int l) { return (bits >> static_cast<unsigned>(l) & 1U) != 0; }

// The bits of the vector of kernel positions that begins at l.
inline std::uint32_t lanes_at(std::uint64_t bits, int l) {
  constexpr std::uint64_t lanes = (std::uint64_t{2} << (kernel_lanes - 1)) - 1U;
  return static_cast<std::uint32_t>(bits >> static_cast<unsigned>(l) & lanes);
}

inline std::uint32_t row_at(std::uint64_t bits, int j) {
  return static_cast<std::uint32_t>(bits >> static_cast<unsigned>(brick_side * j) & 0xffU);
}

inline std::uint32_t pair_at(std::uint64_t bits, int pair) {
  return static_cast<std::uint32_t>(bits >> static_cast<unsigned>(pair_kernels * pair) & 0xffffU);
}

// 0xff in each byte whose bit is set.
inline std::uint64_t bytes_of(std::uint32_t bits) {
  const std::uint64_t spread = (bits * std::uint64_t{0x0101010101010101U}) & 0x8040201008040201U;
  const std::uint64_t lowest = ((spread + 0x7f7f7f7f7f7f7f7fU) >> 7U) & 0x0101010101010101U;
  return lowest * 0xffU;
}

// The valid positions of a brick.
inline std::uint64_t brick_bits(const Rows& rows) {
  const std::uint64_t row = row_bits(rows);
  const std::uint64_t all = row * 0x0101010101010101U;
  return all >> static_cast<unsigned>(brick_side * (brick_side - rows.v_count));
}

// Computes the kernel positions of a brick. Returns those whose kernels may touch an open block of
// the tile.
template <bool Perspective, bool Curved>
std::uint64_t compute_positions(const Camera& camera, const Pass& pass, const Brick& brick,
                                const Frustum& frustum, Rows& rows, Tile& tile,
                                KernelPositions& positions) {
  const bool partly = partly_closed(tile, brick);
  std::uint64_t seen = 0;
  for (int pair = 0; pair < rows.pairs; ++pair) {
    if (Curved) {
      set_pair(pass, pair, rows);
      place_curved_pair(camera, pass, pair, rows, positions);
    } else {
      place_pair(camera, pass, pair, rows, positions);
    }
    const std::uint64_t bits = seen_in_pair<Perspective>(camera, frustum, positions, pair);
    seen |= bits << static_cast<unsigned>(pair_kernels * pair);
  }
  seen &= brick_bits(rows);
  if (!partly || seen == 0) return seen;
  const std::uint32_t open =
      rows_to_see<Perspective>(camera, frustum, positions, rows, !Curved, tile);
  const std::uint64_t kept = seen & bytes_of(open);
  tile.counters.occluded += __builtin_popcountll(seen & ~kept);
  return kept;
}

template <bool Lines, bool Medium, bool Perspective, bool Curved>
struct BrickMaker {
  const Camera& camera;
  const Pass& pass;
  Tile& tile;
  Prepared& out;
  Hash3<std::uint32_t> key;
  Rows rows;  // rows and cells hold one pair at a time
  Cells cells;
  Shades shades;

  BrickMaker(const Camera& of_camera, const Pass& of_pass, Tile& of_tile, Prepared& into)
      : camera(of_camera),
        pass(of_pass),
        tile(of_tile),
        out(into),
        key(hash_key(of_pass.line.seed, of_pass.line.epoch)) {
    key.x += of_pass.line.first[0];
    key.y += of_pass.line.first[1];
    key.z += of_pass.line.first[2];
  }

  // Prepares the lines of a vector of kernel positions. Returns which of `bits` have one.
  KERNEL_INLINE std::uint32_t make_lines(const CellLanes<Curved>& cell, int i, int l,
                                         std::uint32_t bits) {
    const Vectors vectors = read_vectors(pass, rows, i);
    const Kernel least = all<Kernel>(least_magnitude(pass.line));
    const std::uint32_t lines = bits & bits_of<Kernel>(hn::Ge(vectors.magnitude, least));
    if (lines == 0) return 0;
    const std::uint32_t shown =
        lines & prepare_ribbons<Perspective, Curved>(camera, pass, rows, out.positions, cell,
                                                     vectors, key, i, l, shades, out.ribbons);
    if (pass.light.lit != 0) light_lines(shown, i, l);
    return shown;
  }

  void light_lines(std::uint32_t lines, int i, int l) {
    for (; lines != 0; lines &= lines - 1U) {
      const int k = __builtin_ctz(lines);
      shades.dim[l + k] *= line_light(pass.light, offset_of(rows, i + k));
    }
  }

  KERNEL_INLINE std::uint32_t make_splats(const CellLanes<Curved>& cell, int i, int l,
                                          std::uint32_t bits) {
    const Extinctions found = read_extinctions(pass, rows, i);
    const std::uint32_t splats = bits & bits_of<Kernel>(found.kept);
    if (splats == 0) return 0;
    store(found.rho, out.densities.rho + l);
    const Outline outline =
        prepare_splats<Perspective, Curved>(camera, out.positions, cell, l, found.rho, out);
    return find_splat_blocks(outline, tile, l, splats, out.footing);
  }

  // Prepares the segments of a pair.
  void make_chain_pair(int pair, std::uint32_t bits) {
    for (int i = 0; i < pair_kernels; i += kernel_lanes) {
      const int l = pair_kernels * pair + i;
      const Vectors vectors = read_vectors(pass, rows, i);
      const Kernel least = all<Kernel>(least_magnitude(pass.line));
      const std::uint32_t here =
          lanes_at(bits, i) & bits_of<Kernel>(hn::Ge(vectors.magnitude, least));
      if (here == 0) continue;
      const std::uint64_t lines =
          here & prepare_chains<Perspective>(camera, pass, rows, out.positions, vectors, i, l,
                                             shades, out.ribbons);
      out.positions.lines |= lines << static_cast<unsigned>(l);
      if (pass.light.lit != 0) light_chains(static_cast<std::uint32_t>(lines), i, l);
    }
  }

  void light_chains(std::uint32_t lines, int i, int l) {
    for (; lines != 0; lines &= lines - 1U) {
      const int k = __builtin_ctz(lines);
      const std::uint32_t sample = pass.line.chains.sample[offset_of(rows, i + k)];
      shades.dim[l + k] *= line_light(pass.light, static_cast<std::int64_t>(sample));
    }
  }

  void make_pair(int pair, std::uint32_t bits) {
    set_pair(pass, pair, rows);
    if (Lines && Curved && pass.line.chains.q != nullptr) return make_chain_pair(pair, bits);
    if (Curved) {
      fill_cells(camera, pass, rows, cells);
      bits &= cells.solid;
    }
    for (int i = 0; i < pair_kernels; i += kernel_lanes) {
      const int l = pair_kernels * pair + i;
      const std::uint32_t here = lanes_at(bits, i);
      if (here == 0) continue;
      const CellLanes<Curved> cell(rows, cells, i);
      if (Lines) {
        const std::uint64_t lines = make_lines(cell, i, l, here);
        out.positions.lines |= lines << static_cast<unsigned>(l);
      }
      if (Medium) {
        const std::uint64_t splats = make_splats(cell, i, l, here);
        out.positions.splats |= splats << static_cast<unsigned>(l);
        if (pass.light.lit != 0) {
          color_splats<true>(splats, i, l);
        } else {
          color_splats<false>(splats, i, l);
        }
      }
    }
  }

  template <bool Lit>
  void color_splats(std::uint64_t splats, int i, int l) {
    for (; splats != 0; splats &= splats - 1U) {
      const int k = __builtin_ctzll(splats);
      const float sun = Lit ? sun_seen<Perspective>(pass.light, out.positions, l + k) : 1.0F;
      color_density<Lit>(pass, offset_of(rows, i + k), sun, out.densities.color[l + k]);
    }
  }

  void find_lines() {
    KernelInteger most = hn::Zero(KernelIntegers());
    std::uint64_t touching = 0;
    for (int l = 0; l < brick_kernels; l += kernel_lanes) {
      const std::uint32_t bits = lanes_at(out.positions.lines, l);
      if (bits == 0) continue;
      const std::uint64_t here =
          find_line_rows(pass.line, out.ribbons, tile, l, bits, most, out.footing);
      touching |= here << static_cast<unsigned>(l);
    }
    out.positions.lines = touching;
    const int rows_most = hn::GetLane(hn::MaxOfLanes(KernelIntegers(), most));
    for (int l = 0; l < brick_kernels; l += kernel_lanes) {
      if (lanes_at(touching, l) == 0) continue;
      find_line_columns(pass.line, out.ribbons, tile, l, rows_most, out.footing);
    }
    color_ribbons(pass.line, shades, touching, out.ribbons);
  }
};

// Prepares the lines and splats of a brick that may touch open blocks of the tile.
template <bool Lines, bool Medium, bool Perspective, bool Curved>
void prepare_brick(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                   Prepared& out) {
  BrickMaker<Lines, Medium, Perspective, Curved> maker(camera, pass, tile, out);
  KernelPositions& positions = out.positions;
  positions.lines = positions.splats = out.splats.near = out.splats.afar = out.footing.windowed = 0;
  out.pass = &pass;
  out.near = camera.near;
  out.middle_x = camera.half_width_px;
  out.middle_y = camera.half_height_px;
  open_rows(pass, brick, maker.rows);
  float reach[3];
  brick_reach(camera, pass, brick, maker.rows, reach);
  const Frustum frustum =
      frustum_of<Perspective>(camera, tile, reach, Lines ? pass.line.outer : 0.0F);
  const std::uint64_t seen = compute_positions<Perspective, Curved>(camera, pass, brick, frustum,
                                                                    maker.rows, tile, positions);
  maker.shades.unknown = 0;
  for (int pair = 0; pair < maker.rows.pairs; ++pair) {
    if (pair_at(seen, pair) != 0) maker.make_pair(pair, pair_at(seen, pair));
  }
  if (Lines && positions.lines != 0) maker.find_lines();
  positions.count = __builtin_popcountll(positions.lines | positions.splats);
}

template <bool Lines, bool Medium, bool Perspective>
void prepare_on(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                Prepared& out) {
  if (pass.places != nullptr) {
    prepare_brick<Lines, Medium, Perspective, true>(camera, pass, brick, tile, out);
  } else {
    prepare_brick<Lines, Medium, Perspective, false>(camera, pass, brick, tile, out);
  }
}

template <bool Perspective>
void prepare_projected(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
                       Prepared& out) {
  if (brick.lines != 0 && brick.splats != 0) {
    prepare_on<true, true, Perspective>(camera, pass, brick, tile, out);
  } else if (brick.lines != 0) {
    prepare_on<true, false, Perspective>(camera, pass, brick, tile, out);
  } else {
    prepare_on<false, true, Perspective>(camera, pass, brick, tile, out);
  }
}

void prepare(const Camera& camera, const Pass& pass, const Brick& brick, Tile& tile,
             Prepared& out) {
  if (camera.perspective != 0) {
    prepare_projected<true>(camera, pass, brick, tile, out);
  } else {
    prepare_projected<false>(camera, pass, brick, tile, out);
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
