#include "server/light/relief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <memory>

#include "server/base/thread_pool.hpp"

namespace windsplat::light {

namespace {

using Index = std::array<int, 3>;

class Slopes {
 public:
  Slopes(const scene::Lattice& lattice, const scene::ScalarLayer& layer, const glm::dvec3& sun)
      : lattice_(lattice),
        field_(*layer.field),
        width_(layer.color.range[1] - layer.color.range[0]),
        sun_(sun) {}

  [[nodiscard]] double factor(const Index& at) const {
    constexpr double faint = 0.01;
    const double own = value(at);
    if (std::isnan(own) || !(width_ > 0)) return 1;
    glm::dmat3 edges(1);
    glm::dvec3 rise(0);
    for (int a = 0; a < 3; ++a) add_slope(at, own, a, edges[a], rise[a]);
    const double volume = glm::determinant(edges);
    const double upright = glm::length(edges[0]) * glm::length(edges[1]) * glm::length(edges[2]);
    if (!(std::abs(volume) > 1e-6 * upright)) return 1;
    const glm::dvec3 gradient = glm::transpose(glm::inverse(edges)) * rise;
    const double length = glm::length(gradient);
    const double change2 = glm::dot(rise, rise) / (width_ * width_);
    if (!(length > 0) || !std::isfinite(length)) return 1;
    const double facing = std::abs(glm::dot(gradient, sun_)) / length;
    const double share = change2 / (change2 + faint * faint);
    return 1 - share * (1 - std::min(facing, 1.0));
  }

 private:
  [[nodiscard]] std::size_t number(const Index& i) const {
    const auto x = static_cast<std::size_t>(lattice_.dims[0]);
    const auto y = static_cast<std::size_t>(lattice_.dims[1]);
    return static_cast<std::size_t>(i[0]) +
           x * (static_cast<std::size_t>(i[1]) + y * static_cast<std::size_t>(i[2]));
  }

  // Of a sample of a coarser level the mean of its two values.
  [[nodiscard]] double value(const Index& i) const {
    using Two = data::TwoValues;
    const std::size_t n = number(i);
    if (field_.components == 1) return field_.values[n];
    const double low = field_.component(Two::low_share)[n];
    const double high = field_.component(Two::high_share)[n];
    const double below = low > 0 ? low * field_.component(Two::low)[n] : 0;
    const double above = high > 0 ? high * field_.component(Two::high)[n] : 0;
    return (below + above) / (low + high);
  }

  [[nodiscard]] glm::dvec3 place(const Index& i) const {
    if (lattice_.places) {
      const auto& p = (*lattice_.places)[number(i)];
      return {p[0], p[1], p[2]};
    }
    glm::dvec3 out;
    for (int a = 0; a < 3; ++a) {
      const auto axis = static_cast<std::size_t>(a);
      out[a] = lattice_.positions[axis][static_cast<std::size_t>(i[axis])];
    }
    return out;
  }

  // A neighbour along an axis, or the sample itself at an end and beside a masked one.
  [[nodiscard]] Index beside(const Index& at, int axis, int step) const {
    const auto a = static_cast<std::size_t>(axis);
    Index next = at;
    next[a] += step;
    const int around = axis == 0 ? lattice_.around : 0;
    if (around > 0) next[a] = (next[a] + around) % around;
    if (next[a] < 0 || next[a] >= lattice_.dims[a] || std::isnan(value(next))) return at;
    return next;
  }

  // The vector to the next sample along an axis, and the change of the field over it.
  void add_slope(const Index& at, double own, int axis, glm::dvec3& edge, double& rise) const {
    const Index before = beside(at, axis, -1);
    const Index after = beside(at, axis, 1);
    const int steps = (before != at ? 1 : 0) + (after != at ? 1 : 0);
    if (steps == 0) return;
    const double low = before == at ? own : value(before);
    const double high = after == at ? own : value(after);
    edge = (place(after) - place(before)) / static_cast<double>(steps);
    rise = (high - low) / steps;
  }

  const scene::Lattice& lattice_;
  const data::Volume& field_;
  double width_;
  glm::dvec3 sun_;
};

}  // namespace

scene::SampleFactors relief(const scene::Lattice& lattice, const scene::ScalarLayer& layer,
                            const glm::dvec3& sun) {
  const Slopes slopes(lattice, layer, sun);
  const auto nx = static_cast<std::size_t>(lattice.dims[0]);
  const auto ny = static_cast<std::size_t>(lattice.dims[1]);
  const std::size_t rows = ny * static_cast<std::size_t>(lattice.dims[2]);
  scene::SampleFactors out(nx * rows);
  constexpr std::size_t samples_a_thread = 16384;
  const auto pool = few_threads(out.size() / samples_a_thread);
  pool->run(rows, [&](std::size_t row, unsigned) {
    Index at{0, static_cast<int>(row % ny), static_cast<int>(row / ny)};
    for (std::size_t i = 0; i < nx; ++i) {
      at[0] = static_cast<int>(i);
      out[nx * row + i] =
          static_cast<std::uint16_t>(std::lround(scene::full_factor * slopes.factor(at)));
    }
  });
  return out;
}

}  // namespace windsplat::light
