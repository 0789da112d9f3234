// Samples -> a rectilinear grid -> its sunlight -> the samples.
#include "server/light/curved.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <memory>

#include "server/base/check.hpp"
#include "server/base/thread_pool.hpp"
#include "server/light/sunlight.hpp"

namespace windsplat::light {

namespace {

using scene::Lattice;
using scene::SampleFactors;

using Index = std::array<int, 3>;

constexpr std::uint64_t points_least = 32768;

std::uint64_t points_most(std::uint64_t samples) { return std::max(2 * samples, points_least); }

std::size_t product(const Index& dims) {
  return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
         static_cast<std::size_t>(dims[2]);
}

class Cells {
 public:
  explicit Cells(const Lattice& lattice) : lattice_(lattice) {}

  [[nodiscard]] std::size_t number(const Index& i) const {
    const auto x = static_cast<std::size_t>(lattice_.dims[0]);
    const auto y = static_cast<std::size_t>(lattice_.dims[1]);
    return static_cast<std::size_t>(i[0]) +
           x * (static_cast<std::size_t>(i[1]) + y * static_cast<std::size_t>(i[2]));
  }
  [[nodiscard]] glm::dvec3 place(std::size_t n) const {
    const auto& p = (*lattice_.places)[n];
    return {p[0], p[1], p[2]};
  }

  // The edges of a cell, as columns; along an axis of one sample perpendicular to the others.
  [[nodiscard]] glm::dmat3 edges(const Index& at) const {
    glm::dmat3 out(0);
    std::array<bool, 3> known{};
    for (int a = 0; a < 3; ++a) {
      const auto axis = static_cast<std::size_t>(a);
      if (lattice_.dims[axis] == 1) continue;
      Index before = at;
      Index after = at;
      before[axis] = std::max(at[axis] - 1, 0);
      after[axis] = std::min(at[axis] + 1, lattice_.dims[axis] - 1);
      int steps = after[axis] - before[axis];
      if (a == 0 && lattice_.around > 0) {
        before[0] = (at[0] + lattice_.around - 1) % lattice_.around;
        after[0] = (at[0] + 1) % lattice_.around;
        steps = 2;
      }
      out[a] = (place(number(after)) - place(number(before))) / static_cast<double>(steps);
      known[axis] = true;
    }
    for (int a = 0; a < 3; ++a) {
      const auto axis = static_cast<std::size_t>(a);
      if (known[axis]) continue;
      glm::dvec3 along = glm::cross(out[(a + 1) % 3], out[(a + 2) % 3]);
      if (!(glm::length(along) > 0)) {
        along = glm::dvec3(0);
        along[a] = 1;
      }
      out[a] = lattice_.spacing[axis].front() * glm::normalize(along);
      known[axis] = true;
    }
    return out;
  }

  // Calls visit(number, index) for the samples that are drawn, until it is cancelled.
  template <class Visit>
  void each(const CancelToken& cancel, const Visit& visit) const {
    Index i{};
    for (i[2] = 0; i[2] < lattice_.dims[2]; ++i[2]) {
      for (i[1] = 0; i[1] < lattice_.dims[1]; ++i[1]) {
        if (cancel.cancelled()) return;
        for (i[0] = 0; i[0] < lattice_.drawn(0); ++i[0]) visit(number(i), i);
      }
    }
  }

