// Part of the kernel body: the cells of kernel positions, with transforms between grid and world.
#pragma once

#include "server/engine/kernels/body_fields.hpp"

namespace windsplat::engine::kernels {
namespace {

// The cells of a pair of rows of a curved lattice: world = sum over axes a of edge[a] * grid[a];
// grid[a] = inverse[a] . world. Indices: axis, world component, lane.
struct Cells {
  alignas(64) float edge[3][3][pair_kernels];
  alignas(64) float inverse[3][3][pair_kernels];
  alignas(64) float from_eye[3][pair_kernels];  // kernel position, world units
  std::uint32_t solid;                          // bit clear: the cell has no volume
};

inline void cross3(const float a[3], const float b[3], float out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

inline float dot3(const float a[3], const float b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The edge of a curved cell along axis a: half the vector from the previous sample to the next (at
// an end of an axis that does not close, the vector to the only neighbour), times the number of
// samples that the position represents. Returns false for an axis of one sample.
inline bool edge_between(const Pass& pass, const Rows& rows, int a, int i, float edge[3]) {
  const int dim = pass.dims[a];
  if (dim == 1) return false;
  const int at = rows.sample[a][i];
  int before = at > 0 ? at - 1 : at;
  int after = at + 1 < dim ? at + 1 : at;
  int steps = after - before;
  if (a == 0 && pass.around > 0) {
    before = (at + pass.around - 1) % pass.around;
    after = (at + 1) % pass.around;
    steps = 2;
  }
  const std::int64_t offset = offset_of(rows, i);
  const float* p = pass.places + 3 * (offset + (before - at) * pass.step[a]);
  const float* q = pass.places + 3 * (offset + (after - at) * pass.step[a]);
  const float scale = static_cast<float>(rows.group[a][i]) / static_cast<float>(steps);
  for (int c = 0; c < 3; ++c) edge[c] = (q[c] - p[c]) * scale;
  return true;
}

// Along an axis of one sample the edge is perpendicular to the other two.
inline void raise_edge(const float unbent, int a, float edge[3][3]) {
  float across[3];
  cross3(edge[(a + 1) % 3], edge[(a + 2) % 3], across);
  const float area = square_root(dot3(across, across));
  if (area <= 0) return;
  for (int c = 0; c < 3; ++c) edge[a][c] = across[c] * (unbent / area);
}

// Where neighbours coincide (at a pole) the cell has no volume, and its kernel is not drawn.
inline void fill_curved_cell(const Pass& pass, const Rows& rows, int i, Cells& cells) {
  constexpr float flattest = 1e-6F;
  float edge[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  bool known[3];
  for (int a = 0; a < 3; ++a) {
    known[a] = edge_between(pass, rows, a, i, edge[a]);
    if (!known[a]) edge[a][a] = rows.cell[a][i];
  }
  for (int a = 0; a < 3; ++a) {
    if (!known[a]) raise_edge(rows.cell[a][i], a, edge);
  }
  float normals[3][3];
  float upright = 1;
  for (int a = 0; a < 3; ++a) {
    cross3(edge[(a + 1) % 3], edge[(a + 2) % 3], normals[a]);
    upright *= square_root(dot3(edge[a], edge[a]));
  }
  const float volume = dot3(edge[0], normals[0]);
  const bool solid = absolute(volume) > flattest * upright;
  if (solid) cells.solid |= 1U << static_cast<unsigned>(i);
  const float inverse = solid ? 1.0F / volume : 0.0F;
  for (int a = 0; a < 3; ++a) {
    for (int c = 0; c < 3; ++c) {
      cells.edge[a][c][i] = edge[a][c];
      cells.inverse[a][c][i] = normals[a][c] * inverse;
    }
  }
}

void fill_cells(const Camera& camera, const Pass& pass, const Rows& rows, Cells& cells) {
  cells.solid = 0;
  for (int i = 0; i < pair_kernels; ++i) {
    const float* position = pass.places + 3 * offset_of(rows, i);
    for (int c = 0; c < 3; ++c) {
      cells.from_eye[c][i] = static_cast<float>(static_cast<double>(position[c]) - camera.eye[c]);
    }
    fill_curved_cell(pass, rows, i, cells);
  }
}

// The cells of a vector of kernel positions. On a rectilinear lattice all edges are parallel to the
// world axes.
template <bool Curved>
struct CellLanes;

template <>
struct CellLanes<false> {
  Three<Kernel> edge, inverse, from_eye;

  KERNEL_INLINE CellLanes(const Rows& rows, const Cells& /*cells*/, int i)
      : edge{load<Kernel>(rows.cell[0] + i), load<Kernel>(rows.cell[1] + i),
             load<Kernel>(rows.cell[2] + i)},
        inverse{load<Kernel>(rows.inverse_cell[0] + i), load<Kernel>(rows.inverse_cell[1] + i),
                load<Kernel>(rows.inverse_cell[2] + i)},
        from_eye{load<Kernel>(rows.from_eye[0] + i), load<Kernel>(rows.from_eye[1] + i),
                 load<Kernel>(rows.from_eye[2] + i)} {}

  KERNEL_INLINE Three<Kernel> to_world(const Three<Kernel>& grid) const {
    return {edge.x * grid.x, edge.y * grid.y, edge.z * grid.z};
  }
  KERNEL_INLINE Three<Kernel> to_grid(const Three<Kernel>& world) const {
    return {inverse.x * world.x, inverse.y * world.y, inverse.z * world.z};
  }
  KERNEL_INLINE Three<Kernel> to_grid(const float world[3]) const {
    return {inverse.x * all<Kernel>(world[0]), inverse.y * all<Kernel>(world[1]),
            inverse.z * all<Kernel>(world[2])};
  }
  // Component of the edge along axis a in a world direction.
  KERNEL_INLINE Kernel edge_along(int a, const float direction[3]) const {
    const Kernel& width = a == 0 ? edge.x : a == 1 ? edge.y : edge.z;
    return width * all<Kernel>(direction[a]);
  }
  KERNEL_INLINE Kernel edges2() const { return kernels::dot3(edge, edge); }
};

template <>
struct CellLanes<true> {
  Three<Kernel> edge[3];
  Three<Kernel> inverse[3];
  Three<Kernel> from_eye;

  KERNEL_INLINE CellLanes(const Rows& /*rows*/, const Cells& cells, int i) {
    for (int a = 0; a < 3; ++a) {
      edge[a] = {load<Kernel>(cells.edge[a][0] + i), load<Kernel>(cells.edge[a][1] + i),
                 load<Kernel>(cells.edge[a][2] + i)};
      inverse[a] = {load<Kernel>(cells.inverse[a][0] + i), load<Kernel>(cells.inverse[a][1] + i),
                    load<Kernel>(cells.inverse[a][2] + i)};
    }
    from_eye = {load<Kernel>(cells.from_eye[0] + i), load<Kernel>(cells.from_eye[1] + i),
                load<Kernel>(cells.from_eye[2] + i)};
  }

  KERNEL_INLINE Three<Kernel> to_world(const Three<Kernel>& grid) const {
    const auto sum = [&](Kernel a, Kernel b, Kernel c) {
      return hn::MulAdd(c, grid.z, hn::MulAdd(b, grid.y, a * grid.x));
    };
    return {sum(edge[0].x, edge[1].x, edge[2].x), sum(edge[0].y, edge[1].y, edge[2].y),
            sum(edge[0].z, edge[1].z, edge[2].z)};
  }
  KERNEL_INLINE Three<Kernel> to_grid(const Three<Kernel>& world) const {
    return {kernels::dot3(inverse[0], world), kernels::dot3(inverse[1], world),
            kernels::dot3(inverse[2], world)};
  }
  KERNEL_INLINE Three<Kernel> to_grid(const float world[3]) const {
    return {kernels::dot3(world, inverse[0]), kernels::dot3(world, inverse[1]),
            kernels::dot3(world, inverse[2])};
  }
  KERNEL_INLINE Kernel edge_along(int a, const float direction[3]) const {
    return kernels::dot3(direction, edge[a]);
  }
  KERNEL_INLINE Kernel edges2() const {
    return kernels::dot3(edge[0], edge[0]) + kernels::dot3(edge[1], edge[1]) +
           kernels::dot3(edge[2], edge[2]);
  }
};

// Transforms directions along the edges of a curved cell to the world, keeping their lengths. For a
// slice, only the part in its plane.
KERNEL_INLINE Three<Kernel> bent_direction(const LineStyle& line, const CellLanes<true>& cells,
                                           const Three<Kernel>& direction) {
  const Kernel kept[3] = {direction.x * all<Kernel>(line.keep[0]),
                          direction.y * all<Kernel>(line.keep[1]),
                          direction.z * all<Kernel>(line.keep[2])};
  const Kernel least = all<Kernel>(1e-30F);
  const Kernel zero = hn::Zero(KernelTag());
  Three<Kernel> world = {zero, zero, zero};
  Kernel kept2 = zero;
  for (int a = 0; a < 3; ++a) {
    const Three<Kernel>& edge = cells.edge[a];
    const Kernel scale = kept[a] / hn::Max(hn::Sqrt(dot3(edge, edge)), least);
    kept2 = hn::MulAdd(kept[a], kept[a], kept2);
    world = {hn::MulAdd(edge.x, scale, world.x), hn::MulAdd(edge.y, scale, world.y),
             hn::MulAdd(edge.z, scale, world.z)};
  }
  const Kernel unit = hn::Sqrt(kept2) / hn::Max(hn::Sqrt(dot3(world, world)), least);
  return {world.x * unit, world.y * unit, world.z * unit};
}

}  // namespace
}  // namespace windsplat::engine::kernels
