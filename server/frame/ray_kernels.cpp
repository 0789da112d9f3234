// A ray -> the layers of cells that it passes -> the kernels of each that reach it.
#include "server/frame/ray_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>

#include "server/data/model/volume.hpp"
#include "server/engine/reference/profile.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;
using reference::dot;
using reference::plus;

// Half of the diagonal of a cell, in edges.
constexpr double half_diagonal = 0.87;
// What a ray sees through is less than this where a picture is taken to be opaque.
constexpr double opaque_below = 1e-3;
// Kernels of a bundle, 408 bytes each; those behind so many are left out by every method alike.
constexpr std::size_t kernels_most = 8192;
// Positions of one layer that are visited for a bundle.
constexpr double positions_most = 16384;
constexpr double bundle_positions_most = 5e5;  // of all layers together
constexpr std::size_t probes_most = 4;         // rays of a bundle of which this is known

double footprint_at(double r) {
  constexpr double s = reference::footprint_s;
  constexpr double t = reference::footprint_t;
  if (r >= t) return 0;
  return r < s ? 1 - r * r / (s * t) : (t - r) * (t - r) / (t * (t - s));
}

Vec to_cells(const reference::Splat& splat, const Vec& v) {
  return {dot(splat.inverse[0], v), dot(splat.inverse[1], v), dot(splat.inverse[2], v)};
}

// Rates of a level: those of the first sample of each group.
void thin(std::vector<double>& rates, int halvings, std::size_t count) {
  if (rates.empty()) return;
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(rates[std::min(rates.size() - 1, i << static_cast<unsigned>(halvings))]);
  }
  rates = std::move(out);
}

// The boxes of the kernels at full detail, in cells of the level; of axes halved differently the
// mean.
void keep_boxes(scene::VectorLayer& lines) {
  if (lines.halvings == std::array{0, 0, 0}) return;
  const double halvings = lines.halvings[0] + lines.halvings[1] + lines.halvings[2];
  const double box = lines.data_stride * std::exp2(-halvings / 3);
  lines.span = box * (lines.overlap ? lines.span : 1.0);
  lines.overlap = true;
  lines.jitter_center *= box;
  lines.jitter_stride *= box;
}

// The sample of a kernel position.
Index sample_of(const reference::LayerGroup& layers, const Index& i) {
  Index out{};
  for (std::size_t a = 0; a < 3; ++a) {
    out[a] = layers.axis[a][static_cast<std::size_t>(i[a])].sample;
  }
  return out;
}

double magnitude_of(const data::Volume& field, std::size_t sample) {
  double square = 0;
  for (int c = 0; c < field.components; ++c) {
    const double v = field.component(c)[sample];
    square += v * v;
  }
  return std::sqrt(square);
}

}  // namespace

PictureRay picture_ray(const reference::View& view, double x, double y) {
  PictureRay ray{x, y, {}, view.forward, 1};
  Vec& to = view.perspective ? ray.direction : ray.origin;
  to = plus(to, (x - view.half_width) * view.pixel, view.right);
  to = plus(to, (y - view.half_height) * view.pixel, view.down);
  ray.length = reference::length(ray.direction);
  return ray;
}

SplatOnRay splat_on_ray(const reference::Splat& splat, const PictureRay& ray) {
  SplatOnRay out;
  const Vec d = to_cells(splat, ray.direction);
  const Vec o = to_cells(splat, plus(splat.from_eye, -1, ray.origin));
  out.cells2 = dot(d, d);
  out.middle = dot(o, d) / out.cells2;
  const Vec off = plus(o, -out.middle, d);
  out.least2 = dot(off, off);
  if (out.least2 >= reference::footprint_t * reference::footprint_t) return out;
  out.rho = splat.rho * ray.length / reference::footprint_integral;
  out.tau = out.rho * footprint_at(std::sqrt(out.least2)) / std::sqrt(out.cells2);
  return out;
}