 private:
  const Lattice& lattice_;
};

}  // namespace

Lattice even_grid(const Index& dims, const glm::dvec3& first, const glm::dvec3& cell) {
  Lattice grid;
  grid.dims = dims;
  for (int c = 0; c < 3; ++c) {
    const auto axis = static_cast<std::size_t>(c);
    for (int i = 0; i < dims[axis]; ++i) grid.positions[axis].push_back(first[c] + i * cell[c]);
    grid.spacing[axis].assign(grid.positions[axis].size(), cell[c]);
    grid.box_min[c] = first[c] - 0.5 * cell[c];
    grid.box_max[c] = first[c] + (dims[axis] - 0.5) * cell[c];
  }
  return grid;
}

// A rectilinear lattice of even cells around all cells.
Lattice grid_around(const Lattice& lattice, const CancelToken& cancel) {
  WINDSPLAT_CHECK(lattice.places != nullptr);
  const Cells cells(lattice);
  const std::size_t samples = lattice.places->size();
  glm::dvec3 low(1e300);
  glm::dvec3 high(-1e300);
  glm::dvec3 width(0);
  std::size_t count = 0;
  cells.each(cancel, [&](std::size_t n, const Index& i) {
    const glm::dmat3 edges = cells.edges(i);
    const glm::dvec3 at = cells.place(n);
    glm::dvec3 reach(0);
    for (int c = 0; c < 3; ++c) {
      double widest = 0;
      for (int a = 0; a < 3; ++a) {
        reach[c] += 0.5 * std::abs(edges[a][c]);
        widest = std::max(widest, std::abs(edges[a][c]));
      }
      width[c] += widest;
    }
    low = glm::min(low, at - reach);
    high = glm::max(high, at + reach);
    ++count;
  });
  if (cancel.cancelled()) return even_grid({1, 1, 1}, glm::dvec3(0), glm::dvec3(1));
  WINDSPLAT_CHECK(count > 0);
  const glm::dvec3 box = high - low;
  const double edge = std::max({box.x, box.y, box.z});
  double points = 1;
  for (int c = 0; c < 3; ++c) {
    width[c] = std::clamp(width[c] / static_cast<double>(count), 1e-4 * edge, edge);
    points *= box[c] / width[c] + 2;
  }
  const double scale = std::max(1.0, std::cbrt(points / static_cast<double>(points_most(samples))));
  Index dims{};
  glm::dvec3 first;
  const glm::dvec3 cell = scale * width;
  for (int c = 0; c < 3; ++c) {
    // A cell more at both ends, so that every sample lies between points.
    const int cells_inside = std::max(1, static_cast<int>(std::ceil(box[c] / cell[c])));
    dims[static_cast<std::size_t>(c)] = cells_inside + 2;
    first[c] = 0.5 * (low[c] + high[c]) - 0.5 * (cells_inside + 1) * cell[c];
  }
  return even_grid(dims, first, cell);
}

namespace {

struct Weighted {
  float weight = 0;
  float extinction = 0;  // times the weights
};

// The points of a grid near a cell, in layers [from, to) along z.
template <class Visit>
void each_point(const Lattice& grid, const glm::dvec3& at, const glm::dmat3& edges, int from,
                int to, const Visit& visit) {
  Index low{};
  Index high{};
  for (int c = 0; c < 3; ++c) {
    const auto axis = static_cast<std::size_t>(c);
    const double cell = grid.spacing[axis].front();
    const double reach = std::abs(edges[0][c]) + std::abs(edges[1][c]) + std::abs(edges[2][c]);
    const double place = at[c] - grid.positions[axis].front();
    low[axis] = std::max(0, static_cast<int>(std::ceil((place - reach) / cell)));
    high[axis] =
        std::min(grid.dims[axis] - 1, static_cast<int>(std::floor((place + reach) / cell)));
  }
  low[2] = std::max(low[2], from);
  high[2] = std::min(high[2], to - 1);
  if (low[2] > high[2]) return;
  const glm::dmat3 to_cell = glm::inverse(edges);
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      const std::size_t row =
          static_cast<std::size_t>(grid.dims[0]) *
          (static_cast<std::size_t>(j) +
           static_cast<std::size_t>(grid.dims[1]) * static_cast<std::size_t>(k));
      for (int i = low[0]; i <= high[0]; ++i) {
        const glm::dvec3 point{grid.positions[0][static_cast<std::size_t>(i)],
                               grid.positions[1][static_cast<std::size_t>(j)],
                               grid.positions[2][static_cast<std::size_t>(k)]};
        const glm::dvec3 off = glm::abs(to_cell * (point - at));
        if (off.x >= 1 || off.y >= 1 || off.z >= 1) continue;
        visit(row + static_cast<std::size_t>(i), (1 - off.x) * (1 - off.y) * (1 - off.z));
      }
    }
  }
}

// Lengthens edges that are shorter than those of the cells of the grid, whose points would see some
// of such cells and miss others. Returns how many times larger the cell is then.
double widen(const Lattice& grid, glm::dmat3& edges) {
  double larger = 1;
  for (int a = 0; a < 3; ++a) {
    double widths = 0;  // of the grid
    for (int c = 0; c < 3; ++c) {
      const double cell = grid.spacing[static_cast<std::size_t>(c)].front();
      widths = std::max(widths, std::abs(edges[a][c]) / cell);
    }
    if (!(widths > 0 && widths < 1)) continue;
    edges[a] /= widths;
    larger /= widths;
  }
  return larger;
}

