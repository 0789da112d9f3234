// Part of the kernel body: computes and culls the kernel positions of a brick, two rows at a time
// with one lane per position.
#pragma once

#include "server/engine/kernels/body_math.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine::kernels {
namespace {

// The rows of a brick run along u; two consecutive rows are a pair. Entry [axis][i] is the value of
// the axis at the i-th kernel position of the pair: brick_side values of the first row, then those
// of the second. Along u the values differ by column, along v by row; along the major axis all are
// equal. Lanes beyond the end of a row repeat its last position, and a missing second row repeats
// the first.
struct Rows {
  alignas(64) double across[3][brick_side];  // right, down, forward: contribution of u
  alignas(64) float cell[3][pair_kernels];
  alignas(64) float inverse_cell[3][pair_kernels];
  alignas(64) float from_eye[3][pair_kernels];
  alignas(64) float height[pair_kernels];
  alignas(64) std::int32_t sample[3][pair_kernels];
  std::int32_t group[3][pair_kernels];
  std::int64_t along_u[brick_side];
  std::int64_t origin;     // of the box of the brick (Pass::box_origins)
  std::int64_t offset[2];  // offset of the first sample of each row in the fields
  int u_count, v_count, pairs;
  int there;        // number of valid rows of the pair
  int first[3];     // kernel position of the brick along each axis
  int consecutive;  // rows are full, and their samples are consecutive in memory
};

// Broadcasts the values of one kernel position of an axis to the row of lanes starting at First.
template <int First>
KERNEL_INLINE void fill_row(const Pass& pass, int a, int index, Rows& rows) {
  const Axis& axis = pass.axis[a];
  const std::int32_t sample = axis.sample[index];
  const std::int32_t group = axis.group[index];
  const float cell = axis.cell[index];
  const float inverse_cell = axis.inverse_cell[index];
  const float from_eye = axis.from_eye[index];
  const float height = axis.position[index];
  constexpr int last = First + brick_side;
  for (int i = First; i < last; ++i) rows.sample[a][i] = sample;
  for (int i = First; i < last; ++i) rows.group[a][i] = group;
  for (int i = First; i < last; ++i) rows.cell[a][i] = cell;
  for (int i = First; i < last; ++i) rows.inverse_cell[a][i] = inverse_cell;
  for (int i = First; i < last; ++i) rows.from_eye[a][i] = from_eye;
  for (int i = First; a == 2 && i < last; ++i) rows.height[i] = height;
}

// Fills the values along u; index_of(i) returns the kernel position of lane i.
template <class IndexOf>
KERNEL_INLINE void fill_along(const Pass& pass, Rows& rows, const IndexOf& index_of) {
  const int a = pass.u;
  const Axis& axis = pass.axis[a];
  const auto both = [](auto* to, int i, auto value) { to[i] = to[brick_side + i] = value; };
  for (int i = 0; i < brick_side; ++i) both(rows.sample[a], i, axis.sample[index_of(i)]);
  for (int i = 0; i < brick_side; ++i) both(rows.group[a], i, axis.group[index_of(i)]);
  for (int i = 0; i < brick_side; ++i) both(rows.cell[a], i, axis.cell[index_of(i)]);
  for (int i = 0; i < brick_side; ++i)
    both(rows.inverse_cell[a], i, axis.inverse_cell[index_of(i)]);
  for (int i = 0; i < brick_side; ++i) both(rows.from_eye[a], i, axis.from_eye[index_of(i)]);
  for (int i = 0; a == 2 && i < brick_side; ++i) both(rows.height, i, axis.position[index_of(i)]);
}

// The first kernel position of a brick in world order; visit lists are ordered outward from the
// eye.
inline int lowest(const int* visit) { return visit[0] / brick_side * brick_side; }

// The origin of the fields at a kernel position, which is that of its whole brick.
inline std::int64_t origin_at(const Pass& pass, const int (&kernel)[3]) {
  if (pass.box_origins == nullptr) return pass.origin;
  std::int64_t box = 0;
  for (int a = 2; a >= 0; --a) {
    box = box * pass.box_counts[a] + kernel[a] / pass.box_kernels[a];
  }
  return pass.box_origins[box];
}

void open_rows(const Pass& pass, const Brick& brick, Rows& rows) {
  const Axis& u = pass.axis[pass.u];
  const int count = brick.u_count;
  rows.u_count = count;
  rows.v_count = brick.v_count;
  rows.pairs = (brick.v_count + 1) / 2;
  rows.first[pass.u] = lowest(u.visit + brick.u_first);
  rows.first[pass.v] = lowest(pass.axis[pass.v].visit + brick.v_first);
  rows.first[pass.major] = pass.axis[pass.major].visit[brick.sheet];
  rows.origin = origin_at(pass, rows.first);
  const int first = rows.first[pass.u];
  if (count == brick_side) {
    fill_along(pass, rows, [first](int i) { return first + i; });
  } else {
    fill_along(pass, rows, [&](int i) { return first + (i < count ? i : count - 1); });
  }
  fill_row<0>(pass, pass.major, rows.first[pass.major], rows);
  fill_row<brick_side>(pass, pass.major, rows.first[pass.major], rows);
  const double* camera = u.camera + 3 * static_cast<std::ptrdiff_t>(first);
  for (int i = 0; i < brick_side; ++i) {
    const int at = 3 * (i < count ? i : count - 1);
    for (int c = 0; c < 3; ++c) rows.across[c][i] = camera[at + c];
  }
  const std::int64_t step = pass.step[pass.u];
  const int* index = u.field_index + first;
  for (int i = 0; i < brick_side; ++i) {
    rows.along_u[i] = step * (index[i < count ? i : count - 1] - index[0]);
  }
  const bool full = count == brick_side;
  rows.consecutive = full && rows.along_u[brick_side - 1] == brick_side - 1 ? 1 : 0;
}

// The second row of a pair, or the first if that is the last row of the brick.
inline int second_row(const Rows& rows, int pair) {
  return 2 * pair + 1 < rows.v_count ? 2 * pair + 1 : 2 * pair;
}

void set_pair(const Pass& pass, int pair, Rows& rows) {
  const int second = second_row(rows, pair);
  fill_row<0>(pass, pass.v, rows.first[pass.v] + 2 * pair, rows);
  fill_row<brick_side>(pass, pass.v, rows.first[pass.v] + second, rows);
  rows.there = second - 2 * pair + 1;
  const auto along = [&](int a, int index) {
    return pass.step[a] * pass.axis[a].field_index[index];
  };
  const std::int64_t first =
      rows.origin + along(pass.major, rows.first[pass.major]) + along(pass.u, rows.first[pass.u]);
  rows.offset[0] = first + along(pass.v, rows.first[pass.v] + 2 * pair);
  rows.offset[1] = first + along(pass.v, rows.first[pass.v] + second);
}

// Offset of the i-th sample of a pair in the fields.
inline std::int64_t offset_of(const Rows& rows, int i) {
  return rows.offset[i / brick_side] + rows.along_u[i % brick_side];
}

// Camera coordinates of row j, stored as row `to_row`. Summed in double, so that a distant eye
// costs no precision.
void place_row(const Camera& camera, const Pass& pass, int j, int to_row, const Rows& rows,
               KernelPositions& positions) {
  const double* from_sheet =
      pass.axis[pass.major].camera + 3 * static_cast<std::ptrdiff_t>(rows.first[pass.major]);
  const double* from_v =
      pass.axis[pass.v].camera + 3 * static_cast<std::ptrdiff_t>(rows.first[pass.v] + j);
  const std::ptrdiff_t row = std::ptrdiff_t{brick_side} * to_row;
  float* const to[3] = {positions.x + row, positions.y + row, positions.z + row};
  for (int c = 0; c < 3; ++c) {
    const double base = from_sheet[c] + from_v[c];
    for (int i = 0; i < brick_side; ++i) to[c][i] = static_cast<float>(base + rows.across[c][i]);
  }
  if (pass.by_depth == 0) return;
  const double middle = from_sheet[2] + from_v[2] - camera.depth_origin;
  for (int i = 0; i < brick_side; ++i) {
    positions.depth[row + i] = static_cast<float>(middle + rows.across[2][i]);
  }
}

void place_pair(const Camera& camera, const Pass& pass, int pair, const Rows& rows,
                KernelPositions& positions) {
  place_row(camera, pass, 2 * pair, 2 * pair, rows, positions);
  place_row(camera, pass, second_row(rows, pair), 2 * pair + 1, rows, positions);
}

inline double dot3(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The same for a curved lattice, whose positions are stored by sample; of a chain, the middle of
// each segment.
void place_curved_pair(const Camera& camera, const Pass& pass, int pair, const Rows& rows,
                       KernelPositions& positions) {
  for (int i = 0; i < pair_kernels; ++i) {
    const float* position = pass.places + 3 * offset_of(rows, i);
    double at[3];
    for (int c = 0; c < 3; ++c) at[c] = static_cast<double>(position[c]) - camera.eye[c];
    if (pass.line.chains.q != nullptr) {
      for (int c = 0; c < 3; ++c) {
        at[c] += 0.5 * (static_cast<double>(position[3 + c]) - static_cast<double>(position[c]));
      }
    }
    const double z = dot3(camera.world_forward, at);
    const int l = pair_kernels * pair + i;
    positions.x[l] = static_cast<float>(dot3(camera.world_right, at));
    positions.y[l] = static_cast<float>(dot3(camera.world_down, at));
    positions.z[l] = static_cast<float>(z);
    positions.depth[l] = static_cast<float>(z - camera.depth_origin);
  }
}

// Values at the samples of a pair of consecutive rows, starting at lane i.
KERNEL_INLINE Kernel fetch_consecutive(const float* values, const Rows& rows, int i) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (kernel_lanes == pair_kernels) {
    const hn::Half<KernelTag> half;
    return hn::Combine(KernelTag(), hn::LoadU(half, values + rows.offset[1]),
                       hn::LoadU(half, values + rows.offset[0]));
  }
#endif
  return load_unaligned<Kernel>(values + rows.offset[i / brick_side] + i % brick_side);
}

// Values of a field at the kernel positions of a pair, starting at lane i.
KERNEL_INLINE Kernel fetch(const float* values, const Rows& rows, int i) {
  if (rows.consecutive != 0) return fetch_consecutive(values, rows, i);
  alignas(64) float lanes[pair_kernels];
  for (int k = 0; k < pair_kernels; ++k) lanes[k] = values[offset_of(rows, k)];
  return load<Kernel>(lanes + i);
}

// The valid positions of a row and of a pair.
inline std::uint32_t row_bits(const Rows& rows) { return (2U << (rows.u_count - 1)) - 1U; }
inline std::uint32_t pair_bits(const Rows& rows) {
  return rows.there == 2 ? row_bits(rows) | row_bits(rows) << brick_side : row_bits(rows);
}

// Extent of the kernels of a brick beyond their positions along right, down and forward.
void brick_reach(const Camera& camera, const Pass& pass, const Brick& brick, const Rows& rows,
                 float reach[3]) {
  float cell[3];
  const auto widest = [&](int a, int first, int count) {
    const hn::CappedTag<float, brick_side> tag;
    const float* cells = pass.axis[a].cell + first;
    auto most = hn::Set(tag, cells[0]);
    if (count == brick_side) {
      for (std::size_t i = 0; i < brick_side; i += hn::MaxLanes(tag)) {
        most = hn::Max(most, hn::LoadU(tag, cells + i));
      }
    } else {
      for (int i = 1; i < count; ++i) most = hn::Max(most, hn::Set(tag, cells[i]));
    }
    cell[a] = hn::GetLane(hn::MaxOfLanes(tag, most));
  };
  cell[pass.major] = pass.axis[pass.major].cell[rows.first[pass.major]];
  widest(pass.u, rows.first[pass.u], brick.u_count);
  widest(pass.v, rows.first[pass.v], brick.v_count);
  if (pass.places != nullptr) {
    for (int c = 0; c < 3; ++c) cell[c] = pass.cell_max[c];
  }
  const float* const frame[3] = {camera.right, camera.down, camera.forward};
  for (int c = 0; c < 3; ++c) {
    float box = 0;    // half the kernel box along this camera axis
    float shift = 0;  // offset of its centre
    float square = 0;
    for (int a = 0; a < 3; ++a) {
      box += pass.line.half_box[a] * absolute(frame[c][a]) * cell[a];
      shift += pass.line.shift[a] * absolute(frame[c][a]) * cell[a];
      square += frame[c][a] * frame[c][a] * cell[a] * cell[a];
    }
    const float line = smaller(brick.line_reach, box) + shift;
    if (pass.places != nullptr) square *= 3.0F;
    const float splat = brick.splats != 0 ? footprint_t * square_root(square) : 0.0F;
    reach[c] = larger(brick.lines != 0 ? line : 0.0F, splat) * 1.00001F;
  }
}

// Planes through the edges of the tile, moved outward by the extent of a kernel.
struct Frustum {
  float x0, x1, y0, y1;  // edges of the tile at unit depth, widened by `margin` pixels
  float left, right, top, bottom;
  float reach[3];
  float margin;
};

template <bool Perspective>
Frustum frustum_of(const Camera& camera, const Tile& tile, const float reach[3], float margin) {
  Frustum f = {};
  f.x0 = (static_cast<float>(tile.x) - margin - camera.half_width_px) * camera.pixel;
  f.x1 = (static_cast<float>(tile.x + tile.width) + margin - camera.half_width_px) * camera.pixel;
  f.y0 = (static_cast<float>(tile.y) - margin - camera.half_height_px) * camera.pixel;
  f.y1 = (static_cast<float>(tile.y + tile.height) + margin - camera.half_height_px) * camera.pixel;
  const float rz = Perspective ? reach[2] : 0.0F;
  f.left = reach[0] + absolute(f.x0) * rz;
  f.right = reach[0] + absolute(f.x1) * rz;
  f.top = reach[1] + absolute(f.y0) * rz;
  f.bottom = reach[1] + absolute(f.y1) * rz;
  for (int c = 0; c < 3; ++c) f.reach[c] = reach[c];
  f.margin = margin;
  return f;
}

// The positions of a pair whose kernels may reach beyond the near plane and touch the tile.
template <bool Perspective>
std::uint32_t seen_in_pair(const Camera& camera, const Frustum& f, const KernelPositions& positions,
                           int pair) {
  std::uint32_t bits = 0;
  for (int i = 0; i < pair_kernels; i += kernel_lanes) {
    const int l = pair_kernels * pair + i;
    const Kernel x = load<Kernel>(positions.x + l);
    const Kernel y = load<Kernel>(positions.y + l);
    const Kernel depth = load<Kernel>(positions.z + l);
    const Kernel z = Perspective ? depth : all<Kernel>(1.0F);
    // Largest distance outside any plane.
    Kernel outside = hn::MulSub(all<Kernel>(f.x0), z, x) - all<Kernel>(f.left);
    outside = hn::Max(outside, hn::NegMulAdd(all<Kernel>(f.x1), z, x) - all<Kernel>(f.right));
    outside = hn::Max(outside, hn::MulSub(all<Kernel>(f.y0), z, y) - all<Kernel>(f.top));
    outside = hn::Max(outside, hn::NegMulAdd(all<Kernel>(f.y1), z, y) - all<Kernel>(f.bottom));
    auto inside = hn::Le(outside, hn::Zero(KernelTag()));
    if (Perspective) inside = hn::And(inside, hn::Ge(z, all<Kernel>(camera.near - f.reach[2])));
    bits |= bits_of<Kernel>(inside) << static_cast<unsigned>(i);
  }
  return bits;
}

// First and last block of a row or column; none if last < first.
struct Range {
  int first, last;
};

using KernelIntegers = hn::RebindToSigned<KernelTag>;
using KernelInteger = hn::Vec<KernelIntegers>;

// The same with one lane per outline.
struct Ranges {
  KernelInteger first, last;
};

// Blocks of the tile with pixel centres between two coordinates in pixels from the edge of the
// tile. Block b has the centres 4 b + 0.5 to 4 b + 3.5.
KERNEL_INLINE Ranges blocks_between(Kernel low, Kernel high, int blocks) {
  constexpr float per_block = 1.0F / block_side;
  constexpr float slack = 1e-3F;
  const float bound = static_cast<float>(blocks);
  // Truncation rounds down because the values are not negative.
  const Kernel first =
      clamped((low + all<Kernel>(0.5F - slack)) * all<Kernel>(per_block), 0.0F, bound);
  const Kernel last =
      clamped((high + all<Kernel>(slack - 0.5F)) * all<Kernel>(per_block), -1.0F, bound - 0.5F);
  return {truncated(first), truncated(last + all<Kernel>(1.0F)) - hn::Set(KernelIntegers(), 1)};
}

KERNEL_INLINE void store(KernelInteger value, std::int32_t* to) {
  hn::Store(value, KernelIntegers(), to);
}

inline int blocks_of(int pixels) { return (pixels + block_side - 1) / block_side; }

inline std::uint32_t range_mask(Range range) {
  if (range.last < range.first) return 0;
  return (~std::uint32_t{0} >> static_cast<unsigned>(31 - (range.last - range.first)))
         << static_cast<unsigned>(range.first);
}

// Bounds of projected boxes about points along one axis of the screen.
struct Shadow {
  Kernel low, high;