double half_extent(const SplatOnRay& on) {
  constexpr double t2 = reference::footprint_t * reference::footprint_t;
  return std::sqrt(std::max(0.0, t2 - on.least2) / on.cells2);
}

double part_before(const SplatOnRay& on, double depth) {
  constexpr int steps = 32;
  static const reference::Profile profile;
  const double half = half_extent(on);
  if (on.tau <= 0 || depth <= on.middle - half) return 0;
  if (depth >= on.middle + half) return 1;
  const double step = (depth - on.middle + half) / steps;
  double sum = 0;
  for (int n = 0; n < steps; ++n) {
    const double z = (n + 0.5) * step - half;
    sum += profile(on.least2 + on.cells2 * z * z);
  }
  return std::min(1.0, on.rho * sum * step / on.tau);
}

RayKernels::RayKernels(const scene::Scene& scene, const Tolerances& marked)
    : scene_(scene),
      marked_(marked),
      view_(reference::make_view(scene.camera)),
      samples_(scene),
      layers_(reference::group_layers(scene)) {
  if (scene.vector && !scene.vector->combine_or) {
    lines_ = scene.vector;
    if (lines_->streamlets) {  // which are not clipped
      lines_->overlap = true;
      lines_->span = 1e9;
    }
    keep_boxes(*lines_);
    thin(lines_->rate_x, lines_->halvings[1], scene.lattice.positions[1].size());
    thin(lines_->rate_z, lines_->halvings[2], scene.lattice.positions[2].size());
  }
  int number = 0;
  for (const reference::LayerGroup& layers : layers_) {
    const bool draws = layers.lines != nullptr && lines_.has_value();
    groups_.push_back({&layers, draws ? &*lines_ : nullptr, KernelOrder(scene, layers, number++)});
  }
}

reference::KernelPosition RayKernels::position(const Group& group, const Index& i) const {
  std::array<reference::AxisPosition, 3> at;
  for (std::size_t a = 0; a < 3; ++a) {
    at[a] = group.layers->axis[a][static_cast<std::size_t>(i[a])];
  }
  return reference::make_kernel_position(scene_, view_, at);
}

std::optional<RayKernels::Place> RayKernels::place_at(const Group& group, std::size_t axis,
                                                      int layer, Vec guess,
                                                      const PictureRay& ray) const {
  constexpr int turns = 4;  // cells differ in size and, on curved lattices, in direction
  Place out;
  out.axis = axis;
  for (int turn = 0; turn < turns; ++turn) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double most = group.count(a) - 1.0;
      out.at[a] =
          a == axis ? layer : static_cast<int>(std::lround(std::clamp(guess[a], 0.0, most)));
    }
    const reference::KernelPosition here = position(group, out.at);
    if (!here.has_cell) return std::nullopt;
    out.direction = here.to_cells(ray.direction);
    if (std::abs(out.direction[axis]) < 1e-12) return std::nullopt;
    const Vec from = here.to_cells(plus(here.from_eye, -1, ray.origin));
    out.depth = from[axis] / out.direction[axis];
    bool found = true;
    for (std::size_t a = 0; a < 3; ++a) {
      out.edges[a] = reference::length(here.edge[a]);
      out.offset[a] = a == axis ? 0 : out.depth * out.direction[a] - from[a];
      guess[a] = out.at[a] + out.offset[a];
      const bool within = guess[a] > -0.5 && guess[a] < group.count(a) - 0.5;
      found = found && (!within || std::abs(out.offset[a]) <= 0.75);
    }
    if (found) break;
  }
  return out;
}

