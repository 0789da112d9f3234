// Inverts shape functions with Newton's method, or by division into simplices if that fails.
#include "server/data/formats/vtk/cells.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace windsplat::data::vtk {

namespace {

constexpr int newton_steps = 16;
constexpr double tolerance = 1e-6;
// Margin of the bounding slabs, larger than the tolerance of find_in_cell in three coordinates.
constexpr double slab_slack = 1e-5;
constexpr double rounding_slack = 64 * std::numeric_limits<double>::epsilon();

using Weights = std::array<double, 8>;
using Simplex = std::array<std::uint8_t, 4>;

constexpr std::array<Simplex, 1> triangle_split{{{0, 1, 2, 0}}};
constexpr std::array<Simplex, 2> quad_split{{{0, 1, 2, 0}, {0, 2, 3, 0}}};
constexpr std::array<Simplex, 1> tetra_split{{{0, 1, 2, 3}}};
constexpr std::array<Simplex, 2> pyramid_split{{{0, 1, 2, 4}, {0, 2, 3, 4}}};
constexpr std::array<Simplex, 3> wedge_split{{{0, 1, 2, 5}, {0, 1, 5, 4}, {0, 4, 5, 3}}};
constexpr std::array<Simplex, 6> hexahedron_split{
    {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}}};

std::span<const Simplex> split_of(Shape shape) {
  switch (shape) {
    case Shape::triangle:
      return triangle_split;
    case Shape::quad:
      return quad_split;
    case Shape::tetra:
      return tetra_split;
    case Shape::pyramid:
      return pyramid_split;
    case Shape::wedge:
      return wedge_split;
    case Shape::hexahedron:
      return hexahedron_split;
    case Shape::none:
      break;
  }
  return {};
}

// Shape functions at r, s, t, and their partial derivatives.
struct Basis {
  Weights value{};
  std::array<Weights, 3> slope{};
};

void bilinear(double r, double s, double scale, Basis& out) {
  const std::array<double, 4> along_r{1 - r, r, r, 1 - r};
  const std::array<double, 4> along_s{1 - s, 1 - s, s, s};
  const std::array<double, 4> slope_r{-1, 1, 1, -1};
  const std::array<double, 4> slope_s{-1, -1, 1, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    out.value[i] = along_r[i] * along_s[i] * scale;
    out.slope[0][i] = slope_r[i] * along_s[i] * scale;
    out.slope[1][i] = along_r[i] * slope_s[i] * scale;
  }
}

// The first `count` corners are a face at t = 0, the next `count` the opposite face at t = 1.
void extrude(Basis& out, std::size_t count, double t) {
  for (std::size_t i = 0; i < count; ++i) {
    const double value = out.value[i];
    for (std::size_t d = 0; d < 2; ++d) {
      out.slope.at(d).at(i + count) = out.slope.at(d).at(i) * t;
      out.slope.at(d).at(i) *= 1 - t;
    }
    out.value.at(i + count) = value * t;
    out.value.at(i) = value * (1 - t);
    out.slope[2].at(i + count) = value;
    out.slope[2].at(i) = -value;
  }
}

Basis basis_at(Shape shape, const Point& rst) {
  Basis out;
  const auto [r, s, t] = rst;
  switch (shape) {
    case Shape::quad:
      bilinear(r, s, 1, out);
      break;
    case Shape::hexahedron:
      bilinear(r, s, 1, out);
      extrude(out, 4, t);
      break;
    case Shape::pyramid:
      bilinear(r, s, 1, out);
      for (std::size_t i = 0; i < 4; ++i) {
        out.slope[2].at(i) = -out.value.at(i);
        out.value.at(i) *= 1 - t;
        out.slope[0].at(i) *= 1 - t;
        out.slope[1].at(i) *= 1 - t;
      }
      out.value[4] = t;
      out.slope[2][4] = 1;
      break;
    case Shape::triangle:
    case Shape::wedge:
      out.value = {1 - r - s, r, s};
      out.slope[0] = {-1, 1, 0};
      out.slope[1] = {-1, 0, 1};
      if (shape == Shape::wedge) extrude(out, 3, t);
      break;
    case Shape::tetra:
      out.value = {1 - r - s - t, r, s, t};
      out.slope[0] = {-1, 1, 0, 0};
      out.slope[1] = {-1, 0, 1, 0};
      out.slope[2] = {-1, 0, 0, 1};
      break;
    case Shape::none:
      break;
  }
  return out;
}

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double determinant(const Point& a, const Point& b, const Point& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) +
         c[0] * (a[1] * b[2] - a[2] * b[1]);
}

