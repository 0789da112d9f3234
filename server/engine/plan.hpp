// Scene -> RenderPlan: everything that the kernels need, as plain data. What the scene lacks is
// neither computed nor allocated; nor is what a plan made before has room for.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/engine/kernels/frame_data.hpp"
#include "server/engine/work.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

// The axis along which slabs of kernels are stacked: the one that the view crosses most cells
// along, |forward_a| / mean spacing_a largest; the first of equals.
int major_axis(const scene::Camera& camera, const scene::Lattice& lattice);

// One of an axis' kernel stops: it stands for `stride` samples from `first` on, the last one for
// those that are left, and has the middle one's place (the lower of two).
struct Stop {
  int sample = 0;
  int group = 1;    // samples
  double cell = 0;  // world units: what it stands for, from one end to the other
};
Stop kernel_stop(const std::vector<double>& spacing, int stride, int first);

// The stop whose cell (bounded midway between stops) holds the eye; in orthographic views the end
// of the axis that the view comes from. From it, outward is front to back.
int eye_stop(const scene::Camera& camera, int axis, const std::vector<double>& positions);

// Stops in visibility order: bricks of brick_side consecutive stops outward from the eye's, and
// inside each brick stops outward from the eye's. Replaces what `order` held.
void visit_order(int stops, int eye, std::vector<int>& order);

// Backing store of one kernels::Axis.
struct AxisArrays {
  std::vector<double> position;
  std::vector<double> camera;
  std::vector<float> from_eye;
  std::vector<float> world;
  std::vector<float> cell;
  std::vector<float> inverse_cell;
  std::vector<int> sample;
  std::vector<int> group;
  std::vector<int> visit;
  std::vector<std::array<int, 2>> bricks;  // first and count of each brick in `visit`
};

struct LayerArrays {
  std::vector<float> x, y, slope;  // extinction
  std::vector<float> rgb;
};

// Layers that stop at the same samples share a pass: a line and a splat at one stop are composited
// as one kernel. Layers of other strides have passes of their own, interleaved slab by slab.
struct PassPlan {
  int stride = 1;
  const scene::VectorLayer* vector = nullptr;
  std::vector<const scene::ScalarLayer*> scalars;
  std::array<AxisArrays, 3> axis;
  std::vector<float> line_rgb;
  std::vector<float> rate_x, rate_z;
  std::vector<LayerArrays> layers;
  kernels::Pass kernel{};  // points into the arrays above
};

// How far a curved lattice's samples lie apart; to look at all of them takes as long as to draw
// some.
struct SampleWays {
  std::weak_ptr<const std::vector<std::array<float, 3>>> places;  // whose they are
  std::array<int, 3> dims{};
  // [a][c]: the longest way from a sample to the next one along axis a, in the world's direction c.
  std::array<std::array<float, 3>, 3> longest{};
};

struct RenderPlan {
  const scene::Camera* view = nullptr;
  kernels::Camera camera{};
  std::vector<PassPlan> passes;     // the one with lines first
  int eye_sample = 0;               // of the whole lattice along the major axis: see eye_stop
  bool perspective_medium = false;  // pixel rays are needed
  bool slabs = false;               // the slab method
  bool curved = false;              // visibility is told by depth alone
  int compositing = 0;              // scene::Compositing
  double slab_depth = 1;            // of a slab along the view, world units
  float stop_transmittance = 0;
  int tile_pixels = 0;  // along a tile's side, at most kernels::tile_side
  Variant variant;      // without its target and level
  SampleWays ways;      // of the curved lattice that was planned last

  RenderPlan() = default;
  RenderPlan(const RenderPlan&) = delete;  // passes point into themselves
  RenderPlan& operator=(const RenderPlan&) = delete;
  RenderPlan(RenderPlan&&) = default;
  RenderPlan& operator=(RenderPlan&&) = default;
  ~RenderPlan() = default;
};

// Replaces all that the plan says by this scene, which must outlive its use; of what it was before
// only storage is kept, and what is known of a curved lattice that is still there.
void make_plan(const scene::Scene& scene, RenderPlan& plan);

}  // namespace windsplat::engine