// The places where a ray passes the layers of cells across the axis of which it passes most.
void RayKernels::find_path(const Group& group, const Index& near, const PictureRay& ray) {
  path_.clear();
  Index start{};
  for (std::size_t a = 0; a < 3; ++a) {
    const bool sliced = scene_.slice && static_cast<std::size_t>(scene_.slice->axis) == a;
    const int first = sliced ? 0 : group.layers->axis[a].front().sample / group.layers->stride;
    const int kernel = near[a] / group.layers->stride - first;
    start[a] = sliced ? 0 : std::min(kernel, group.count(a) - 1);
  }
  const reference::KernelPosition here = position(group, start);
  if (!here.has_cell) return;
  const Vec rate = here.to_cells(ray.direction);
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(rate[a]) > std::abs(rate[axis])) axis = a;
  }
  for (const int way : {-1, 1}) {
    Vec guess{};
    for (std::size_t a = 0; a < 3; ++a) guess[a] = start[a];
    for (int layer = start[axis] + (way > 0 ? 1 : 0); layer >= 0 && layer < group.count(axis);
         layer += way) {
      const auto place = place_at(group, axis, layer, guess, ray);
      if (!place) break;
      for (std::size_t a = 0; a < 3; ++a) {
        guess[a] =
            place->at[a] + place->offset[a] + way * place->direction[a] / place->direction[axis];
      }
      path_.push_back(*place);
    }
  }
  constexpr double as_positions = 4;  // the time of a layer
  visited_ += as_positions * static_cast<double>(path_.size());
  std::sort(path_.begin(), path_.end(),
            [](const Place& a, const Place& b) { return a.depth < b.depth; });
}

Medium RayKernels::medium(const Group& group, const Index& i) const {
  const Index sample = sample_of(*group.layers, i);
  if (group.layers->media.size() == scene_.scalars.size()) return samples_.medium(sample);
  Medium out;  // with strides samples are not merged
  for (const scene::ScalarLayer* layer : group.layers->media) {
    out.add(*layer, layer->field->values[samples_.number(sample)], 1,
            samples_.brightness(*layer, sample));
  }
  return out;
}

double RayKernels::half_line(const Group& group, const Index& i) const {
  const scene::VectorLayer& layer = *group.lines;
  const std::size_t number = samples_.vector_number(sample_of(*group.layers, i));
  const double magnitude = magnitude_of(*layer.field, number);
  if (!(magnitude > 0) || magnitude < layer.min_magnitude) return 0;
  const double full = layer.magnitude_range[1];
  return 0.5 * layer.length * (full > 0 ? std::min(1.0, magnitude / full) : 1);
}

bool RayKernels::meets(const Index& near, const PictureRay& ray) {
  for (const Group& group : groups_) {
    find_path(group, near, ray);
    for (const Place& place : path_) {
      // Kernels reach beyond their centres, which are up to a cell beside the ray.
      const double reach = 2 * reference::footprint_t / reference::length(place.direction) +
                           (group.lines != nullptr ? 0.5 * group.lines->length : 0);
      if (view_.perspective && place.depth + reach <= view_.near) continue;
      if (is_drawn_beside(group, place)) return true;
    }
  }
  return false;
}

bool RayKernels::is_drawn_beside(const Group& group, const Place& place) {
  constexpr double cells_most = 3;
  double reach = 1;
  if (group.lines != nullptr) {
    const double narrowest = *std::min_element(place.edges.begin(), place.edges.end());
    reach = std::clamp(std::ceil(0.5 * group.lines->length / narrowest), 1.0, cells_most);
  }
  Index low = place.at;
  Index high = place.at;
  visited_ += 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (a == place.axis) continue;
    if (std::abs(place.offset[a]) > reach) return false;  // beside the lattice
    low[a] = std::max(0, place.at[a] - static_cast<int>(reach));
    high[a] = std::min(group.count(a) - 1, place.at[a] + static_cast<int>(reach));
  }
  Index i{};
  for (i[2] = low[2]; i[2] <= high[2]; ++i[2]) {
    for (i[1] = low[1]; i[1] <= high[1]; ++i[1]) {
      for (i[0] = low[0]; i[0] <= high[0]; ++i[0]) {
        if (!group.layers->media.empty() && medium(group, i).extinction > 0) return true;
        if (group.lines != nullptr && half_line(group, i) > 0) return true;
      }
    }
  }
  return false;
}

