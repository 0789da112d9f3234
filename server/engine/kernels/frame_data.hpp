// Input and output of the kernels: plain arrays and numbers without functions, so that no shared
// function is compiled for one instruction set and linked into code for another.
#pragma once

#include <cstdint>

namespace windsplat::ground {
class Paint;
}
namespace windsplat::light {
class GroundLight;
}
namespace windsplat::terrain {
class Terrain;
}

namespace windsplat::engine {
class KeptGround;
}

namespace windsplat::engine::kernels {

constexpr int block_side = 4;                          // pixels
constexpr int block_pixels = block_side * block_side;  // updated together
constexpr int tile_side = 128;                         // pixels, at most
constexpr int tile_blocks = tile_side / block_side;    // blocks along a tile's side
constexpr int block_channels = 4;                      // transmittance, red, green, blue
constexpr int block_floats = block_channels * block_pixels;
constexpr int window_side = 8;  // blocks; 8 x 8 blocks are the bits of one word
// The value of Pass::compositing of lines combined by `or`, beyond those of scene::Compositing.
constexpr int compositing_or = 5;
constexpr double footprint_radius = 1.37;  // radius of the footprint of a splat, cells
constexpr int brick_side = 8;              // kernel positions
constexpr int brick_kernels = brick_side * brick_side;

// One axis of a pass: arrays with an entry per kernel position, in world order.
struct Axis {
  int count;              // number of kernel positions
  const double* camera;   // 3 each: contribution of this axis to (right, down, forward) of the eye
  const float* from_eye;  // world coordinate minus that of the eye
  const float* position;  // world coordinate
  const float* cell;      // stride times spacing, world units
  const float* inverse_cell;
  const int* sample;  // index of its sample in the lattice
  // The same in the fields: of those that hold the middles of kernels alone, that of the kernel.
  const int* field_index;
  const int* group;  // number of samples that it represents
  const int* visit;  // positions in visibility order: bricks outward from the cell of the eye
};

constexpr int color_floats = 4;

struct ColorTable {
  const float* rgb;  // color_floats per entry, the fourth 0; the last entry is repeated
  int entries;
  float low;
  float scale;  // entries - 1 over the range
};

// Segments of curved lines in place of a straight line for each sample (trace::Segments): arrays by
// vertex, whose positions are Pass::places. Kernel position v is the segment from vertex v to the
// next.
struct Chains {
  const float* q;  // null: straight lines
  const float* magnitude;
  const float* tangent[3];
  const float* phase;
  const float* turn;  // null: one texture along q; otherwise dashes across the segment
  const float* color;
  const std::uint32_t* sample;  // of the lattice
};

struct LineStyle {
  Chains chains;
  const float* velocity[3];  // third null for a horizontal field
  float scale[3];
  const float* rate_x;  // by sample of the data along y; null: components are not scaled
  float rate_y;
  const float* rate_z;  // by sample of the data along z
  // A power of two by which magnitudes are multiplied: 1, unless the full magnitude is so large or
  // small that its square or inverse could leave the range of floats (`scaled`). Then, and for
  // vectors of such sizes, magnitudes are computed in double. All numbers below are scaled.
  double magnitude_scale;
  double unscaled_min_magnitude;
  int scaled;
  float length;  // world units at full magnitude
  float inverse_full_magnitude;
  float min_magnitude;
  float half_span;  // half the width of the kernel box, in boxes of one kernel at full detail
  // Lines of a coarser level; see data::Reduction::drawn.
  int merged;  // 0 at full detail
  int halvings[3];
  int data_dims[3];
  int data_stride;  // of the kernels at full detail
  float inverse_data_stride;
  int drawn_places[3];
  // By sample of the data: scene::VectorLayer::group_place and group_box; null: an even axis.
  const float* group_place[3];
  const float* group_box[3];
  float half_box[3];  // bound on half the width of the kernel box, in cells
  float shift[3];     // bound on the distance of a line's centre from its position, in cells
  float r1, r2;       // pixels
  float inverse_ramp;
  float opacity;
  float reach, steep;  // opacity of a pixel: clamp(reach - steep distance, 0, opacity)
  float head_desaturation;
  float tail_light;  // light of the tail over that of the head
  // Shapes of other than constant width, and halos: see body_marks.hpp.
  int marked;                    // 0: constant width without a halo
  float half_width;              // mean, pixels
  float narrowing;               // from the middle to the head, pixels; negative: to the tail
  float head_length;             // of an arrow, pixels; 0: none
  float head_slope, head_steep;  // half width over length; steep times the cosine of that angle
  float halo;                    // steep times the width of the halo
  float outer;                   // no pixel farther from the segment is touched
  float intensity_low, intensity_scale, intensity;
  float cue_near, cue_scale, cue_strength;  // from the camera's depth origin
  int color_by;                             // scene::LineColor
  ColorTable color;
  const float* color_values;  // values of the field that determines the colour, or null
  // Colour by rise: position on the map = rise_scale * part of the length that rises + height_scale
  // * world height + rise_shift.
  float rise_scale, height_scale, rise_shift;
  float jitter_center, jitter_stride;
  std::uint32_t seed, epoch;
  std::uint32_t first[3];  // indices of the lattice's first sample among those of the data
  float keep[3];           // times the drawn extent: 0 along a slice's axis
  int moving;              // phase motion
  double motion_cycles;
};

// Piecewise linear in the value: y[p] + slope[p] (v - x[p]) from x[p] on, y[0] below x[0].
struct Extinction {
  int points;
  const float* x;
  const float* y;
  const float* slope;
};

constexpr int medium_layers_max = 8;  // two for each medium of a coarser level

struct MediumLayer {
  const float* values;
  const float* share;  // times the extinction: part of the sample that has this value; null: 1
  Extinction extinction;
  ColorTable color;
  const std::uint16_t* light;  // factor by sample, 65535 is 1; null: its colour is not lit
  int scatters;                // the factor is sunlight, which Sunlight::strength multiplies
};

// See scene::Light.
struct Sunlight {
  int lit;                        // 0: the scene has no light
  const std::uint16_t* sunlight;  // by sample, 65535 is 1; null: 1
  float ambient;
  float strength;
  float media_strength;  // in orthographic views times the phase function
  float anisotropy;
  float sun[3];  // right, down and forward of the unit vector towards the sun
};

struct Medium {
  int layers;
  MediumLayer layer[medium_layers_max];
  float min_optical_depth;
};

struct Camera {
  int perspective;
  int width, height;
  float right[3], down[3], forward[3];  // world components
  float half_width_px, half_height_px;
  float pixel;  // size at unit distance (perspective) or in the world
  float inverse_pixel;
  float near;
  double world_right[3], world_down[3], world_forward[3];  // right, down and forward without
                                                           // rounding to float
  double eye[3];
  double depth_origin;  // view depth of the middle of the volume, the origin of slabs
};

// The opaque body of the scene; see scene::Body.
constexpr int body_none = 0;
constexpr int body_sphere = 1;
constexpr int body_ground = 2;
constexpr int body_terrain = 3;
struct Body {
  int shape;
  const terrain::Terrain* terrain;  // of shape terrain, or above a sphere; or null
  const ground::Paint* paint;       // its colour by place; null: rgb
  double pixel;                     // as Camera::pixel, without rounding to float
  double centre[3];                 // sphere: right, down and forward of the eye, world units
  double radius;                    // sphere
  double low[3], high[3];  // ground: corners relative to the eye, world axes; both at its height
  float rgb[3];
  float ambient;
  const light::GroundLight* light;  // factor of its colour by place; null: 1
  KeptGround* kept;                 // terrain and paint of earlier frames; or null
};

// Kernel positions of one stride, with their lines and media.
struct Pass {
  Axis axis[3];
  int major, u, v;       // sheets are stacked along major; u is innermost
  std::int64_t step[3];  // offset between neighbours along each axis of the fields, in samples
  std::int64_t origin;   // offset of index 0 in the fields: not above 0, as they may be of a part
  // Of fields that are boxes of a grid (data/model/box_grid.hpp), the origin of each of its boxes,
  // x fastest, in place of that above; the steps are those within a box. null: they are not.
  const std::int64_t* box_origins;
  int box_kernels[3];  // kernel positions of a box along each axis: multiples of brick_side
  int box_counts[3];
  int has_lines;
  int has_medium;
  LineStyle line;
  Medium medium;
  Sunlight light;
  float cell_max[3];    // widest cell along each axis; curved: largest extent of a cell
  int dims[3];          // dimensions of the lattice
  int around;           // scene::Lattice::around
  const float* places;  // curved lattices: 3 per sample, world units; otherwise null
  int compositing;      // scene::Compositing or compositing_or
  int by_depth;         // depths of kernel positions are required
};

// A brick of 8 x 8 x 1 kernel positions, as ranges of the visit lists.
struct Brick {
  std::int32_t sheet;  // index in the major axis' visit list
  std::int32_t u_first, u_count;
  std::int32_t v_first, v_count;
  std::int32_t pass;
  std::int32_t lines, splats;     // numbers of them
  float line_reach;               // half the longest line here, world units
  float depth_first, depth_last;  // including kernels; from the camera's depth origin, world units
  std::int16_t block_x, block_y;  // blocks of the picture that it may touch, both ends included
  std::int16_t block_x_last, block_y_last;
};

struct BrickSummary {
  std::int64_t without_line;
  std::int64_t without_splat;
  std::int64_t without_both;
  // Skipped by tolerance: the number of lines, the sum of their lengths relative to full length,
  // and an upper bound on the optical depths of the splats summed over pixels.
  int weak_lines;
  float weak_parts;
  float thin_medium;
  float magnitude_max;  // largest magnitude of the lines that are drawn
  int lines;            // number of lines and splats that are drawn
  int splats;
};

struct Counters {
  std::int64_t pixel_updates;
  std::int64_t exponentials;
  std::int64_t occluded;
};

constexpr int layers_max = 16;  // translucent surfaces of a pixel

// The body, or one of the translucent surfaces before it, at the pixels of a block. Where a pixel
// does not see it: opacity 0, behind 1, depth body_nowhere.
struct BodyBlock {
  alignas(64) float depth[block_pixels];    // from the camera's depth origin, world units
  alignas(64) float opacity[block_pixels];  // part of the pixel that it covers
  alignas(64) float rgb[3][block_pixels];   // its colour including its shade
  // What is composited behind the body so far: its light and its transmittance, both including the
  // body's.
  alignas(64) float light[3][block_pixels];
  alignas(64) float behind[block_pixels];
  float nearest, farthest;  // depths of the pixels that see it
};
constexpr float body_nowhere = 1e30F;

// The body in a tile. Its light is added in the end (close_body), so that kernels that reach
// through it may come in any order; the slab method composites it at its depth.
struct TileBody {
  BodyBlock* blocks;
  float nearest;                      // least depth in the tile
  std::uint32_t seen[tile_blocks];    // bit set: the block still waits for light of the body
  std::uint32_t opaque[tile_blocks];  // bit set: the body covers every pixel of the block
};

// What the pixels of a block show of the body; see terrain::PixelSurface.
struct BodyPixels {
  double left, top;  // its left upper corner
  alignas(64) double depth[block_pixels];
  alignas(64) double coverage[block_pixels];
  alignas(64) double cosine[block_pixels];
  double relief[block_pixels];
  double normal[block_pixels][3];
};

// Adds the terrain of a body to the rest of the body. The same code for every instruction set.
void add_terrain(const Camera& camera, const Body& body, BodyPixels& pixels);

// Sets the colours, without shade, of the pixels that see a body with paint. The same code for
// every instruction set.
void paint_body(const Camera& camera, const Body& body, const BodyPixels& pixels,
                float rgb[3][block_pixels]);

// Factors of the colour of a body with light at the pixels of a block that see it. The same code
// for every instruction set.
void light_body(const Camera& camera, const Body& body, double left, double top,
                const double depth[block_pixels], const double coverage[block_pixels],
                float bright[block_pixels]);

// Pixels of one tile as blocks of 4 x 4; see block_channels. Rays, for perspective media: the
// length of the ray of each pixel at unit view depth.
struct Tile {
  int x, y;           // position of its first pixel
  int width, height;  // pixels inside the picture
  float* blocks;
  const float* rays;
  float stop;                       // a block is closed when no transmittance exceeds this
  std::uint32_t open[tile_blocks];  // bit set: the block is open
  int any_closed;
  TileBody* body;  // null: no pixel of the tile sees the body or a layer
  // Translucent surfaces, in every pixel nearest first and before the body. They divide kernels as
  // the body does.
  TileBody* layer;
  int layers;
  Counters counters;
};

}  // namespace windsplat::engine::kernels
