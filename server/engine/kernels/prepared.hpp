// A brick prepared for one tile: its kernel positions with their lines and splats, as arrays with
// one entry per position. Plain data, written and read by the kernels; a sweep by depth keeps it.
#pragma once

#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"

namespace windsplat::engine::kernels {

// Kernel position l = brick_side j + i of a brick is the i-th along u and the j-th along v in world
// order.
struct KernelPositions {
  int count;            // positions with a line or a splat in the tile
  std::uint64_t lines;  // bit l set: position l has a line
  std::uint64_t splats;
  alignas(64) float x[brick_kernels];  // right, down and forward of the eye, world units
  alignas(64) float y[brick_kernels];
  alignas(64) float z[brick_kernels];
  alignas(64) float depth[brick_kernels];  // forward of the camera's depth origin
};

// The position along a clipped ribbon is f in [0, 1] from its tail end to its head end; colour,
// depth and phase are linear in f.
struct Ribbons {
  alignas(64) float x[brick_kernels];  // f = 0, pixels
  alignas(64) float y[brick_kernels];
  alignas(64) float ux[brick_kernels];  // vector from f = 0 to f = 1, pixels
  alignas(64) float uy[brick_kernels];
  alignas(64) float wx[brick_kernels];  // u / |u|^2
  alignas(64) float wy[brick_kernels];
  // Position along the line that is nearest to its start: 0; for a line that projects to a dot 1/2.
  alignas(64) float w0[brick_kernels];
  alignas(64) float depth_ratio[brick_kernels];  // view depth at f = 0 over that at f = 1
  alignas(64) float bend[brick_kernels];         // depth_ratio - 1
  alignas(64) float depth[brick_kernels];        // view depth at f = 0 minus that of the centre
  alignas(64) float depth_rise[brick_kernels];
  // q + 3/2 - phase at f = 0, in [0, 2]; of dashes their number, in [0, 1); only with phase motion.
  alignas(64) float phase[brick_kernels];
  alignas(64) float phase_rise[brick_kernels];
  // Segments of a chain: the pixel at (dx, dy) from f = 0 belongs to it where cut . d >= 0, and
  // end . (d - u) < end_most, so that segments neither overlap nor leave a gap where they meet.
  alignas(64) float cut_x[brick_kernels];
  alignas(64) float cut_y[brick_kernels];
  alignas(64) float end_x[brick_kernels];
  alignas(64) float end_y[brick_kernels];
  alignas(64) float end_most[brick_kernels];
  // The part of the whole line, from its tail, at f = 0, and how much more it is at f = 1.
  alignas(64) float whole[brick_kernels];
  alignas(64) float whole_rise[brick_kernels];
  alignas(64) float tail[brick_kernels][color_floats];  // colour at f = 0
  alignas(64) float rise[brick_kernels][color_floats];  // colour at f = 1 minus tail
};

struct Densities {
  alignas(64) float rho[brick_kernels];  // extinction per world length
  float color[brick_kernels][color_floats];
};

constexpr float afar_most = 0.05F;

// With p = (px, py) the pixel minus the projected centre and e = (ex, ey) the pixel minus a point
// of the picture near it, the ray through the pixel is d in cells per unit of view depth, and
//   perspective   r^2 = (xx px^2 + xy px py + yy py^2) / |d|^2
//                 |d|^2 = d0 + dx ex + dy ey + bent, bent = dxx ex^2 + dxy ex ey + dyy ey^2
//                 closest to the centre at a view depth of (b0 + bx ex + by ey - z bent) / |d|^2
//                 beyond the centre's
//   orthographic  the same with the constant |d|^2 = d0 divided out of xx, xy, yy, and the closest
//                 point bx ex + by ey beyond the centre.
// The second point is the projected centre itself if that lies in the picture. Offsets from centres
// far outside it would lose all precision. Splats that reach the near plane, whose centres may lie
// beside or behind the eye, have the form of NearSplats instead.
struct Splats {
  std::uint64_t near;  // bit l set: splat l may reach the near plane; see NearSplats
  // Bit set: it lies beyond the near plane, its centre is in the picture, and in the blocks of its
  // box |d|^2 differs from d0 by less than afar_most of it.
  std::uint64_t afar;
  alignas(64) float inverse[brick_kernels];              // 1 / |d| at the centre
  alignas(64) float x[brick_kernels], y[brick_kernels];  // projected centre, pixels
  alignas(64) float ex[brick_kernels],
      ey[brick_kernels];  // the point of the picture near it, pixels
  alignas(64) float xx[brick_kernels], xy[brick_kernels], yy[brick_kernels];
  alignas(64) float b0[brick_kernels], bx[brick_kernels], by[brick_kernels];
  alignas(64) float d0[brick_kernels], dx[brick_kernels], dy[brick_kernels];
  alignas(64) float dxx[brick_kernels], dxy[brick_kernels], dyy[brick_kernels];
  alignas(64) float d2_least[brick_kernels];  // |d|^2 is never less
  // Optical depth at the centre; perspective: times |d|.
  alignas(64) float strength[brick_kernels];
  alignas(64) float half_depth[brick_kernels];  // half the depth of the silhouette along the view,
                                                // world units
};

// A splat that may reach the near plane, in cells, by component: its centre o from the eye, and the
// ray d = ahead + x right + y down through the pixel (x, y) right of and below the middle of the
// picture, per unit of view depth. r^2 = |o x d|^2 / |d|^2, and the ray is closest to the centre at
// a view depth of o.d / |d|^2.
struct NearSplats {
  alignas(64) float centre[3][brick_kernels];
  alignas(64) float ahead[3][brick_kernels];
  alignas(64) float right[3][brick_kernels];
  alignas(64) float down[3][brick_kernels];
};

// Rows and columns of blocks of the tile that each line and splat may touch, both ends included;
// none if last < first.
struct Footing {
  alignas(64) std::int32_t line_first[brick_kernels];
  alignas(64) std::int32_t line_last[brick_kernels];
  // Bit set: the line may touch the column in its k-th row.
  alignas(64) std::uint32_t line_columns[tile_blocks][brick_kernels];
  // The same for lines within window_side rows and columns: one byte per row, the first four in
  // `low`, columns relative to line_column.
  std::uint64_t windowed;  // bit l set: line l is within a window
  alignas(64) std::int32_t line_column[brick_kernels];
  alignas(64) std::int32_t line_column_last[brick_kernels];
  alignas(64) std::uint32_t window_low[brick_kernels];
  alignas(64) std::uint32_t window_high[brick_kernels];
  // The box of blocks of a splat and, if it fits a window, the blocks that its outline touches, in
  // the same format as for lines.
  alignas(64) std::int32_t row_first[brick_kernels];
  alignas(64) std::int32_t row_last[brick_kernels];
  alignas(64) std::int32_t column_first[brick_kernels];
  alignas(64) std::int32_t column_last[brick_kernels];
  alignas(64) std::uint32_t splat_low[brick_kernels];
  alignas(64) std::uint32_t splat_high[brick_kernels];
};

struct Prepared {
  const Pass* pass;
  float near;                // the camera's near plane, a view depth
  float middle_x, middle_y;  // of the picture, pixels
  KernelPositions positions;
  Ribbons ribbons;
  Densities densities;
  Splats splats;
  NearSplats near_splats;
  Footing footing;
};

// Number of slabs into which a splat is accumulated at a time.
constexpr int slabs_ahead = 8;

// One slab of view depth and its medium accumulated so far in a tile: optical depth and colour
// weighted by it, 4 floats per pixel in the block layout of the tile.
struct Slab {
  float front, back;  // view depths from the camera's depth origin, world units
  float begin;        // the front or, if the near plane lies within the slab, that plane
  float* gathered;
  std::uint32_t touched[tile_blocks];  // bit set: the block contains medium
};

constexpr int gathered_floats = 4 * block_pixels;

// Constants of one line; see Ribbons.
struct Ribbon {
  float x, y, ux, uy, wx, wy, w0, depth_ratio, bend;
  float tail[3], rise[3];
  float depth, depth_rise;
  float phase, phase_rise;
  float cut_x, cut_y, end_x, end_y, end_most;
  float whole, whole_rise;
  const LineStyle* style;
};

// Constants of the form of one splat; see Splats.
struct SplatForm {
  float x, y, ex, ey, xx, xy, yy;
  float b0, bx, by, d0, dx, dy, dxx, dxy, dyy, d2_least;
};

// The same of a splat that may reach the near plane; see NearSplats.
struct NearForm {
  float x, y;  // the middle of the picture, pixels
  float centre[3], ahead[3], right[3], down[3];
  float d2_least;  // |d|^2 is never less
};

struct Splat {
  union {
    SplatForm form;
    NearForm near_form;
  };
  float z, near, strength;
  float color[3];
};

// A splat and a line as separate records for the sweep by depth. Depths are from the camera's depth
// origin; rows and columns are blocks of the tile, both ends included.
struct SplatRecord {
  float first, last;  // depths at which it begins and ends
  float middle;
  Splat splat;
  std::int16_t row_first, row_last, column_first, column_last;
  std::uint32_t window_low, window_high;  // if it fits a window: its blocks, as in Footing
  std::int32_t near;                      // it has the near form
};

struct RibbonRecord {
  Ribbon ribbon;  // depth of its centre from the camera's depth origin
  int style;      // see style_of
  int bent;       // too much perspective for the series approximation of depth
};

// A line that may touch a block, with the range of depths of its pixels there.
struct Hit {
  std::uint32_t line;  // index of its record
  std::int32_t block;
  float first, last;
};
constexpr int hits_of_brick_max = brick_kernels * tile_blocks * tile_blocks;

// A line that a block may meet in the current slab.
struct MetLine {
  float depth;  // approximate
  float first;  // lower bound
  std::uint32_t line;
};
constexpr int met_lines_sorted_max = 64;

}  // namespace windsplat::engine::kernels