const std::vector<const RayKernel*>* RayKernels::around(const Index& near,
                                                        const std::vector<PictureRay>& rays,
                                                        double wide) {
  found_.clear();
  const double before = visited_;
  Bundle bundle;
  bundle.rays = &rays;
  bundle.wide = wide;
  bundle.low = bundle.high = {rays.front().x, rays.front().y};
  for (const PictureRay& ray : rays) {
    bundle.low = {std::min(bundle.low[0], ray.x), std::min(bundle.low[1], ray.y)};
    bundle.high = {std::max(bundle.high[0], ray.x), std::max(bundle.high[1], ray.y)};
    bundle.apart =
        std::max(bundle.apart, std::hypot(ray.x - rays.front().x, ray.y - rays.front().y));
  }
  for (const Group& group : groups_) {
    find_path(group, near, rays.front());
    bundle.passed.assign(std::min(rays.size(), probes_most), 1);
    int behind = 0;  // layers since all became opaque
    for (const Place& place : path_) {
      if (!add_layer(group, place, bundle)) return nullptr;
      if (visited_ - before > bundle_positions_most) return nullptr;
      if (found_.size() >= kernels_most) break;
      const double most = *std::max_element(bundle.passed.begin(), bundle.passed.end());
      if (most < opaque_below && ++behind > bundle.cells) break;
    }
  }
  ordered_.clear();
  for (const RayKernel& kernel : found_) ordered_.push_back(&kernel);
  std::sort(ordered_.begin(), ordered_.end(),
            [](const RayKernel* a, const RayKernel* b) { return a->key < b->key; });
  return &ordered_;
}

bool RayKernels::add_layer(const Group& group, const Place& place, Bundle& bundle) {
  const double pixel = view_.pixel * (view_.perspective ? std::max(place.depth, view_.near) : 1);
  // Of kernels whose centre is beside the ray, in cells along an axis whose cells are `edge` wide.
  const auto reach_by = [&](double edge) {
    double own = group.layers->media.empty() ? 0 : reference::footprint_t;
    if (group.lines != nullptr) {
      const double moved =
          half_diagonal * (group.lines->jitter_center + group.lines->jitter_stride);
      const double half =
          std::min(0.5 * group.lines->length / edge, half_diagonal * group.lines->span);
      own = std::max(own, half + moved + bundle.wide * pixel / edge);
    }
    return own + bundle.apart * pixel / edge;
  };
  double narrowest = 1e300;
  for (std::size_t a = 0; a < 3; ++a) {
    if (group.count(a) > 1) narrowest = std::min(narrowest, place.edges[a]);
  }
  if (narrowest > 1e299) narrowest = place.edges[place.axis];
  bundle.cells = std::max(bundle.cells, reach_by(narrowest));
  // In units of the reach along each axis.
  Vec reach{};
  Vec d{};
  for (std::size_t a = 0; a < 3; ++a) {
    reach[a] = reach_by(group.count(a) > 1 ? place.edges[a] : narrowest);
    d[a] = place.direction[a] / reach[a];
  }
  const double d2 = dot(d, d);
  const double slant = std::sqrt(d2) / std::abs(d[place.axis]);
  Index low = place.at;
  Index high = place.at;
  double positions = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (a == place.axis) continue;
    const double middle = place.at[a] + place.offset[a];
    const double most = group.count(a) - 1.0;
    const double from = std::clamp(std::ceil(middle - reach[a] * slant), 0.0, most + 1);
    const double to = std::clamp(std::floor(middle + reach[a] * slant), -1.0, most);
    positions *= std::max(0.0, to - from + 1);
    if (!(positions <= positions_most)) return false;
    low[a] = static_cast<int>(from);
    high[a] = static_cast<int>(to);
  }
  visited_ += positions;
  const double cells2 = dot(place.direction, place.direction);
  Index i{};
  for (i[2] = low[2]; i[2] <= high[2]; ++i[2]) {
    for (i[1] = low[1]; i[1] <= high[1]; ++i[1]) {
      for (i[0] = low[0]; i[0] <= high[0]; ++i[0]) {
        Vec off{};
        Vec scaled{};
        for (std::size_t a = 0; a < 3; ++a) {
          if (a != place.axis) off[a] = i[a] - place.at[a] - place.offset[a];
          scaled[a] = off[a] / reach[a];
        }
        const double along = dot(scaled, d);
        if (dot(scaled, scaled) - along * along / d2 > 1) continue;
        const double passed = dot(off, place.direction);
        const double away2 = dot(off, off) - passed * passed / cells2;
        add(group, i, place, std::sqrt(std::max(away2, 0.0)) - bundle.apart * pixel / narrowest,
            bundle);
      }
    }
  }
  return true;
}