// Extinctions at the points of the grid; each is summed in the order of the samples.
std::vector<float> spread(const Lattice& lattice, const Cells& cells,
                          const std::vector<float>& extinctions, const Lattice& grid,
                          const CancelToken& cancel) {
  std::vector<Weighted> points(product(grid.dims));
  const auto pool = few_threads(points.size() / 65536);
  const int parts = static_cast<int>(pool->size());
  pool->run(static_cast<std::size_t>(parts), [&](std::size_t part, unsigned) {
    const int from = grid.dims[2] * static_cast<int>(part) / parts;
    const int to = grid.dims[2] * (static_cast<int>(part) + 1) / parts;
    cells.each(cancel, [&](std::size_t n, const Index& i) {
      glm::dmat3 edges = cells.edges(i);
      const double upright = glm::length(edges[0]) * glm::length(edges[1]) * glm::length(edges[2]);
      if (!(std::abs(glm::determinant(edges)) > 1e-6 * upright)) return;  // at a pole
      const double share = 1 / widen(grid, edges);
      each_point(grid, cells.place(n), edges, from, to, [&](std::size_t at, double weight) {
        points[at].weight += static_cast<float>(share * weight);
        points[at].extinction += static_cast<float>(share * weight) * extinctions[n];
      });
    });
  });
  std::vector<float> out;
  out.reserve(points.size());
  for (const Weighted& point : points) {
    out.push_back(point.extinction / std::max(point.weight, 1.0F));
  }
  if (!(lattice.inner_radius > 0)) return out;
  double widest = 0;
  for (const auto& spacing : grid.spacing) widest = std::max(widest, spacing.front());
  const double radius = std::max(0.0, lattice.inner_radius - 2 * widest);
  std::size_t n = 0;
  for (const double z : grid.positions[2]) {
    for (const double y : grid.positions[1]) {
      for (const double x : grid.positions[0]) {
        if (x * x + y * y + z * z < radius * radius) out[n] = 1e30F;
        ++n;
      }
    }
  }
  return out;
}

// Trilinear.
double interpolated(const Lattice& grid, const SampleFactors& factors, const glm::dvec3& at) {
  Index low{};
  glm::dvec3 part;
  for (int c = 0; c < 3; ++c) {
    const auto axis = static_cast<std::size_t>(c);
    const double place = (at[c] - grid.positions[axis].front()) / grid.spacing[axis].front();
    low[axis] = std::clamp(static_cast<int>(std::floor(place)), 0, grid.dims[axis] - 2);
    part[c] = std::clamp(place - low[axis], 0.0, 1.0);
  }
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double share = 1;
    std::size_t n = 0;
    for (int c = 2; c >= 0; --c) {
      const auto axis = static_cast<std::size_t>(c);
      const unsigned next = corner >> static_cast<unsigned>(c) & 1U;
      share *= next != 0 ? part[c] : 1 - part[c];
      n = n * static_cast<std::size_t>(grid.dims[axis]) + static_cast<std::size_t>(low[axis]) +
          next;
    }
    sum += share * static_cast<double>(factors[n]);
  }
  return sum;
}

}  // namespace

std::uint64_t curved_working_bytes(std::uint64_t samples) {
  return points_most(samples) *
         (sizeof(Weighted) + sizeof(float) + sizeof(SampleFactors::value_type));
}

SampleFactors curved_sunlight(const Lattice& lattice, const std::vector<float>& extinctions,
                              const glm::dvec3& sun, const CancelToken& cancel) {
  const Lattice grid = grid_around(lattice, cancel);
  if (cancel.cancelled()) return {};
  return sunlight_at_samples(lattice, grid, grid_sunlight(lattice, extinctions, grid, sun, cancel));
}

SampleFactors grid_sunlight(const Lattice& lattice, const std::vector<float>& extinctions,
                            const Lattice& grid, const glm::dvec3& sun, const CancelToken& cancel) {
  return sunlight(grid, spread(lattice, Cells(lattice), extinctions, grid, cancel), sun, cancel);
}

double below_ground(const Lattice& lattice, const Lattice& grid, const glm::dvec3& sun) {
  const int axis = layer_axis(grid, sun);
  const double cell = grid.spacing[static_cast<std::size_t>(axis)].front();
  const double share = lattice.inner_radius > 0 ? 0.5 : 1;
  return share * cell / std::max(std::abs(sun[axis]), 0.1);
}

SampleFactors sunlight_at_samples(const Lattice& lattice, const Lattice& grid,
                                  const SampleFactors& at_points) {
  WINDSPLAT_CHECK(lattice.places != nullptr);
  const Cells cells(lattice);
  SampleFactors out(lattice.places->size());
  constexpr std::size_t block = 4096;
  const std::size_t blocks = (out.size() + block - 1) / block;
  const auto pool = few_threads(blocks / 8);
  pool->run(blocks, [&](std::size_t number, unsigned) {
    const std::size_t end = std::min(out.size(), (number + 1) * block);
    for (std::size_t n = number * block; n < end; ++n) {
      out[n] =
          static_cast<std::uint16_t>(std::lround(interpolated(grid, at_points, cells.place(n))));
    }
  });
  return out;
}

}  // namespace windsplat::light