// Solves x a + y b + z c = right. False if the columns are nearly linearly dependent.
bool solve(const std::array<Point, 3>& columns, const Point& right, Point& out) {
  const auto& [a, b, c] = columns;
  const double whole = determinant(a, b, c);
  double size = 1;
  for (const Point& column : columns) size *= std::hypot(column[0], column[1], column[2]);
  if (!(std::abs(whole) > 1e-12 * size)) return false;
  out = {determinant(right, b, c) / whole, determinant(a, right, c) / whole,
         determinant(a, b, right) / whole};
  return true;
}

bool is_within(Shape shape, const Point& rst) {
  constexpr double low = -tolerance;
  constexpr double high = 1 + tolerance;
  const auto [r, s, t] = rst;
  if (!(r >= low && s >= low && t >= low && r <= high && s <= high && t <= high)) return false;
  if (shape == Shape::triangle || shape == Shape::wedge) return r + s <= high;
  return shape != Shape::tetra || r + s + t <= high;
}

CellPlace place_of(const Point& rst, std::uint8_t split) {
  CellPlace out;
  for (std::size_t d = 0; d < 3; ++d) {
    out.rst[d] = static_cast<float>(std::clamp(rst[d], 0.0, 1.0));
  }
  out.split = split;
  return out;
}

enum class Found { inside, outside, unknown };

Found by_newton(Shape shape, const Corners& corners, const Point& place, CellPlace& out,
                std::uint64_t& steps) {
  const bool flat = dimension_of(shape) == 2;
  const auto count = static_cast<std::size_t>(corners_of(shape));
  const bool linear = shape == Shape::triangle || shape == Shape::tetra;
  Point rst{0.5, 0.5, flat ? 0.0 : 0.5};
  if (linear) rst = {0, 0, 0};
  for (int step = 0; step < newton_steps; ++step) {
    ++steps;
    const Basis basis = basis_at(shape, rst);
    Point rest = place;
    std::array<Point, 3> columns{};
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t d = 0; d < 3; ++d) {
        rest[d] -= basis.value[i] * corners[i][d];
        for (std::size_t c = 0; c < 3; ++c) columns[c][d] += basis.slope[c][i] * corners[i][d];
      }
    }
    if (flat) {
      rest[2] = 0;
      columns[0][2] = columns[1][2] = 0;
      columns[2] = {0, 0, 1};
    }
    Point change{};
    if (!solve(columns, rest, change)) return Found::unknown;
    double most = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      rst[d] += change[d];
      most = std::max(most, std::abs(change[d]));
      if (!(std::abs(rst[d]) < 1e3)) return Found::unknown;
    }
    if (linear || most < 1e-9) {
      if (!is_within(shape, rst)) return Found::outside;
      out = place_of(rst, 0);
      return Found::inside;
    }
  }
  return Found::unknown;
}

// A simplex of a cell as a separate cell.
Corners corners_of_simplex(const Simplex& simplex, const Corners& corners) {
  Corners out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = corners[simplex[i]];
  return out;
}

}  // namespace

int corners_of(Shape shape) {
  constexpr std::array<int, 7> counts{0, 3, 4, 4, 5, 6, 8};
  return counts.at(static_cast<std::size_t>(shape));
}

int dimension_of(Shape shape) {
  if (shape == Shape::none) return 0;
  return shape == Shape::triangle || shape == Shape::quad ? 2 : 3;
}

