// Scene -> RenderPlan.
#include "server/engine/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "server/base/check.hpp"
#include "server/engine/layers/body.hpp"
#include "server/engine/layers/chains.hpp"
#include "server/engine/layers/light.hpp"
#include "server/engine/layers/line_style.hpp"
#include "server/engine/positions.hpp"

namespace windsplat::engine {

namespace {

using scene::Camera;
using scene::Lattice;
using scene::Scene;

// Keeps optical depths finite in float; such a medium is opaque over any distance.
constexpr double extinction_max = 1e30;

kernels::Camera make_camera(const Scene& scene) {
  const Camera& from = scene.camera;
  kernels::Camera to{};
  to.perspective = from.perspective ? 1 : 0;
  to.width = from.width;
  to.height = from.height;
  for (int a = 0; a < 3; ++a) {
    to.right[a] = static_cast<float>(from.right[a]);
    to.down[a] = static_cast<float>(-from.up[a]);
    to.forward[a] = static_cast<float>(from.forward[a]);
  }
  to.half_width_px = static_cast<float>(0.5 * from.width);
  to.half_height_px = static_cast<float>(0.5 * from.height);
  const double pixel = 2.0 * from.half_height / from.height;
  to.pixel = bounded(pixel);
  to.inverse_pixel = bounded(1.0 / pixel);
  to.near = static_cast<float>(from.near);
  to.depth_origin = 0;
  for (int a = 0; a < 3; ++a) {
    to.world_right[a] = from.right[a];
    to.world_down[a] = -from.up[a];
    to.world_forward[a] = from.forward[a];
    to.eye[a] = from.eye[a];
    const double middle = 0.5 * (scene.lattice.box_min[a] + scene.lattice.box_max[a]);
    to.depth_origin += (middle - from.eye[a]) * from.forward[a];
  }
  return to;
}

// stride: scene::VectorLayer::field_stride.
void check_volume(const data::Volume& volume, const data::HeldPart& held, int stride = 1) {
  WINDSPLAT_CHECK(volume.dims == held.dims(stride));
  WINDSPLAT_CHECK(volume.values.size() ==
                  volume.samples() * static_cast<std::size_t>(volume.components));
}

void add_lines(const Scene& scene, double depth_origin, PassPlan& pass) {
  const scene::VectorLayer& from = *pass.vector;
  check_volume(*from.field, held_vectors(from, scene.lattice), from.field_stride);
  kernels::LineStyle& to = pass.kernel.line;
  for (int c = 0; c < 3; ++c) {
    to.velocity[c] = c < from.field->components ? from.field->component(c) : nullptr;
  }
  set_rates(from, pass.rate_x, pass.rate_z, to);
  style_lines(scene, from, depth_origin, to);
  if (from.color_by == scene::LineColor::scalar && !from.streamlets) {
    WINDSPLAT_CHECK(from.color_field != nullptr);
    check_volume(*from.color_field, scene.lattice.held_part());
    to.color_values = from.color_field->values.data();
  }
  flatten(from.color, pass.line_rgb);
  const bool by_magnitude = from.color_by == scene::LineColor::magnitude;
  const bool by_depth = from.color_by == scene::LineColor::screen_z;
  to.color = make_table(from.color, pass.line_rgb, by_magnitude ? to.magnitude_scale : 1,
                        by_depth ? depth_origin : 0);
  if (from.color_by == scene::LineColor::rise) color_by_rise(scene, from, to);
  if (from.streamlets) chain_lines(*from.streamlets, to);
  pass.kernel.has_lines = 1;
  pass.kernel.by_depth = 1;
}

void flatten_layer(const scene::ScalarLayer& from, LayerArrays& arrays) {
  WINDSPLAT_CHECK(!from.extinction.empty());
  arrays.x.clear();
  arrays.y.clear();
  arrays.slope.clear();
  for (std::size_t p = 0; p < from.extinction.size(); ++p) {
    const double x = from.extinction[p][0];
    const double y = std::min(from.extinction[p][1], extinction_max);
    double slope = 0;
    if (p + 1 < from.extinction.size() && from.extinction[p + 1][0] > x) {
      slope = (std::min(from.extinction[p + 1][1], extinction_max) - y) /
              (from.extinction[p + 1][0] - x);
    }
    arrays.x.push_back(bounded(x));
    arrays.y.push_back(bounded(y));
    arrays.slope.push_back(bounded(slope));
  }
  flatten(from.color, arrays.rgb);
}

// A medium of a coarser level has two values at each sample and becomes two layers.
void add_layers(const scene::ScalarLayer& from, const LayerArrays& arrays, kernels::Medium& to) {
  using data::TwoValues;
  const auto add = [&](const float* values, const float* share) {
    WINDSPLAT_CHECK(to.layers < kernels::medium_layers_max);
    kernels::MediumLayer& layer = to.layer[to.layers++];
    layer.values = values;
    layer.share = share;
    layer.extinction = {static_cast<int>(arrays.x.size()), arrays.x.data(), arrays.y.data(),
                        arrays.slope.data()};
    layer.color = make_table(from.color, arrays.rgb);
  };
  const data::Volume& field = *from.field;
  if (field.components == 1) {
    add(field.values.data(), nullptr);
    return;
  }
  WINDSPLAT_CHECK(field.components == TwoValues::components);
  add(field.component(TwoValues::low), field.component(TwoValues::low_share));
  add(field.component(TwoValues::high), field.component(TwoValues::high_share));
}

void add_medium(const Scene& scene, PassPlan& pass) {
  pass.layers.resize(pass.scalars.size());
  if (pass.scalars.empty()) return;
  kernels::Medium& to = pass.kernel.medium;
  to.layers = 0;
  to.min_optical_depth = std::numeric_limits<float>::max();
  for (std::size_t k = 0; k < pass.scalars.size(); ++k) {
    const scene::ScalarLayer& from = *pass.scalars[k];
    check_volume(*from.field, scene.lattice.held_part());
    flatten_layer(from, pass.layers[k]);
    add_layers(from, pass.layers[k], to);
    to.min_optical_depth = std::min(to.min_optical_depth, bounded(from.min_optical_depth));
  }
  pass.kernel.has_medium = 1;
}

// Computes the largest distances between neighbouring samples unless those of the same lattice are
// known.
void measure_ways(const Lattice& lattice, SampleWays& ways) {
  const auto& places = *lattice.places;
  const auto& dims = lattice.dims;
  WINDSPLAT_CHECK(places.size() == static_cast<std::size_t>(dims[0]) * dims[1] * dims[2]);
  if (ways.places.lock() == lattice.places && ways.dims == dims) return;
  std::size_t step = 1;
  for (int a = 0; a < 3; ++a) {
    std::array<float, 3> way{};
    double farthest2 = 0;
    const std::size_t row = step * dims[a];
    const auto add = [&](const std::array<float, 3>& from, const std::array<float, 3>& to) {
      double square = 0;
      for (int c = 0; c < 3; ++c) {
        const float apart = std::abs(to[c] - from[c]);
        way[c] = std::max(way[c], apart);
        square += static_cast<double>(apart) * static_cast<double>(apart);
      }
      farthest2 = std::max(farthest2, square);
    };
    for (std::size_t i = 0; i + step < places.size(); ++i) {
      if (i % row < row - step) add(places[i], places[i + step]);
    }
    for (std::size_t i = 0; a == 0 && lattice.around > 0 && i < places.size(); i += row) {
      add(places[i + static_cast<std::size_t>(lattice.around) - 1], places[i]);
    }
    ways.distance[a] = std::sqrt(farthest2);
    ways.longest[a] = way;
    step = row;
  }
  ways.places = lattice.places;
  ways.dims = dims;
}

// Bounds the extent of the cells of a curved lattice along each world axis, summed over their
// edges: no edge exceeds the distance between neighbours of a sample times the stride.
void bend_pass(const Scene& scene, const SampleWays& ways, PassPlan& pass) {
  kernels::Pass& to = pass.kernel;
  to.places = scene.lattice.places->front().data();
  std::array<float, 3> widest{};
  for (int a = 0; a < 3; ++a) {
    // Along an axis of one sample the cell keeps its width on the uncurved lattice.
    pass.edge_max[a] = scene.lattice.dims[a] > 1 ? 1.001 * ways.distance[a] * pass.stride
                                                 : static_cast<double>(to.cell_max[a]);
    for (int c = 0; c < 3; ++c) {
      widest[c] += scene.lattice.dims[a] > 1 ? ways.longest[a][c] * static_cast<float>(pass.stride)
                                             : to.cell_max[a];
    }
  }
  const float least = 0.002F * std::max({widest[0], widest[1], widest[2]});
  for (int c = 0; c < 3; ++c) to.cell_max[c] = 1.01F * widest[c] + least;
}

// The length along the line of sight of the cells of a stride, world units, from the lattice's mean
// cells. No cell is wider than the box, nor a slice thicker than its layer.
double cell_along_view(const Scene& scene, int stride) {
  double cells2 = 0;
  for (int a = 0; a < 3; ++a) {
    const auto& spacing = scene.lattice.spacing[a];
    const double total = std::accumulate(spacing.begin(), spacing.end(), 0.0);
    const bool sliced = scene.slice && scene.slice->axis == a;
    const int merged = sliced ? 1 : std::min(stride, static_cast<int>(spacing.size()));
    const double count = static_cast<double>(spacing.size()) / merged;
    const double cells = scene.camera.forward[a] * count / total;
    cells2 += cells * cells;
  }
  return 1.0 / std::sqrt(cells2);
}

// The depth of slabs that the scene asks for: a multiple of the cells of the coarsest medium
// (without a medium: of the lines).
double slab_depth_asked(const Scene& scene) {
  int stride = scene.scalars.empty() && scene.vector ? scene.vector->stride : 1;
  for (const scene::ScalarLayer& scalar : scene.scalars) stride = std::max(stride, scalar.stride);
  const double thickness = scene.method == scene::Method::slab ? scene.slab_thickness : 1.0;
  return thickness * cell_along_view(scene, stride);
}

// There are at most slabs_max slabs across the volume.
double slab_depth_least(const Scene& scene) {
  constexpr double slabs_max = 16384;
  double diagonal2 = 0;
  for (int a = 0; a < 3; ++a) {
    const double edge = scene.lattice.box_max[a] - scene.lattice.box_min[a];
    diagonal2 += edge * edge;
  }
  return std::sqrt(diagonal2) / slabs_max;
}

void plan_slabs(const Scene& scene, RenderPlan& plan) {
  for (PassPlan& pass : plan.passes) pass.kernel.by_depth = 1;
  plan.slab_depth = std::max(slab_depth_asked(scene), slab_depth_least(scene));
}

void place_positions(const Scene& scene, int major, const data::Box& held, const SampleWays& ways,
                     PassPlan& pass) {
  kernels::Pass& to = pass.kernel;
  to.major = major;
  to.u = major == 0 ? 1 : 0;
  to.v = major == 2 ? 1 : 2;
  for (int a = 0; a < 3; ++a) {
    AxisArrays& axis = pass.axis[a];
    place_axis(scene, a, pass.stride, held, axis);
    to.cell_max[a] = widest_cell(scene, a, pass.stride, axis);
  }
  to.around = scene.lattice.around;
  if (scene.lattice.places) bend_pass(scene, ways, pass);
}

// Of fields that hold the middles of kernels alone, which are those of the pass.
void index_middles(const Scene& scene, PassPlan& pass) {
  WINDSPLAT_CHECK(pass.vector->field_stride == pass.stride && pass.scalars.empty());
  WINDSPLAT_CHECK(!scene.lattice.places && !scene.slice && !scene.light);
  WINDSPLAT_CHECK(pass.vector->color_by != scene::LineColor::scalar);
  for (AxisArrays& axis : pass.axis) {
    for (const int sample : axis.sample) axis.field_index.push_back(sample / pass.stride);
  }
}

// Of fields that are boxes of a grid. stride: of those that hold the middles of kernels alone.
void place_boxes(const data::BoxGrid& from, int stride, PassPlan& pass) {
  const data::BoxGrid grid = data::strided_grid(from, stride);
  kernels::Pass& to = pass.kernel;
  for (std::size_t a = 0; a < 3; ++a) {
    to.step[a] = a == 0 ? 1 : to.step[a - 1] * grid.size[a - 1];
    to.box_kernels[a] = (from.size[a] - 1) / pass.stride + 1;
    to.box_counts[a] = grid.count[a];
    WINDSPLAT_CHECK(grid.count[a] == 1 || to.box_kernels[a] % kernels::brick_side == 0);
  }
  pass.box_origins.clear();
  for (std::size_t n = 0; n < grid.places.size(); ++n) {
    const data::Box box = grid.box_at(n);
    std::int64_t origin = grid.places[n] * to.step[2] * grid.size[2];
    for (std::size_t a = 0; a < 3; ++a) origin -= to.step[a] * box.first[a];
    pass.box_origins.push_back(origin);
  }
  to.box_origins = pass.box_origins.data();
  pass.box_places = grid.places;
}

void finish_pass(const Scene& scene, double depth_origin, int major, const SampleWays& ways,
                 PassPlan& pass) {
  const trace::Segments* const segments =
      pass.vector != nullptr ? pass.vector->streamlets.get() : nullptr;
  const auto& dims = segments != nullptr ? segments->dims : scene.lattice.dims;
  const bool middles = pass.vector != nullptr && pass.vector->field_stride > 1;
  const int field_stride = middles ? pass.stride : 1;
  const data::HeldPart part =
      middles ? held_vectors(*pass.vector, scene.lattice) : scene.lattice.held_part();
  const data::Box held =
      segments != nullptr ? data::whole_box(dims) : data::strided_box(part.box, field_stride);
  kernels::Pass& to = pass.kernel;
  if (segments != nullptr) {
    place_chains(*segments, pass);
  } else {
    place_positions(scene, major, part.box, ways, pass);
    if (middles) index_middles(scene, pass);
  }
  to.step[0] = 1;
  to.step[1] = held.count[0];
  to.step[2] = static_cast<std::int64_t>(held.count[0]) * held.count[1];
  to.origin = 0;
  for (int a = 0; a < 3; ++a) {
    to.origin -= to.step[a] * held.first[a];
    const AxisArrays& axis = pass.axis[a];
    to.axis[a] = {static_cast<int>(axis.sample.size()),
                  axis.camera.data(),
                  axis.from_eye.data(),
                  axis.world.data(),
                  axis.cell.data(),
                  axis.inverse_cell.data(),
                  axis.sample.data(),
                  middles ? axis.field_index.data() : axis.sample.data(),
                  axis.group.data(),
                  axis.visit.data()};
    to.dims[a] = dims[a];
  }
  if (part.grid) place_boxes(*part.grid, field_stride, pass);
  to.compositing = pass.vector != nullptr && pass.vector->combine_or
                       ? kernels::compositing_or
                       : static_cast<int>(scene.compositing);
  if (pass.vector != nullptr) add_lines(scene, depth_origin, pass);
  add_medium(scene, pass);
  if (scene.light) add_light(scene, pass);
}

bool is_inside(const Camera& camera, const Lattice& lattice) {
  bool inside = camera.perspective;
  for (int a = 0; a < 3; ++a) {
    inside = inside && camera.eye[a] >= lattice.box_min[a] && camera.eye[a] <= lattice.box_max[a];
  }
  return inside;
}

// A kernel is prepared once for every tile that it may touch, so large tiles cost less. Small
// pictures use small tiles, so that all threads have work.
int tile_pixels(int width, int height) {
  const std::int64_t pixels = std::int64_t{width} * height;
  if (pixels >= 300'000) return kernels::tile_side;
  return pixels >= 200'000 ? 96 : 64;
}

Variant variant_of(const Scene& scene, const RenderPlan& plan) {
  Variant variant;
  variant.vector = scene.vector.has_value();
  variant.scalar = !scene.scalars.empty();
  variant.perspective = scene.camera.perspective;
  variant.heads =
      variant.vector && (scene.vector->head_desaturation > 0 || scene.vector->mark.tail_light < 1);
  variant.marks = variant.vector && !scene.vector->mark.plain();
  variant.moving = variant.vector && scene.vector->moving;
  variant.slabs = plan.slabs;
  variant.curved = plan.curved;
  variant.body = scene.body.has_value();
  variant.surfaces = !scene.surfaces.empty();
  variant.lit = scene.light.has_value();
  variant.passes = static_cast<int>(plan.passes.size());
  return variant;
}

// Resets a pass to the given stride without layers.
void begin_pass(int stride, PassPlan& pass) {
  pass.stride = stride;
  pass.vector = nullptr;
  pass.scalars.clear();
  pass.line_rgb.clear();
  pass.rate_x.clear();
  pass.rate_z.clear();
  pass.box_places.clear();
  pass.kernel = kernels::Pass{};
}

// One pass per stride; the pass of the lines is the first. Lines combined by `or` and curved ones
// have their own.
void choose_passes(const Scene& scene, std::vector<PassPlan>& passes) {
  std::size_t used = 0;
  const auto with_stride = [&](int stride) -> PassPlan& {
    const bool own = scene.vector && (scene.vector->combine_or || scene.vector->streamlets);
    for (std::size_t n = own ? 1 : 0; n < used; ++n) {
      if (passes[n].stride == stride) return passes[n];
    }
    if (used == passes.size()) passes.emplace_back();
    begin_pass(stride, passes[used]);
    return passes[used++];
  };
  if (scene.vector) with_stride(scene.vector->stride).vector = &*scene.vector;
  for (const scene::ScalarLayer& scalar : scene.scalars) {
    with_stride(scalar.stride).scalars.push_back(&scalar);
  }
  passes.resize(used);
}

}  // namespace

int major_axis(const Camera& camera, const Lattice& lattice) {
  int major = 0;
  double most = -1;
  for (int a = 0; a < 3; ++a) {
    double sum = 0;
    for (const double width : lattice.spacing[a]) sum += width;
    const double crossed =
        std::abs(camera.forward[a]) * static_cast<double>(lattice.spacing[a].size()) / sum;
    if (crossed > most) {
      most = crossed;
      major = a;
    }
  }
  return major;
}

bool has_thicker_slabs(const Scene& scene) {
  return scene.method == scene::Method::slab && !scene.scalars.empty() &&
         slab_depth_asked(scene) < slab_depth_least(scene);
}

void make_plan(const Scene& scene, RenderPlan& plan) {
  WINDSPLAT_CHECK(scene.camera.width > 0 && scene.camera.height > 0);
  WINDSPLAT_CHECK(scene.camera.half_height > 0);
  plan.view = &scene.camera;
  plan.camera = make_camera(scene);
  plan.body = make_body(scene);
  plan.compositing = static_cast<int>(scene.compositing);
  const bool bent = scene.lattice.places != nullptr;
  plan.curved = bent || (scene.vector && scene.vector->streamlets);
  plan.slabs = scene.method == scene::Method::slab;
  plan.stop_transmittance = static_cast<float>(scene.stop_transmittance);
  plan.perspective_medium = scene.camera.perspective && !scene.scalars.empty();
  plan.or_lines = scene.vector && scene.vector->combine_or;
  choose_passes(scene, plan.passes);
  const int major = major_axis(scene.camera, scene.lattice);
  plan.eye_inside = is_inside(scene.camera, scene.lattice);
  plan.eye_sample = eye_index(scene.camera, major, scene.lattice.positions[major]);
  if (bent) measure_ways(scene.lattice, plan.ways);
  for (PassPlan& pass : plan.passes) {
    finish_pass(scene, plan.camera.depth_origin, major, plan.ways, pass);
  }
  plan.slab_depth = 1;
  if (plan.slabs || plan.curved) plan_slabs(scene, plan);
  if (scene.body || !scene.surfaces.empty()) {
    for (PassPlan& pass : plan.passes) pass.kernel.by_depth = 1;
  }
  plan.tile_pixels = tile_pixels(scene.camera.width, scene.camera.height);
  plan.variant = variant_of(scene, plan);
}

}  // namespace windsplat::engine
