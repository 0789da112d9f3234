// A brick made ready for one tile: its stops with what is drawn at them, as arrays of one entry a
// stop. Plain data, written and read by the kernels, kept by whoever sweeps a tile by depth.
#pragma once

#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"

namespace windsplat::engine::kernels {

// Stops of a brick in visibility order, or those of them that are left after culling.
struct Stops {
  int count;
  int index[3][brick_stops];         // along each axis, into the pass' arrays
  std::int64_t offset[brick_stops];  // of its sample in the fields
  float x[brick_stops];              // right, down and forward of the eye, world units
  float y[brick_stops];
  float z[brick_stops];
  float depth[brick_stops];  // forward of the camera's depth origin
};

// A ribbon's place along it is f in [0, 1] from its tail end to its head end, as clipped; colour,
// depth and phase are linear in f.
struct Ribbons {
  int drawn[brick_stops];
  float x[brick_stops], y[brick_stops];    // f = 0, pixels
  float ux[brick_stops], uy[brick_stops];  // from f = 0 to 1, pixels
  float inverse_u2[brick_stops];
  float w0[brick_stops];  // where along itself a line is met at its start: 0; a dot everywhere: 1/2
  float depth_ratio[brick_stops];  // view distance at f = 0 over that at f = 1
  float tail[3][brick_stops];      // colour at f = 0
  float rise[3][brick_stops];      // colour at f = 1 minus that
  float depth[brick_stops];        // view distance at f = 0 minus the kernel's centre's
  float depth_rise[brick_stops];
  float phase[brick_stops];  // q + 3/2 - phase at f = 0, in [0, 2]; only where lines move
  float phase_rise[brick_stops];
};

struct Densities {
  float rho[brick_stops];  // per world length; zero: no splat
  float color[3][brick_stops];
};

// With p = (px, py) the pixel minus the projected centre and e = (ex, ey) the pixel minus a point
// of the picture near it, the ray through the pixel is d in cells per unit of view depth, and
//   perspective   r^2 = (xx px^2 + xy px py + yy py^2) / |d|^2
//                 |d|^2 = d0 + dx ex + dy ey + bent, bent = dxx ex^2 + dxy ex ey + dyy ey^2
//                 closest to the centre at a view depth of (b0 + bx ex + by ey - z bent) / |d|^2
//                 beyond the centre's
//   orthographic  the same with the constant |d|^2 = d0 divided out of xx, xy, yy, and the closest
//                 point bx ex + by ey beyond the centre.
// The second point is the centre itself wherever that is in the picture. Centres far outside it (of
// kernels that the eye stands in) would cost every digit.
struct Splats {
  float x[brick_stops], y[brick_stops];    // projected centre, pixels
  float ex[brick_stops], ey[brick_stops];  // the point of the picture near it, pixels
  float xx[brick_stops], xy[brick_stops], yy[brick_stops];
  float b0[brick_stops], bx[brick_stops], by[brick_stops];
  float d0[brick_stops], dx[brick_stops], dy[brick_stops];
  float dxx[brick_stops], dxy[brick_stops], dyy[brick_stops];
  float d2_least[brick_stops];    // |d|^2 is never less
  float z[brick_stops];           // view depth of the centre
  float strength[brick_stops];    // optical depth at the centre; perspective: times |d|
  float half_depth[brick_stops];  // of the silhouette along the view, world units
  float x0[brick_stops], x1[brick_stops], y0[brick_stops], y1[brick_stops];  // silhouette, pixels
};

// Rows and columns of the tile's blocks that each stop's line and splat may touch, both ends
// included; none if last < first.
struct Footing {
  int line_first[brick_stops], line_last[brick_stops];
  int row_first[brick_stops], row_last[brick_stops];
  int column_first[brick_stops], column_last[brick_stops];
};

struct Prepared {
  const Pass* pass;
  float near;  // the camera's near plane, a view depth
  Stops stops;
  Ribbons ribbons;
  Densities densities;
  Splats splats;
  Footing footing;
};

// One slab of view depth and what its medium has gathered in a tile: optical depth, then colour
// weighted by it, 4 floats a pixel in blocks as the tile's are.
struct Slab {
  float front, back;  // view depths from the camera's depth origin, world units
  float stop;         // transmittance from which on nothing behind counts
  float* gathered;
  std::uint32_t touched[tile_blocks];  // bit set: the block holds something
};

constexpr int gathered_floats = 4 * block_pixels;

// One line's constants, see Ribbons.
struct Ribbon {
  float x, y, ux, uy, inverse_u2, w0, depth_ratio;
  float tail[3], rise[3];
  float depth, depth_rise;
  float phase, phase_rise;
  float r2, inverse_ramp, opacity;
};

// One splat's constants, see Splats.
struct Splat {
  float x, y, ex, ey, xx, xy, yy;
  float b0, bx, by, d0, dx, dy, dxx, dxy, dyy, d2_least;
  float z, near, strength;
  float color[3];
};

// A splat and a line by themselves, for a sweep that meets each in several slabs. Depths are from
// the camera's depth origin; rows and columns are the tile's blocks, both ends included.
struct SplatRecord {
  const float* partial;
  float first, last;  // where it begins and ends
  float middle;
  Splat splat;
  std::int16_t row_first, row_last, column_first, column_last;
};

struct RibbonRecord {
  float first, last;
  float centre;  // of its kernel
  std::int16_t row_first, row_last;
  int moving;
  Ribbon ribbon;
};

// One line's meeting with one block.
struct Hit {
  const RibbonRecord* line;
  float depth;  // at the block's middle
  int block;
};
constexpr int hits_of_line_max = tile_blocks * tile_blocks;

}  // namespace windsplat::engine::kernels
