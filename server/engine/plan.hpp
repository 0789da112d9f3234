// Scene -> RenderPlan: the input of the kernels as plain data. Storage of an earlier plan is
// reused.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/engine/kernels/frame_data.hpp"
#include "server/engine/work.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

// The axis along which sheets of kernels are stacked: the one along which the view direction
// crosses most cells, |forward_a| / mean spacing_a largest; the first one on a tie.
int major_axis(const scene::Camera& camera, const scene::Lattice& lattice);

// A kernel position along one axis: it represents `stride` samples starting at `first` (the last
// position: the remaining ones) and lies at the middle sample (the lower of two).
struct AxisKernel {
  int sample = 0;
  int group = 1;    // number of samples represented
  double cell = 0;  // their extent in world units
};
AxisKernel axis_kernel(std::span<const double> spacing, int stride, int first);

// Index of the kernel position whose cell (bounded midway between positions) contains the eye; in
// orthographic views the end of the axis nearest to the viewer. Outward from it is front to back.
int eye_index(const scene::Camera& camera, int axis, const std::vector<double>& positions);

// Kernel positions in visibility order: bricks of brick_side consecutive positions outward from the
// brick of the eye, and within each brick outward from the eye. Replaces the contents of `order`.
void visit_order(int count, int eye, std::vector<int>& order);

// Backing store of one kernels::Axis.
struct AxisArrays {
  std::vector<double> position;
  std::vector<double> camera;
  std::vector<float> from_eye;
  std::vector<float> world;
  std::vector<float> cell;
  std::vector<float> inverse_cell;
  std::vector<int> sample;
  std::vector<int> field_index;  // empty: that of the sample
  std::vector<int> group;
  std::vector<int> visit;
  std::vector<std::array<int, 2>> bricks;  // first and count of each brick in `visit`
};

struct LayerArrays {
  std::vector<float> x, y, slope;  // extinction
  std::vector<float> rgb;
};

// Layers of equal stride share a pass: a line and a splat at one kernel position are composited as
// one kernel. Layers of other strides have separate passes, interleaved sheet by sheet.
struct PassPlan {
  int stride = 1;
  const scene::VectorLayer* vector = nullptr;
  std::vector<const scene::ScalarLayer*> scalars;
  std::array<AxisArrays, 3> axis;
  std::vector<float> line_rgb;
  std::vector<float> rate_x, rate_z;
  std::vector<LayerArrays> layers;
  std::vector<std::int64_t> box_origins;
  std::vector<int> box_places;  // BoxGrid::places of these boxes; empty: the fields are no grid
  std::array<double, 3> edge_max{};  // curved lattices: the longest edge of a cell along each axis
  kernels::Pass kernel{};            // points into the arrays above
};

// Largest distances between neighbouring samples of a curved lattice. Kept between frames, because
// computing them takes as long as rendering some.
struct SampleWays {
  std::weak_ptr<const std::vector<std::array<float, 3>>> places;  // identity of the lattice
  std::array<int, 3> dims{};
  // [a][c]: largest distance along world axis c between neighbours along lattice axis a.
  std::array<std::array<float, 3>, 3> longest{};
  std::array<double, 3>
      distance{};  // [a]: the longest of all between neighbours along lattice axis a
};

struct RenderPlan {
  const scene::Camera* view = nullptr;
  kernels::Camera camera{};
  kernels::Body body{};
  std::vector<PassPlan> passes;     // the one with lines first
  int eye_sample = 0;               // eye_index of the whole lattice along the major axis
  bool eye_inside = false;          // perspective view from within the box
  bool perspective_medium = false;  // pixel rays are needed
  bool slabs = false;               // the slab method
  bool or_lines = false;            // the first pass has lines that are combined by `or`
  bool curved = false;    // visibility order by depth only: a curved lattice, or curved lines
  int compositing = 0;    // scene::Compositing
  double slab_depth = 1;  // depth of a slab along the view, world units
  float stop_transmittance = 0;
  int tile_pixels = 0;  // along a tile's side, at most kernels::tile_side
  Variant variant;      // variant, without target and level
  SampleWays ways;      // distances of the last curved lattice

  RenderPlan() = default;
  RenderPlan(const RenderPlan&) = delete;  // not copyable: passes contain pointers into themselves
  RenderPlan& operator=(const RenderPlan&) = delete;
  RenderPlan(RenderPlan&&) = default;
  RenderPlan& operator=(RenderPlan&&) = default;
  ~RenderPlan() = default;
};

// Replaces the plan with one for `scene`, which must outlive it. Only the storage is reused, and
// `ways` if the curved lattice is the same.
void make_plan(const scene::Scene& scene, RenderPlan& plan);

// Whether slabs are drawn thicker than the scene asks for, because their number is limited.
bool has_thicker_slabs(const scene::Scene& scene);

}  // namespace windsplat::engine
