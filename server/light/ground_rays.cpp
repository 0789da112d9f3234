// Rays from the ground to the sun, through one layer of cells after the other.
#include "server/light/ground_rays.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "server/base/check.hpp"
#include "server/base/thread_pool.hpp"

namespace windsplat::light {

namespace {

constexpr double lowest_sun = 1e-9;  // its z: a ray along the ground passes all of the lowest layer
constexpr double pieces_most = 4096;  // in a layer
constexpr double opaque_depth = 20;   // optical depth, beyond which factors are 0

// A ray along a horizontal axis.
struct RayAlong {
  const std::vector<double>* positions = nullptr;
  double low = 0, high = 0;  // faces of the box
  double slope = 0;          // displacement for each unit up
  double pitch = 1;          // of the pieces
  double from = 0;           // where the ray meets the ground
  std::size_t near = 0;      // sample below the ray, or the last but one
  double part = 0;           // share of the next sample

  // The height above the ground at which the ray leaves the box.
  [[nodiscard]] double leaves() const {
    if (slope == 0) return std::numeric_limits<double>::infinity();
    return std::max(0.0, ((slope > 0 ? high : low) - from) / slope);
  }
  // `near` is where the search begins.
  void go_to(double height) {
    const double at = from + slope * height;
    const std::vector<double>& p = *positions;
    while (near > 0 && p[near] > at) --near;
    while (near + 2 < p.size() && p[near + 1] <= at) ++near;
    part = p.size() > 1 ? std::clamp((at - p[near]) / (p[near + 1] - p[near]), 0.0, 1.0) : 0;
  }
};

RayAlong ray_along(const scene::Lattice& lattice, std::size_t axis, double slope) {
  RayAlong to;
  to.positions = &lattice.positions.at(axis);
  const std::vector<double>& spacing = lattice.spacing.at(axis);
  to.low = to.high = lattice.box_min[static_cast<glm::length_t>(axis)];
  for (const double width : spacing) to.high += width;
  const double mean = (to.high - to.low) / static_cast<double>(spacing.size());
  to.pitch = std::max(*std::min_element(spacing.begin(), spacing.end()), 0.25 * mean);
  to.slope = slope;
  return to;
}

// The extinctions of one layer of samples.
struct GroundLayer {
  const float* values = nullptr;
  std::size_t row = 0;

  [[nodiscard]] double at(const RayAlong& x, const RayAlong& y) const {
    const float* const first = values + y.near * row + x.near;
    const float* const second = y.part > 0 ? first + row : first;
    const std::size_t next = x.part > 0 ? 1 : 0;
    const auto between = [](float p, float q, double part) {
      return (1 - part) * static_cast<double>(p) + part * static_cast<double>(q);
    };
    return (1 - y.part) * between(first[0], first[next], x.part) +
           y.part * between(second[0], second[next], x.part);
  }
};

// The optical depth of a ray.
double depth_of_ray(const scene::Lattice& lattice, const std::vector<float>& extinctions,
                    double way, RayAlong& x, RayAlong& y) {
  const auto row = static_cast<std::size_t>(lattice.dims[0]);
  const std::size_t layer = row * static_cast<std::size_t>(lattice.dims[1]);
  const double top = std::min(x.leaves(), y.leaves());
  const double steep = std::max(std::abs(x.slope) / x.pitch, std::abs(y.slope) / y.pitch);
  double sum = 0;
  double low = 0;
  for (std::size_t k = 0; k < lattice.spacing[2].size() && low < top && sum < opaque_depth; ++k) {
    const double face = low + lattice.spacing[2][k];
    const double high = std::min(face, top);
    const auto pieces =
        static_cast<std::int64_t>(std::clamp(std::ceil(steep * (high - low)), 1.0, pieces_most));
    const double piece = (high - low) / static_cast<double>(pieces);
    const GroundLayer values{extinctions.data() + k * layer, row};
    for (std::int64_t n = 0; n < pieces; ++n) {
      const double middle = low + (static_cast<double>(n) + 0.5) * piece;
      x.go_to(middle);
      y.go_to(middle);
      sum += values.at(x, y) * piece * way;
    }
    low = face;
  }
  return sum;
}

}  // namespace

scene::SampleFactors ground_sunlight(const scene::Lattice& lattice,
                                     const std::vector<float>& extinctions, const glm::dvec3& sun,
                                     const CancelToken& cancel) {
  WINDSPLAT_CHECK(lattice.places == nullptr);
  const double up = std::max(sun.z, lowest_sun);
  const RayAlong x_axis = ray_along(lattice, 0, sun.x / up);
  const RayAlong y_axis = ray_along(lattice, 1, sun.y / up);
  const std::vector<double>& xs = lattice.positions[0];
  const std::vector<double>& ys = lattice.positions[1];
  scene::SampleFactors out(xs.size() * ys.size());
  constexpr std::size_t samples_a_thread = 65536;
  const auto pool = few_threads(extinctions.size() / samples_a_thread);
  pool->run(ys.size(), [&](std::size_t j, unsigned) {
    RayAlong x = x_axis;
    RayAlong y = y_axis;
    y.from = ys[j];
    if (cancel.cancelled()) return;
    for (std::size_t i = 0; i < xs.size(); ++i) {
      x.from = xs[i];
      const double depth = depth_of_ray(lattice, extinctions, 1 / up, x, y);
      out[j * xs.size() + i] =
          static_cast<std::uint16_t>(std::lround(scene::full_factor * std::exp(-depth)));
    }
  });
  return out;
}

}  // namespace windsplat::light