SlantedBox::SlantedBox(Shape shape, const Corners& corners)
    : origin_(corners[0]), count_(static_cast<std::size_t>(dimension_of(shape))) {
  const auto corner_count = static_cast<std::size_t>(corners_of(shape));
  const bool flat = count_ == 2;
  // The derivatives at the centre are the mean edges.
  const Basis basis = basis_at(shape, {0.5, 0.5, flat ? 0.0 : 0.5});
  std::array<Point, 3> edges{};
  for (std::size_t i = 0; i < corner_count; ++i) {
    for (std::size_t e = 0; e < 3; ++e) {
      for (std::size_t d = 0; d < 3; ++d) edges[e][d] += basis.slope[e][i] * corners[i][d];
    }
  }
  if (flat) {
    edges[0][2] = edges[1][2] = 0;
    edges[2] = {0, 0, 1};
  }
  // Normalised, because products of long vectors could overflow.
  for (Point& edge : edges) {
    const double most = std::max({std::abs(edge[0]), std::abs(edge[1]), std::abs(edge[2])});
    for (double& part : edge) part = most > 0 ? part / most : 0;
  }
  double farthest = 0;
  for (std::size_t i = 0; i < corner_count; ++i) {
    for (const double part : corners[i]) farthest = std::max(farthest, std::abs(part));
  }
  for (std::size_t n = 0; n < count_; ++n) {
    Slab& slab = slabs_.at(n);
    slab.normal = cross(edges.at((n + 1) % 3), edges.at((n + 2) % 3));
    for (std::size_t i = 1; i < corner_count; ++i) {
      const double at = dot(slab.normal, minus(corners[i], origin_));
      slab.low = std::min(slab.low, at);
      slab.high = std::max(slab.high, at);
    }
    // Margin for rounding at large coordinates and in elongated cells.
    const double slack =
        slab_slack * (slab.high - slab.low) +
        rounding_slack *
            (std::abs(slab.normal[0]) + std::abs(slab.normal[1]) + std::abs(slab.normal[2])) *
            farthest;
    slab.low -= slack;
    slab.high += slack;
  }
}

// A slab without a direction is unbounded.
std::array<std::size_t, 2> SlantedBox::along_row(const Point& from, double step,
                                                 std::size_t count) const {
  const Point place = minus(from, origin_);
  double first = 0;
  auto last = static_cast<double>(count) - 1;
  for (std::size_t n = 0; n < count_; ++n) {
    const Slab& slab = slabs_.at(n);
    const double at = dot(slab.normal, place);
    const double slope = slab.normal[0] * step;
    if (slope == 0) {
      if (at < slab.low || at > slab.high) return {0, 0};
      continue;
    }
    const double one = (slab.low - at) / slope;
    const double other = (slab.high - at) / slope;
    const double enter = std::ceil(std::min(one, other));
    const double leave = std::floor(std::max(one, other));
    if (enter > first) first = enter;
    if (leave < last) last = leave;
  }
  if (!(first <= last)) return {0, 0};
  return {static_cast<std::size_t>(first), static_cast<std::size_t>(last) + 1};
}

bool find_in_cell(Shape shape, const Corners& corners, const Point& place, CellPlace& out,
                  std::uint64_t& steps) {
  const Found found = by_newton(shape, corners, place, out, steps);
  if (found != Found::unknown) return found == Found::inside;
  const Shape part = dimension_of(shape) == 2 ? Shape::triangle : Shape::tetra;
  const auto split = split_of(shape);
  for (std::size_t i = 0; i < split.size(); ++i) {
    CellPlace within;
    const Corners simplex = corners_of_simplex(split[i], corners);
    if (by_newton(part, simplex, place, within, steps) == Found::inside) {
      out = within;
      out.split = static_cast<std::uint8_t>(i + 1);
      return true;
    }
  }
  return false;
}

std::array<double, 8> corner_weights(Shape shape, const CellPlace& place) {
  const Point rst{place.rst[0], place.rst[1], place.rst[2]};
  if (place.split == 0) return basis_at(shape, rst).value;
  const bool flat = dimension_of(shape) == 2;
  const Weights part = basis_at(flat ? Shape::triangle : Shape::tetra, rst).value;
  const Simplex& simplex = split_of(shape)[place.split - 1U];
  Weights out{};
  for (std::size_t i = 0; i < (flat ? 3U : 4U); ++i) out.at(simplex.at(i)) += part.at(i);
  return out;
}

double measure(Shape shape, const Corners& corners) {
  const bool flat = dimension_of(shape) == 2;
  double sum = 0;
  for (const Simplex& simplex : split_of(shape)) {
    std::array<Point, 3> edges{};
    for (std::size_t e = 0; e < 3; ++e) {
      for (std::size_t d = 0; d < 3; ++d) {
        edges[e][d] = corners[simplex[e + 1]][d] - corners[simplex[0]][d];
      }
    }
    sum += flat ? (edges[0][0] * edges[1][1] - edges[0][1] * edges[1][0]) / 2
                : determinant(edges[0], edges[1], edges[2]) / 6;
  }
  return std::abs(sum);
}

}  // namespace windsplat::data::vtk
