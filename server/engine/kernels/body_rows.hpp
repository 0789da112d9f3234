// Part of the kernel body: a brick's stops row by row, one lane a stop: where they stand, and which
// of them the tile can show.
#pragma once

#include "server/engine/kernels/body_math.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine::kernels {
namespace {

// A brick's rows run along u. Each entry [axis][i] holds what the axis has at the row's i-th stop:
// along u they differ, along the others they are all the same. Lanes beyond the last stop repeat
// it.
struct Rows {
  alignas(64) double across[3][brick_side];  // right, down, forward: the part of u
  alignas(32) float cell[3][brick_side];
  alignas(32) float inverse_cell[3][brick_side];
  alignas(32) float from_eye[3][brick_side];
  alignas(32) float height[brick_side];
  alignas(32) std::int32_t sample[3][brick_side];
  std::int32_t group[3][brick_side];
  std::int64_t along_u[brick_side];
  std::int64_t offset;  // of the row's first sample in the fields
  int u_count, v_count;
  int first[3];     // of the brick's stops along each axis
  int consecutive;  // a row's samples are neighbours in memory, and there are brick_side of them
};

// What one stop of an axis has, in all lanes from `first` on.
inline void fill_axis(const Pass& pass, int a, int stop, int first, Rows& rows) {
  const Axis& axis = pass.axis[a];
  const std::int32_t sample = axis.sample[stop];
  const std::int32_t group = axis.group[stop];
  const float cell = axis.cell[stop];
  const float inverse_cell = axis.inverse_cell[stop];
  const float from_eye = axis.from_eye[stop];
  const float height = axis.position[stop];
  for (int i = first; i < brick_side; ++i) rows.sample[a][i] = sample;
  for (int i = first; i < brick_side; ++i) rows.group[a][i] = group;
  for (int i = first; i < brick_side; ++i) rows.cell[a][i] = cell;
  for (int i = first; i < brick_side; ++i) rows.inverse_cell[a][i] = inverse_cell;
  for (int i = first; i < brick_side; ++i) rows.from_eye[a][i] = from_eye;
  for (int i = first; a == 2 && i < brick_side; ++i) rows.height[i] = height;
}

// What the stops of a row have along it.
inline void fill_along(const Pass& pass, int count, Rows& rows) {
  const int a = pass.u;
  const Axis& axis = pass.axis[a];
  const int first = rows.first[a];
  for (int i = 0; i < count; ++i) rows.sample[a][i] = axis.sample[first + i];
  for (int i = 0; i < count; ++i) rows.group[a][i] = axis.group[first + i];
  for (int i = 0; i < count; ++i) rows.cell[a][i] = axis.cell[first + i];
  for (int i = 0; i < count; ++i) rows.inverse_cell[a][i] = axis.inverse_cell[first + i];
  for (int i = 0; i < count; ++i) rows.from_eye[a][i] = axis.from_eye[first + i];
  for (int i = 0; a == 2 && i < count; ++i) rows.height[i] = axis.position[first + i];
}

// Visiting lists name a brick's stops outward from the eye; its rows hold them in world order.
inline int lowest(const int* visit) { return visit[0] / brick_side * brick_side; }

void open_rows(const Pass& pass, const Brick& brick, Rows& rows) {
  const Axis& u = pass.axis[pass.u];
  const int count = brick.u_count;
  rows.u_count = count;
  rows.v_count = brick.v_count;
  rows.first[pass.u] = lowest(u.visit + brick.u_first);
  rows.first[pass.v] = lowest(pass.axis[pass.v].visit + brick.v_first);
  rows.first[pass.major] = pass.axis[pass.major].visit[brick.slab];
  const int first = rows.first[pass.u];
  if (count == brick_side) {
    fill_along(pass, brick_side, rows);
  } else {
    fill_along(pass, count, rows);
    fill_axis(pass, pass.u, first + count - 1, count, rows);
  }
  fill_axis(pass, pass.major, rows.first[pass.major], 0, rows);
  const double* camera = u.camera + 3 * static_cast<std::ptrdiff_t>(first);
  for (int i = 0; i < brick_side; ++i) {
    const int at = 3 * (i < count ? i : count - 1);
    for (int c = 0; c < 3; ++c) rows.across[c][i] = camera[at + c];
  }
  const std::int64_t step = pass.step[pass.u];
  const std::int32_t* sample = rows.sample[pass.u];
  for (int i = 0; i < brick_side; ++i) rows.along_u[i] = step * (sample[i] - sample[0]);
  const bool full = count == brick_side;
  rows.consecutive = full && rows.along_u[brick_side - 1] == brick_side - 1 ? 1 : 0;
}

void set_row(const Pass& pass, int j, Rows& rows) {
  fill_axis(pass, pass.v, rows.first[pass.v] + j, 0, rows);
  rows.offset = 0;
  for (int a = 0; a < 3; ++a) rows.offset += pass.step[a] * rows.sample[a][0];
}

// Camera coordinates, summed in double so that an eye far away or close by loses nothing.
void place_row(const Camera& camera, const Pass& pass, int j, const Rows& rows, Stops& stops) {
  const double* from_slab =
      pass.axis[pass.major].camera + 3 * static_cast<std::ptrdiff_t>(rows.first[pass.major]);
  const double* from_v =
      pass.axis[pass.v].camera + 3 * static_cast<std::ptrdiff_t>(rows.first[pass.v] + j);
  const std::ptrdiff_t row = std::ptrdiff_t{brick_side} * j;
  float* const to[3] = {stops.x + row, stops.y + row, stops.z + row};
  for (int c = 0; c < 3; ++c) {
    const double base = from_slab[c] + from_v[c];
    for (int i = 0; i < brick_side; ++i) to[c][i] = static_cast<float>(base + rows.across[c][i]);
  }
  if (pass.by_depth == 0) return;
  const double middle = from_slab[2] + from_v[2] - camera.depth_origin;
  for (int i = 0; i < brick_side; ++i) {
    stops.depth[row + i] = static_cast<float>(middle + rows.across[2][i]);
  }
}

inline double dot3(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The same for stops that stand where the field says.
void place_curved_row(const Camera& camera, const Pass& pass, int j, const Rows& rows,
                      Stops& stops) {
  for (int i = 0; i < brick_side; ++i) {
    const float* place = pass.places + 3 * (rows.offset + rows.along_u[i]);
    double at[3];
    for (int c = 0; c < 3; ++c) at[c] = static_cast<double>(place[c]) - camera.eye[c];
    const double z = dot3(camera.world_forward, at);
    const int l = brick_side * j + i;
    stops.x[l] = static_cast<float>(dot3(camera.world_right, at));
    stops.y[l] = static_cast<float>(dot3(camera.world_down, at));
    stops.z[l] = static_cast<float>(z);
    stops.depth[l] = static_cast<float>(z - camera.depth_origin);
  }
}

// A field's values at a row's stops from lane i on.
KERNEL_INLINE Stop fetch(const float* values, const Rows& rows, int i) {
  if (rows.consecutive != 0) return load_unaligned<Stop>(values + rows.offset + i);
  alignas(64) float lanes[brick_side];
  for (int k = 0; k < brick_side; ++k) lanes[k] = values[rows.offset + rows.along_u[k]];
  return load<Stop>(lanes + i);
}

// The stops of a row that are there at all.
inline std::uint32_t row_bits(const Rows& rows) { return (2U << (rows.u_count - 1)) - 1U; }

// How far a brick's kernels reach beyond their stops along right, down and forward.
void brick_reach(const Camera& camera, const Pass& pass, const Brick& brick, float reach[3]) {
  float cell[3] = {0, 0, 0};
  const auto widest = [&](int a, int first, int count) {
    for (int i = first; i < first + count; ++i) {
      cell[a] = larger(cell[a], pass.axis[a].cell[pass.axis[a].visit[i]]);
    }
  };
  widest(pass.major, brick.slab, 1);
  widest(pass.u, brick.u_first, brick.u_count);
  widest(pass.v, brick.v_first, brick.v_count);
  const float moved = 0.5F * (pass.line.jitter_center + pass.line.jitter_stride);
  if (pass.places != nullptr) {
    for (int c = 0; c < 3; ++c) cell[c] = pass.cell_max[c];
  }
  const float* const frame[3] = {camera.right, camera.down, camera.forward};
  for (int c = 0; c < 3; ++c) {
    float box = 0;    // half the kernel's, along this axis of the camera
    float shift = 0;  // of its centre
    float square = 0;
    for (int a = 0; a < 3; ++a) {
      box += pass.line.half_span * absolute(frame[c][a]) * cell[a];
      shift += moved * absolute(frame[c][a]) * cell[a];
      square += frame[c][a] * frame[c][a] * cell[a] * cell[a];
    }
    const float line = smaller(brick.line_reach, box) + shift;
    if (pass.places != nullptr) square *= 3.0F;
    const float splat = pass.has_medium != 0 ? footprint_t * square_root(square) : 0.0F;
    reach[c] = larger(pass.has_lines != 0 ? line : 0.0F, splat) * 1.00001F;
  }
}

// Planes through the tile's edges, moved outward by what a kernel reaches.
struct Frustum {
  float x0, x1, y0, y1;  // the tile's edges at unit depth, widened by `margin` pixels
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

// The stops of row j that are not nearer than the near plane and whose kernel may touch the tile.
template <bool Perspective>
std::uint32_t seen_in_row(const Camera& camera, const Frustum& f, const Stops& stops, int j) {
  std::uint32_t bits = 0;
  for (int i = 0; i < brick_side; i += stop_lanes) {
    const int l = brick_side * j + i;
    const Stop x = load<Stop>(stops.x + l);
    const Stop y = load<Stop>(stops.y + l);
    const Stop depth = load<Stop>(stops.z + l);
    const Stop z = Perspective ? depth : all<Stop>(1.0F);
    // The largest of how far it lies outside any plane.
    Stop outside = hn::MulSub(all<Stop>(f.x0), z, x) - all<Stop>(f.left);
    outside = hn::Max(outside, hn::NegMulAdd(all<Stop>(f.x1), z, x) - all<Stop>(f.right));
    outside = hn::Max(outside, hn::MulSub(all<Stop>(f.y0), z, y) - all<Stop>(f.top));
    outside = hn::Max(outside, hn::NegMulAdd(all<Stop>(f.y1), z, y) - all<Stop>(f.bottom));
    auto inside = hn::Le(outside, hn::Zero(StopTag()));
    if (Perspective) inside = hn::And(inside, hn::Ge(z, all<Stop>(camera.near)));
    bits |= bits_of<Stop>(inside) << static_cast<unsigned>(i);
  }
  return bits;
}

// First and last block of a row or column; none if last < first.
struct Range {
  int first, last;
};

// Blocks of the tile whose pixel centres may lie between two coordinates in pixels from the tile's
// edge. Block b holds the centres 4 b + 0.5 to 4 b + 3.5.
inline Range blocks_between(float low, float high, int blocks) {
  constexpr float per_block = 1.0F / block_side;
  constexpr float slack = 1e-3F;
  const float bound = static_cast<float>(blocks);
  // Truncation rounds down because nothing below zero is truncated.
  const float first = limited((low - slack + 0.5F) * per_block, 0.0F, bound);
  const float last = limited((high + slack - 0.5F) * per_block, -1.0F, bound - 0.5F);
  return {static_cast<int>(first), static_cast<int>(last + 1.0F) - 1};
}

inline int blocks_of(int pixels) { return (pixels + block_side - 1) / block_side; }

inline std::uint32_t range_mask(Range range) {
  if (range.last < range.first) return 0;
  return (~std::uint32_t{0} >> static_cast<unsigned>(31 - (range.last - range.first)))
         << static_cast<unsigned>(range.first);
}

// Where on the screen a box about one point may lie, in pixels along one axis.
struct Shadow {
  float low, high;
};

template <bool Perspective>
inline Shadow shadow_of(const Camera& camera, float at, float z, float reach, float reach_z) {
  // The nearest and farthest the kernel reaches widen it most, on either side of the middle.
  const float near = Perspective ? 1.0F / larger(z - reach_z, camera.near) : 1.0F;
  const float far = Perspective ? 1.0F / (z + reach_z) : 1.0F;
  return {smaller((at - reach) * near, (at - reach) * far) * camera.inverse_pixel,
          larger((at + reach) * near, (at + reach) * far) * camera.inverse_pixel};
}

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

// Whether any block there lets no more light through.
inline bool partly_closed(const Tile& tile, const Brick& brick) {
  if (tile.any_closed == 0) return false;
  const Under blocks = under(tile, brick);
  std::uint32_t open = ~std::uint32_t{0};
  for (int row = blocks.first; row <= blocks.last; ++row) open &= tile.open[row];
  return (open & blocks.columns) != blocks.columns;
}

// Whether any block that the row's kernels may touch still lets light through. On a straight row
// the ends reach as far as any stop between them; of a curved one every stop is asked.
template <bool Perspective>
bool row_is_open(const Camera& camera, const Frustum& f, const Stops& stops, int j, int u_count,
                 bool straight, const Tile& tile) {
  Shadow across = {3e38F, -3e38F};
  Shadow down = {3e38F, -3e38F};
  const int step = straight && u_count > 1 ? u_count - 1 : 1;
  for (int i = 0; i < u_count; i += step) {
    const int l = brick_side * j + i;
    // A kernel that reaches behind the near plane casts a shadow without an end there.
    if (Perspective && stops.z[l] - f.reach[2] < camera.near) return true;
    const Shadow x = shadow_of<Perspective>(camera, stops.x[l], stops.z[l], f.reach[0], f.reach[2]);
    const Shadow y = shadow_of<Perspective>(camera, stops.y[l], stops.z[l], f.reach[1], f.reach[2]);
    across = {smaller(across.low, x.low), larger(across.high, x.high)};
    down = {smaller(down.low, y.low), larger(down.high, y.high)};
  }
  const float left = static_cast<float>(tile.x) - camera.half_width_px;
  const float top = static_cast<float>(tile.y) - camera.half_height_px;
  const Range columns = blocks_between(across.low - left - f.margin, across.high - left + f.margin,
                                       blocks_of(tile.width));
  const Range rows =
      blocks_between(down.low - top - f.margin, down.high - top + f.margin, blocks_of(tile.height));
  std::uint32_t open = 0;
  for (int row = rows.first; row <= rows.last; ++row) open |= tile.open[row];
  return (open & range_mask(columns)) != 0;
}

}  // namespace
}  // namespace windsplat::engine::kernels
