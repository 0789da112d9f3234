// Part of the kernel body: the cell that a stop stands for, from grid strides to the world and
// back.
#pragma once

#include "server/engine/kernels/body_stops.hpp"

namespace windsplat::engine::kernels {
namespace {

// world = sum over axes a of edge[a] * grid[a]; grid[a] = inverse[a] . world. A rectilinear lattice
// uses the diagonals alone.
struct Cells {
  float edge[3][3][brick_stops];     // [axis][world component]
  float inverse[3][3][brick_stops];  // [axis][world component]
  float from_eye[3][brick_stops];    // of the stop, world units
  int solid[brick_stops];            // of a curved lattice: 0 if the cell spans no volume
};

template <bool Curved>
inline void to_world(const Cells& cells, int l, const float grid[3], float world[3]) {
  for (int c = 0; c < 3; ++c) {
    if (Curved) {
      world[c] = cells.edge[0][c][l] * grid[0] + cells.edge[1][c][l] * grid[1] +
                 cells.edge[2][c][l] * grid[2];
    } else {
      world[c] = cells.edge[c][c][l] * grid[c];
    }
  }
}

template <bool Curved>
inline void to_grid(const Cells& cells, int l, const float world[3], float grid[3]) {
  for (int a = 0; a < 3; ++a) {
    if (Curved) {
      grid[a] = cells.inverse[a][0][l] * world[0] + cells.inverse[a][1][l] * world[1] +
                cells.inverse[a][2][l] * world[2];
    } else {
      grid[a] = cells.inverse[a][a][l] * world[a];
    }
  }
}

inline void cross3(const float a[3], const float b[3], float out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

inline float dot3(const float a[3], const float b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline float dot3(const float a[3], float x, float y, float z) {
  return a[0] * x + a[1] * y + a[2] * z;
}

// The edge of a curved cell along axis a: half the way from the sample before to the one after, at
// an end the way to the one neighbour, times the samples that the stop stands for. False along an
// axis of one sample.
inline bool edge_between(const Pass& pass, const Stops& stops, int a, int l, float edge[3]) {
  const int dim = pass.dims[a];
  if (dim == 1) return false;
  const int at = pass.axis[a].sample[stops.index[a][l]];
  const int before = at > 0 ? 1 : 0;
  const int after = at + 1 < dim ? 1 : 0;
  const float* p = pass.places + 3 * (stops.offset[l] - before * pass.step[a]);
  const float* q = pass.places + 3 * (stops.offset[l] + after * pass.step[a]);
  const float scale = static_cast<float>(pass.axis[a].group[stops.index[a][l]]) /
                      static_cast<float>(before + after);
  for (int c = 0; c < 3; ++c) edge[c] = (q[c] - p[c]) * scale;
  return true;
}

// Along an axis of one sample a cell stands at right angles to its other two edges.
inline void raise_edge(const float unbent, int a, float edge[3][3]) {
  float across[3];
  cross3(edge[(a + 1) % 3], edge[(a + 2) % 3], across);
  const float area = square_root(dot3(across, across));
  if (area <= 0) return;
  for (int c = 0; c < 3; ++c) edge[a][c] = across[c] * (unbent / area);
}

// Where neighbours meet (at a pole) a cell spans no volume, and its stop shows nothing.
inline void fill_curved_cell(const Pass& pass, const Stops& stops, int l, Cells& cells) {
  constexpr float flattest = 1e-6F;
  float edge[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  bool known[3];
  for (int a = 0; a < 3; ++a) {
    known[a] = edge_between(pass, stops, a, l, edge[a]);
    if (!known[a]) edge[a][a] = pass.axis[a].cell[stops.index[a][l]];
  }
  for (int a = 0; a < 3; ++a) {
    if (!known[a]) raise_edge(pass.axis[a].cell[stops.index[a][l]], a, edge);
  }
  float rows[3][3];
  float upright = 1;
  for (int a = 0; a < 3; ++a) {
    cross3(edge[(a + 1) % 3], edge[(a + 2) % 3], rows[a]);
    upright *= square_root(dot3(edge[a], edge[a]));
  }
  const float volume = dot3(edge[0], rows[0]);
  cells.solid[l] = absolute(volume) > flattest * upright ? 1 : 0;
  const float inverse = cells.solid[l] != 0 ? 1.0F / volume : 0.0F;
  for (int a = 0; a < 3; ++a) {
    for (int c = 0; c < 3; ++c) {
      cells.edge[a][c][l] = edge[a][c];
      cells.inverse[a][c][l] = rows[a][c] * inverse;
    }
  }
}

template <bool Curved>
void fill_cells(const Camera& camera, const Pass& pass, const Stops& stops, Cells& cells) {
  if (Curved) {
    for (int l = 0; l < stops.count; ++l) {
      const float* place = pass.places + 3 * stops.offset[l];
      for (int c = 0; c < 3; ++c) {
        cells.from_eye[c][l] = static_cast<float>(static_cast<double>(place[c]) - camera.eye[c]);
      }
      fill_curved_cell(pass, stops, l, cells);
    }
    return;
  }
  for (int a = 0; a < 3; ++a) {
    for (int l = 0; l < stops.count; ++l) {
      const float cell = pass.axis[a].cell[stops.index[a][l]];
      cells.edge[a][a][l] = cell;
      cells.inverse[a][a][l] = 1.0F / cell;
      cells.from_eye[a][l] = pass.axis[a].from_eye[stops.index[a][l]];
    }
  }
}

inline double dot3(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Camera coordinates of stops that stand where the field says.
void place_curved_stops(const Camera& camera, const Pass& pass, Stops& stops) {
  const int count = stops.count;
  for (int l = 0; l < count; ++l) {
    const float* place = pass.places + 3 * stops.offset[l];
    double at[3];
    for (int c = 0; c < 3; ++c) at[c] = static_cast<double>(place[c]) - camera.eye[c];
    const double z = dot3(camera.world_forward, at);
    stops.x[l] = static_cast<float>(dot3(camera.world_right, at));
    stops.y[l] = static_cast<float>(dot3(camera.world_down, at));
    stops.z[l] = static_cast<float>(z);
    stops.depth[l] = static_cast<float>(z - camera.depth_origin);
  }
}

// Stops without a cell have neither line nor splat.
template <bool Lines, bool Medium>
void drop_flat_cells(const Stops& stops, const Cells& cells, Winds& winds, Densities& densities) {
  for (int l = 0; l < stops.count; ++l) {
    if (cells.solid[l] != 0) continue;
    if (Lines) winds.magnitude[l] = -1;
    if (Medium) densities.rho[l] = 0;
  }
}

// Directions along a curved cell's own east, north and up become the world's, of the same length:
// of a slice's, what lies in its plane.
void bend_winds(const Pass& pass, const Stops& stops, const Cells& cells, Winds& winds) {
  for (int l = 0; l < stops.count; ++l) {
    float world[3] = {0, 0, 0};
    float kept2 = 0;
    for (int a = 0; a < 3; ++a) {
      const float edge[3] = {cells.edge[a][0][l], cells.edge[a][1][l], cells.edge[a][2][l]};
      const float kept = winds.direction[a][l] * pass.line.keep[a];
      const float scale = kept / larger(square_root(dot3(edge, edge)), 1e-30F);
      kept2 += kept * kept;
      for (int c = 0; c < 3; ++c) world[c] += edge[c] * scale;
    }
    const float unit = square_root(kept2) / larger(square_root(dot3(world, world)), 1e-30F);
    for (int c = 0; c < 3; ++c) winds.bent[c][l] = world[c] * unit;
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
