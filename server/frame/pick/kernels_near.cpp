// Distances of samples from the ray, against upper bounds of how far kernels reach.
#include "server/frame/pick/kernels_near.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;
using reference::dot;
using reference::plus;
using Axis = std::vector<reference::AxisPosition>;

// How far the kernels of a sample reach: `cells` times the root of the sum of the squared edges of
// its cell, and `beyond` world units.
struct Reach {
  double cells = 0;
  double beyond = 0;
};

// Distance of the farthest corner of the box from the eye, world units.
double farthest(const scene::Scene& scene) {
  const glm::dvec3& low = scene.lattice.box_min;
  const glm::dvec3& high = scene.lattice.box_max;
  const glm::dvec3& eye = scene.camera.eye;
  double sum = 0;
  for (int a = 0; a < 3; ++a) {
    sum += std::pow(std::max(std::abs(low[a] - eye[a]), std::abs(high[a] - eye[a])), 2);
  }
  return std::sqrt(sum);
}

Reach reach_of(const scene::Scene& scene, const reference::View& view,
               const reference::LayerGroup& layers) {
  Reach out;
  if (!layers.media.empty()) out.cells = reference::footprint_t;
  if (layers.lines == nullptr) return out;
  // Components of the displacement are at most half of these, in edges.
  const double jitter = 0.5 * (layers.lines->jitter_center + layers.lines->jitter_stride);
  out.cells = std::max(out.cells, std::numbers::sqrt3 * jitter);
  const double half_line = 0.5 * layers.lines->length;
  const double depth = view.perspective ? farthest(scene) + half_line : 1;
  out.beyond = half_line + scene::outer_radius(*layers.lines) * view.pixel * depth;
  return out;
}

// A ray as a unit direction; vectors from its origin -> their part across it.
class Across {
 public:
  Across(const reference::View& view, const PictureRay& ray)
      : from_(plus(view.eye, 1, ray.origin)),
        along_(reference::scaled(ray.direction, 1 / reference::length(ray.direction))) {}

  [[nodiscard]] Vec of(const Vec& v) const { return plus(v, -dot(v, along_), along_); }
  [[nodiscard]] Vec of_place(const Vec& place) const { return of(plus(place, -1, from_)); }

 private:
  Vec from_;
  Vec along_;
};

// Rows of a rectilinear lattice are straight: the squared distance is a polynomial of x.
class StraightRows {
 public:
  StraightRows(const scene::Scene& scene, const Axis& x, const Reach& reach, const Across& across)
      : lattice_(scene.lattice), reach_(reach), across_(across), per_x_(across.of({1, 0, 0})) {
    for (const auto& one : x) {
      at_.push_back(lattice_.positions[0][static_cast<std::size_t>(one.sample)]);
      widest_ = std::max(widest_, one.cell);
    }
  }

  // Numbers of the positions along x that may be met: the first, and the one after the last.
  [[nodiscard]] std::array<std::size_t, 2> met(const reference::AxisPosition& y,
                                               const reference::AxisPosition& z) const {
    const Vec start = across_.of_place({0, at(1, y), at(2, z)});
    const double cell2 = widest_ * widest_ + y.cell * y.cell + z.cell * z.cell;
    const double reach = reach_.cells * std::sqrt(cell2) + reach_.beyond;
    const double a = dot(per_x_, per_x_);
    const double b = dot(start, per_x_);
    const double c = dot(start, start) - reach * reach;
    if (a < 1e-18) return {0, c <= 0 ? at_.size() : 0};
    const double root2 = b * b - a * c;
    if (root2 < 0) return {0, 0};
    const double root = std::sqrt(root2);
    const auto first = std::lower_bound(at_.begin(), at_.end(), (-b - root) / a);
    const auto last = std::upper_bound(first, at_.end(), (-b + root) / a);
    return {static_cast<std::size_t>(first - at_.begin()),
            static_cast<std::size_t>(last - at_.begin())};
  }

 private:
  [[nodiscard]] double at(std::size_t axis, const reference::AxisPosition& one) const {
    return lattice_.positions[axis][static_cast<std::size_t>(one.sample)];
  }

  const scene::Lattice& lattice_;
  const Reach reach_;
  const Across& across_;
  const Vec per_x_;
  std::vector<double> at_;
  double widest_ = 0;
};

// Samples of a curved lattice, by their neighbours.
class CurvedSamples {
 public:
  CurvedSamples(const scene::Scene& scene, const Reach& reach, const Across& across)
      : lattice_(scene.lattice), reach_(reach), across_(across) {}

  [[nodiscard]] bool is_met(const std::array<reference::AxisPosition, 3>& at) const {
    const Index sample{at[0].sample, at[1].sample, at[2].sample};
    const Vec off = across_.of_place(place(sample));
    double cell2 = 0;
    for (std::size_t a = 0; a < 3; ++a) cell2 += edge2(sample, a) * at[a].samples * at[a].samples;
    const double reach = reach_.cells * std::sqrt(cell2) + reach_.beyond;
    return dot(off, off) <= reach * reach;
  }

 private:
  [[nodiscard]] Vec place(const Index& i) const {
    const auto x = static_cast<std::size_t>(lattice_.dims[0]);
    const auto y = static_cast<std::size_t>(lattice_.dims[1]);
    const auto& at =
        (*lattice_
              .places)[static_cast<std::size_t>(i[0]) +
                       x * (static_cast<std::size_t>(i[1]) + y * static_cast<std::size_t>(i[2]))];
    return {at[0], at[1], at[2]};
  }
  // At most the squared edge of one cell along an axis; see scene::Lattice.
  [[nodiscard]] double edge2(const Index& i, std::size_t a) const {
    const int count = lattice_.dims[a];
    if (count == 1) return lattice_.spacing[a][0] * lattice_.spacing[a][0];
    Index before = i;
    Index after = i;
    before[a] = std::max(i[a] - 1, 0);
    after[a] = std::min(i[a] + 1, count - 1);
    int steps = after[a] - before[a];
    if (a == 0 && lattice_.around > 0) {
      before[a] = (i[a] + lattice_.around - 1) % lattice_.around;
      after[a] = (i[a] + 1) % lattice_.around;
      steps = 2;
    }
    const Vec across = plus(place(after), -1, place(before));
    return dot(across, across) / (steps * steps);
  }

  const scene::Lattice& lattice_;
  const Reach reach_;
  const Across& across_;
};

}  // namespace

bool visit_near(const scene::Scene& scene, const reference::View& view,
                const reference::LayerGroup& layers, const PictureRay& ray,
                const CancelToken& cancel,
                const std::function<void(const reference::KernelPosition&)>& visit) {
  const Across across(view, ray);
  const Reach reach = reach_of(scene, view, layers);
  const auto& [xs, ys, zs] = layers.axis;
  const StraightRows rows(scene, xs, reach, across);
  const CurvedSamples samples(scene, reach, across);
  const bool curved = scene.lattice.places != nullptr;
  for (const auto& z : zs) {
    for (const auto& y : ys) {
      if (cancel.cancelled()) return false;
      std::array<std::size_t, 2> met{0, xs.size()};
      if (!curved) met = rows.met(y, z);
      for (std::size_t n = met[0]; n < met[1]; ++n) {
        const std::array<reference::AxisPosition, 3> at{xs[n], y, z};
        if (curved && !samples.is_met(at)) continue;
        const reference::KernelPosition position = reference::make_kernel_position(scene, view, at);
        if (position.has_cell) visit(position);
      }
    }
  }
  return true;
}

}  // namespace windsplat::frame
