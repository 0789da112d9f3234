// A Scene: the immutable, fully resolved input of the engine. Plain values and shared fields; a
// frame is a pure function of it. Lengths are world units, colours linear RGB, pixels have their
// centre at +0.5 with row 0 on top.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/model/box_grid.hpp"
#include "server/data/model/middles.hpp"
#include "server/data/model/volume.hpp"
#include "server/ground/paint.hpp"
#include "server/surface/shown.hpp"
#include "server/terrain/terrain.hpp"
#include "server/trace/segments.hpp"

namespace windsplat::light {
class GroundLight;
}

namespace windsplat::scene {

// right, up and forward are orthonormal; forward points from the eye to the target.
struct Camera {
  bool perspective = true;
  glm::dvec3 eye{0, -3, 0};
  glm::dvec3 right{1, 0, 0};
  glm::dvec3 up{0, 0, 1};
  glm::dvec3 forward{0, 1, 0};
  // Half the height of the picture: tan(fovY / 2) in perspective, world units in orthographic.
  double half_height = 0.3;
  double near = 1e-3;  // world units; nothing nearer is drawn (perspective only)
  int width = 1;
  int height = 1;
};

// World positions of samples. Rectilinear: positions[a][i] is the position of sample i along axis
// a, ascending; spacing[a][i] the width of its cell. The box extends half a cell beyond them.
//
// Curved (a globe, terrain): `places` holds the position of each sample. The edge of a cell along
// axis a is half the vector from the previous sample to the next (at an end the vector to the only
// neighbour; along an axis of one sample `spacing`, perpendicular to the other two), times the
// stride. Along x the first and the last of `around` samples are neighbours. positions and spacing
// remain those of the uncurved lattice; colours by height use positions[2].
struct Lattice {
  std::array<int, 3> dims{1, 1, 1};
  std::array<int, 3> first{0, 0, 0};  // index of the first sample among those of the data
  std::array<std::vector<double>, 3> positions;
  std::array<std::vector<double>, 3> spacing;
  std::shared_ptr<const std::vector<std::array<float, 3>>> places;  // x fastest; null: rectilinear
  glm::dvec3 box_min{-1, -1, -1};
  glm::dvec3 box_max{1, 1, 1};
  double inner_radius = 0;  // of the shell of a globe: the lowest edge of its cells; otherwise 0
  // Number of samples along x that close a circle around the globe; 0: x does not close. Those
  // beyond repeat the first ones, and only a slice of such a column draws them.
  int around = 0;
  // Samples along x after which the data repeat, where the lattice is part of them and may go on
  // beyond their end; 0: it does not.
  int turn = 0;
  // The samples of which fields hold values, where these are a part of the lattice
  // (scene/level/parts.hpp): whatever is drawn elsewhere lies beyond the picture. Everything else
  // describes the whole lattice, so that a picture does not depend on the part. nullopt: all.
  std::optional<data::HeldPart> part;
  [[nodiscard]] data::Box held() const { return part ? part->box : data::whole_box(dims); }
  // The same of fields that hold all samples too.
  [[nodiscard]] data::HeldPart whole() const { return {data::whole_box(dims), nullptr}; }
  [[nodiscard]] data::HeldPart held_part() const { return part ? *part : whole(); }
  // Number of a sample in the fields, x fastest; of vectors see vector_number().
  [[nodiscard]] std::size_t number_of(const std::array<int, 3>& sample) const;
  // Number of samples along an axis that are drawn, unless it is that of a slice.
  [[nodiscard]] int drawn(int axis) const { return axis == 0 && around > 0 ? around : dims[axis]; }
};

inline std::size_t Lattice::number_of(const std::array<int, 3>& sample) const {
  if (part) return part->number_of(sample);
  std::size_t number = 0;
  for (std::size_t a = 3; a-- > 0;) {
    number = number * static_cast<std::size_t>(dims[a]) + static_cast<std::size_t>(sample[a]);
  }
  return number;
}

// World heights of the edges of the lowest and the highest cell.
std::array<double, 2> height_range(const Lattice& lattice);

// 256 linear RGB entries over range; a value maps to its linear interpolation, clamped at the ends.
struct ColorTable {
  std::array<double, 2> range{0, 1};
  std::vector<std::array<float, 3>> entries;
};

// direction: the compass bearing of the vector in degrees, 0 along +y (north), 90 along +x (east),
// below 360. rise: (1 - w) H + w R, where R is the rise of the line from tail to head as drawn at
// full detail in world units (along the vertical of a curved cell, and of the vector itself in a
// slice), H the height, as the heights of the box count like rises across the range of the table,
// and w rise_weight. scalar: the value of a second field, mid-grey where it is masked.
enum class LineColor { world_z, screen_z, rise, magnitude, direction, scalar, constant };

// line: constant width. taper: twice the mean width at the tail, a point at the head. arrow: a line
// with a triangular head. comet: a line with a dark tail, whose head is not whitened.
enum class LineShape { line, taper, arrow, comet };

// Lengths in pixels of this picture. The formulas are in docs/design/rendering-model.md, "Marks".
struct LineMark {
  LineShape shape = LineShape::line;
  double head_width = 0;   // arrow: of the base of its head
  double head_length = 0;  // arrow: from the base to the point
  double tail_light = 1;   // light of the tail over that of the head
  double halo = 0;         // width of the rim without light
  // Of constant width, without a halo.
  [[nodiscard]] bool plain() const {
    return (shape == LineShape::line || shape == LineShape::comet) && halo <= 0;
  }
};

// The change of the half width from the middle of a line to its head, for a mean half width;
// shorter lines narrow less. All lengths in pixels.
inline double narrowing(const LineMark& mark, double half_width) {
  return mark.shape == LineShape::taper ? half_width : 0;
}

// The distance from the segment of a line beyond which it is not drawn. r2 bounds one of constant
// width.
inline double outer_radius(const LineMark& mark, double r1, double r2) {
  const double edge = 0.5 * (r2 - r1) + mark.halo;  // half the ramp, and the halo
  const double half = 0.5 * (r1 + r2);
  const double shaft = half + narrowing(mark, half) + edge;
  if (mark.shape != LineShape::arrow) return shaft;
  return std::max(shaft, 0.5 * mark.head_width + std::numbers::sqrt2 * edge);  // square corners
}

// The vector kernel (Crawfis & Max, "Vector Kernels"; formulas in docs/design/rendering-model.md).
struct VectorLayer {
  std::shared_ptr<const data::Volume> field;
  // At full detail the field may hold the middles of kernels alone (data::strided_sample()): then
  // it is `stride`, otherwise 1. Everything else describes all samples. Only of straight lines of a
  // rectilinear lattice without a slice and light, whose stride no medium has, and which no other
  // field colours.
  int field_stride = 1;
  // Whether it then holds the middles of all kernels, also where the lattice has a part.
  bool holds_all = false;
  // Curved lines in place of straight ones, of all kernel positions; null: straight lines. Their
  // values of colour lie in the range of `color`, scaled like their magnitudes by a power of two.
  std::shared_ptr<const trace::Segments> streamlets;
  glm::dvec3 scale{1, 1, 1};  // factor of each component, applied first
  // Used for lines along trajectories in the world (space = world): world units per second per unit
  // of each component, by y index of the data for x (meridians converge), constant for y, by z
  // index for z. Empty: components are not scaled.
  std::vector<double> rate_x;
  double rate_y = 1;
  std::vector<double> rate_z;
  double length = 0.03;  // world units at magnitude_range[1] and above
  double span = 7;
  int stride = 1;
  // At a coarser level a sample is drawn from a group of samples of the data
  // (data::Reduction::drawn), and its line keeps the position, jitter
  // and kernel box that it has at full detail.
  // `stride` is then 1, data_stride that of its kernel at full detail, and drawn_places the number
  // of places along each axis among which the sample is drawn (data::drawn_places).
  std::array<int, 3> halvings{0, 0, 0};
  std::array<int, 3> data_dims{1, 1, 1};
  int data_stride = 1;
  std::array<int, 3> drawn_places{1, 1, 1};
  // By sample of the data along each axis: from the centre of its group to its own place, and the
  // box of its kernel at full detail, both in widths of the group. Empty: evenly spaced samples.
  std::array<std::vector<float>, 3> group_place, group_box;
  // Jitter follows from the index of a sample among those of the data: of the lattice's first one,
  // at full detail. Along x later samples may lie beyond a seam, and count on.
  std::array<int, 3> first_sample{0, 0, 0};
  double r1 = 0.6;  // pixels of this picture (already scaled with its height)
  double r2 = 1.4;
  double opacity = 0.8;
  double head_desaturation = 0.7;
  LineMark mark;
  LineColor color_by = LineColor::world_z;
  ColorTable color;
  std::shared_ptr<const data::Volume> color_field;  // color_by scalar only
  double rise_weight = 0.5;
  std::array<double, 2> magnitude_range{0, 1};
  double min_magnitude = 0;
  double magnitude_intensity = 0.6;
  double jitter_center = 0.5;
  double jitter_stride = 0.3;
  bool overlap = true;
  // Lines are combined by `or` and laid over the medium: in each pixel the largest opacity, and of
  // each channel the largest premultiplied light of all lines before the body, and behind it.
  bool combine_or = false;
  std::uint32_t seed = 1;
  std::uint32_t epoch = 0;
  // Phase motion: the opacity of a line is multiplied by W(frac(q + 1/2 - phase)), W(p) = 1 - |2p -
  // 1|, with q from -1/2 at its tail to 1/2 at its head and phase = a hash of the sample +
  // motion_cycles times min(|V| / magnitude_range[1], 1).
  bool moving = false;
  double motion_cycles = 0;
};

// The distance from the segment of a line beyond which it is not drawn, pixels.
inline double outer_radius(const VectorLayer& layer) {
  return outer_radius(layer.mark, layer.r1, layer.r2);
}

// One factor for each sample of the lattice, x fastest; full_factor is 1.
using SampleFactors = std::vector<std::uint16_t>;
constexpr double full_factor = 65535;

// What the light of a scene does to the colour of a medium. scatter: it is multiplied by the
// sunlight that arrives at each sample and is scattered towards the eye; gradient: by a factor for
// each sample that follows from the gradient of the field; none: nothing.
enum class Shading { scatter, gradient, none };

// What of the lattice the field of the layer holds.
inline data::HeldPart held_vectors(const VectorLayer& layer, const Lattice& lattice) {
  return layer.holds_all ? lattice.whole() : lattice.held_part();
}

// Number in the field of the layer of the vector at a sample, or of its kernel.
inline std::size_t vector_number(const VectorLayer& layer, const Lattice& lattice,
                                 const std::array<int, 3>& sample) {
  if (layer.field_stride == 1) return lattice.number_of(sample);
  return held_vectors(layer, lattice).number_of(sample, layer.field_stride);
}

struct ScalarLayer {
  std::shared_ptr<const data::Volume> field;
  ColorTable color;
  std::vector<std::array<double, 2>> extinction;  // (value, extinction per world unit)
  double min_optical_depth = 1e-4;
  int stride = 1;
  Shading shading = Shading::scatter;
  std::shared_ptr<const SampleFactors> relief;  // of `gradient` in a lit scene
};

// Single scattering of sunlight. The colour of a splat is multiplied by
//   ambient + (1 - ambient) min(1, strength P T)
// and that of a line by the same with P = 1, so that no colour exceeds that of its table. T is the
// transmittance from the sun to the sample, P the phase function of Henyey and Greenstein between
// the ray to the splat and the direction of the sun, with a mean of 1 over the sphere.
struct Light {
  glm::dvec3 sun{0, 0, 1};  // unit vector towards it
  double ambient = 0.3;
  double strength = 1;                            // 0: it is below the horizon
  double anisotropy = 0;                          // -1 < g < 1; positive: forward
  double shadows = 1;                             // factor of the extinctions in T
  std::shared_ptr<const SampleFactors> sunlight;  // T; null: 1 everywhere
};

struct DepthCue {
  double strength = 0;  // intensity at `far` is 1 - strength
  double near = 0;      // view distances, world units
  double far = 1;
};

// kernel: kernels one by one in visibility order [CM92]. slab: slabs of constant view depth that
// accumulate partial footprints [MC98]. reference: the rendering integral per pixel in double
// precision.
enum class Method { kernel, slab, reference };

// Compositing of a line in a homogeneous piece of medium (docs/design/rendering-model.md).
enum class Compositing { simple, cd_naive, cd, analytic, cd_euler };

// An opaque surface that hides what lies behind it: a sphere about the origin, which an eye inside
// it does not see, a horizontal rectangle, or a terrain. A sphere may have a terrain above it. Its
// brightness is body_ambient + (1 - body_ambient) |cos(normal, ray)|, and on terrain that times
// terrain::relief_of(); colours are at most 1.
enum class BodyShape { sphere, ground, terrain };
struct Body {
  BodyShape shape = BodyShape::sphere;
  double radius = 1;                                // sphere, world units
  glm::dvec2 low{-1, -1}, high{1, 1};               // ground: corners in x and y
  double height = 0;                                // ground: z
  std::shared_ptr<const terrain::Terrain> terrain;  // of shape terrain, or above a sphere; or null
  std::array<float, 3> color{0, 0, 0};              // linear
  std::shared_ptr<const ground::Paint> paint;       // its colour by place; null: `color`
  std::shared_ptr<const light::GroundLight> light;  // factor of its colour by place; null: 1
};
constexpr double body_ambient = 0.6;

// Draws only the samples of one layer, and only the part of vectors within its plane: the
// two-dimensional filter of [CM92]. A layer between those of the data, or an oblique plane, has a
// lattice of its own, which has one sample along the axis (section.hpp).
struct Slice {
  int axis = 2;
  int sample = 0;
};

struct Scene {
  Camera camera;
  Lattice lattice;                    // lattice of the drawn level
  std::array<int, 3> level{0, 0, 0};  // how often each axis of the data was halved
  // Of data with stored levels, the level that suffices for the picture.
  std::optional<std::array<int, 3>> wanted_level;
  // Of what would be drawn and is not resident, where coarser data stand in for it; otherwise 0.
  std::uint64_t missing_bytes = 0;
  std::optional<VectorLayer> vector;
  std::vector<ScalarLayer> scalars;
  std::optional<Light> light;
  DepthCue depth_cue;
  std::optional<Slice> slice;
  std::optional<Body> body;
  std::vector<surface::Shown> surfaces;  // isosurfaces and sections
  Method method = Method::kernel;
  Compositing compositing = Compositing::analytic;
  double slab_thickness = 1;  // thickness in cells along the line of sight
  double stop_transmittance = 1.5e-4;
  std::array<float, 3> background{0, 0, 0};  // linear; not part of the rendered image
  std::int64_t sampling_us = 0;              // time of sampling its section; 0: it was kept
};

}  // namespace windsplat::scene