void RayKernels::add(const Group& group, const Index& i, const Place& place, double away,
                     Bundle& bundle) {
  double half = group.lines != nullptr ? half_line(group, i) : 0;
  if (half > 0) {
    const double pixel = view_.pixel * (view_.perspective ? std::max(place.depth, view_.near) : 1);
    const double narrowest = *std::min_element(place.edges.begin(), place.edges.end());
    const double moved = half_diagonal * (group.lines->jitter_center + group.lines->jitter_stride);
    const double most = std::min(half / narrowest, half_diagonal * group.lines->span) + moved +
                        bundle.wide * pixel / narrowest;
    if (away > most) half = 0;
  }
  Medium here;
  if (!group.layers->media.empty() && away < reference::footprint_t) here = medium(group, i);
  if (half <= 0 && !(here.extinction > 0)) return;
  const reference::KernelPosition at = position(group, i);
  if (!at.has_cell) return;
  RayKernel kernel;
  if (half > 0) kernel.line = reference::make_ribbon(scene_, view_, *group.lines, at);
  if (kernel.line) {
    const std::size_t number = samples_.vector_number(sample_of(*group.layers, i));
    kernel.weak = magnitude_of(*group.lines->field, number) < marked_.magnitude;
    kernel.box = reference::ribbon_box(*kernel.line);
    const bool aside = kernel.box.x0 > bundle.high[0] || kernel.box.x1 < bundle.low[0] ||
                       kernel.box.y0 > bundle.high[1] || kernel.box.y1 < bundle.low[1];
    if (aside) kernel.line.reset();
  }
  if (here.extinction > 0 && reference::lies_beyond_near(view_, at)) {
    const glm::dvec3 color = here.color();
    kernel.splat = {at.from_eye, at.inverse, here.extinction, {color.x, color.y, color.z}};
    Vec along{};
    double longest = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      along[a] = dot(view_.forward, at.edge[a]);
      longest = std::max(longest, reference::length(at.edge[a]));
    }
    kernel.thin = here.extinction * longest < marked_.optical_depth * reference::footprint_integral;
    const double depth = reference::footprint_t * reference::length(along);
    kernel.near = view_.perspective && at.centre[2] - 2 * depth < view_.near;
  }
  if (!kernel.line && kernel.splat.rho <= 0) return;
  kernel.key = group.order.key(i, at);
  pass(kernel, bundle);
  found_.push_back(kernel);
}

void RayKernels::pass(const RayKernel& kernel, Bundle& bundle) const {
  const std::size_t count = bundle.passed.size();
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t at = count > 1 ? n * (bundle.rays->size() - 1) / (count - 1) : 0;
    const PictureRay& ray = (*bundle.rays)[at];
    if (kernel.splat.rho > 0 && !kernel.thin) {
      const SplatOnRay on = splat_on_ray(kernel.splat, ray);
      const double unseen = view_.perspective ? part_before(on, view_.near) : 0;
      bundle.passed[n] *= std::exp(-on.tau * (1 - unseen));
    }
    if (kernel.line && !kernel.weak) {
      bundle.passed[n] *= 1 - reference::hit_ribbon(*kernel.line, ray.x, ray.y).opacity;
    }
  }
}

}  // namespace windsplat::frame