  // Extends the bounds by a box of half width `reach` about `at`. near, far: inverse depths of its
  // ends; one of them is extreme on either side of the centre.
  KERNEL_INLINE void add(Kernel at, float reach, Kernel near, Kernel far) {
    const Kernel from = at - all<Kernel>(reach);
    const Kernel to = at + all<Kernel>(reach);
    low = hn::Min(low, hn::Min(from * near, from * far));
    high = hn::Max(high, hn::Max(to * near, to * far));
  }
};

// Blocks of the tile that a brick may touch.
struct Under {
  int first, last;  // rows
  std::uint32_t columns;
};

inline Under under(const Tile& tile, const Brick& brick) {
  const int left = tile.x / block_side;
  const int top = tile.y / block_side;
  const auto within = [](int v, int blocks) { return v < 0 ? 0 : v < blocks ? v : blocks - 1; };
  const int wide = blocks_of(tile.width);
  const int tall = blocks_of(tile.height);
  return {
      within(brick.block_y - top, tall), within(brick.block_y_last - top, tall),
      range_mask({within(brick.block_x - left, wide), within(brick.block_x_last - left, wide)})};
}

// Whether any of these blocks is closed.
inline bool partly_closed(const Tile& tile, const Brick& brick) {
  if (tile.any_closed == 0) return false;
  const Under blocks = under(tile, brick);
  std::uint32_t open = ~std::uint32_t{0};
  for (int row = blocks.first; row <= blocks.last; ++row) open &= tile.open[row];
  return (open & blocks.columns) != blocks.columns;
}

// The i-th position of the rows starting at row j, one lane per row; lanes beyond the last repeat
// it.
KERNEL_INLINE Kernel across_rows(const float* positions, int i, int j, int v_count) {
  alignas(64) float lanes[kernel_lanes];
  for (int k = 0; k < kernel_lanes; ++k) {
    lanes[k] = positions[brick_side * (j + k < v_count ? j + k : v_count - 1) + i];
  }
  return load<Kernel>(lanes);
}

// The blocks that the kernels of rows may touch, one lane per row.
struct Footprints {
  Ranges rows, columns;
};

// On straight rows the two ends bound all positions between them; on curved rows every position is
// tested. A kernel that extends beyond the near plane is unbounded on the screen.
template <bool Perspective>
KERNEL_INLINE Footprints footprints_of(const Camera& camera, const Frustum& f,
                                       const KernelPositions& positions, int j, const Rows& rows,
                                       bool straight, const Tile& tile) {
  Shadow across = {all<Kernel>(3e38F), all<Kernel>(-3e38F)};
  Shadow down = across;
  Kernel nearest = all<Kernel>(3e38F);
  const int step = straight && rows.u_count > 1 ? rows.u_count - 1 : 1;
  for (int i = 0; i < rows.u_count; i += step) {
    const Kernel z = across_rows(positions.z, i, j, rows.v_count);
    const Kernel least = all<Kernel>(camera.near);
    const Kernel one = all<Kernel>(1.0F);
    nearest = hn::Min(nearest, z);
    const Kernel reach = all<Kernel>(f.reach[2]);
    const Kernel near = Perspective ? inverse_of(hn::Max(z - reach, least)) : one;
    const Kernel far = Perspective ? inverse_of(z + reach) : one;
    across.add(across_rows(positions.x, i, j, rows.v_count), f.reach[0], near, far);
    down.add(across_rows(positions.y, i, j, rows.v_count), f.reach[1], near, far);
  }
  const Kernel scale = all<Kernel>(camera.inverse_pixel);
  const auto blocks = [&](const Shadow& shadow, float middle, int first, int pixels) {
    const float offset = middle - static_cast<float>(first);
    Kernel low = hn::MulAdd(shadow.low, scale, all<Kernel>(offset - f.margin));
    Kernel high = hn::MulAdd(shadow.high, scale, all<Kernel>(offset + f.margin));
    if (Perspective) {
      const auto endless = hn::Lt(nearest, all<Kernel>(camera.near + f.reach[2]));
      low = hn::IfThenElse(endless, all<Kernel>(-1e6F), low);
      high = hn::IfThenElse(endless, all<Kernel>(1e6F), high);
    }
    return blocks_between(low, high, blocks_of(pixels));
  };
  return {blocks(down, camera.half_height_px, tile.y, tile.height),
          blocks(across, camera.half_width_px, tile.x, tile.width)};
}

// The rows of a brick whose kernels may touch an open block, as bits.
template <bool Perspective>
std::uint32_t rows_to_see(const Camera& camera, const Frustum& f, const KernelPositions& positions,
                          const Rows& rows, bool straight, const Tile& tile) {
  std::uint32_t seen = 0;
  for (int j = 0; j < rows.v_count; j += kernel_lanes) {
    const Footprints under =
        footprints_of<Perspective>(camera, f, positions, j, rows, straight, tile);
    alignas(64) std::int32_t first[kernel_lanes], last[kernel_lanes], left[kernel_lanes],
        right[kernel_lanes];
    store(under.rows.first, first);
    store(under.rows.last, last);
    store(under.columns.first, left);
    store(under.columns.last, right);
    for (int k = 0; k < kernel_lanes && j + k < rows.v_count; ++k) {
      std::uint32_t open = 0;
      for (int row = first[k]; row <= last[k]; ++row) open |= tile.open[row];
      if ((open & range_mask({left[k], right[k]})) != 0) seen |= 1U << static_cast<unsigned>(j + k);
    }
  }
  return seen;
}

}  // namespace
}  // namespace windsplat::engine::kernels
