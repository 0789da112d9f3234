// Weights of the values on the sides of a cell.
#include <algorithm>
#include <cmath>

#include "server/data/cf/edges/edges.hpp"

namespace windsplat::data::cf {

namespace {

using SpaceVector = MeshEdges::Vector;
using LinearTerms = std::array<double, 6>;  // a vector and its gradient, of two components each

constexpr std::uint32_t no_cell_beside = std::numeric_limits<std::uint32_t>::max();
constexpr double unknown_weight = std::numeric_limits<double>::quiet_NaN();

double along(const SpaceVector& a, const SpaceVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// An edge as seen from a cell, in the plane of its horizontal directions.
struct Seen {
  std::uint32_t edge = 0;
  double weight = 0;  // of the cell's own
  PlanePoint normal{};
  PlanePoint offset{};  // of the middle from the centroid
  double to_east = unknown_weight;
  double to_north = unknown_weight;
};

// Sets the weights of the constant vector.
void fit_constant(std::vector<Seen>& sides) {
  double xx = 0;
  double xy = 0;
  double yy = 0;
  for (const auto& side : sides) {
    const auto& [x, y] = side.normal;
    xx += side.weight * x * x;
    xy += side.weight * x * y;
    yy += side.weight * y * y;
  }
  const double determinant = xx * yy - xy * xy;
  constexpr double flat = 1e-6;  // normals that are all parallel
  if (!(determinant > flat * (xx + yy) * (xx + yy))) return;
  for (Seen& side : sides) {
    const auto& [x, y] = side.normal;
    side.to_east = side.weight * (yy * x - xy * y) / determinant;
    side.to_north = side.weight * (xx * y - xy * x) / determinant;
  }
}

// Sets the weights of the linear function; false, without a change, if the sides do not determine
// it. By Cholesky's decomposition of the normal equations.
bool fit_linear(std::vector<Seen>& sides) {
  constexpr std::size_t unknowns = 6;
  if (sides.size() <= unknowns) return false;
  double size = 0;
  for (const Seen& side : sides) size += std::hypot(side.offset[0], side.offset[1]);
  size /= static_cast<double>(sides.size());
  std::vector<LinearTerms> rows;
  std::array<LinearTerms, unknowns> matrix{};
  for (const Seen& side : sides) {
    const auto& [x, y] = side.normal;
    const double dx = side.offset[0] / size;
    const double dy = side.offset[1] / size;
    const LinearTerms& row = rows.emplace_back(LinearTerms{x, y, x * dx, x * dy, y * dx, y * dy});
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix.at(i).at(j) += row.at(i) * row.at(j);
    }
  }
  constexpr double least_pivot = 1e-3;  // of the number of sides
  for (std::size_t i = 0; i < unknowns; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = matrix.at(i).at(j);
      for (std::size_t k = 0; k < j; ++k) sum -= matrix.at(i).at(k) * matrix.at(j).at(k);
      if (i > j) {
        matrix.at(i).at(j) = sum / matrix.at(j).at(j);
      } else if (sum > least_pivot * static_cast<double>(sides.size())) {
        matrix.at(i).at(i) = std::sqrt(sum);
      } else {
        return false;
      }
    }
  }
  std::array<LinearTerms, 2> solved{LinearTerms{1}, LinearTerms{0, 1}};
  for (LinearTerms& z : solved) {
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t k = 0; k < i; ++k) z.at(i) -= matrix.at(i).at(k) * z.at(k);
      z.at(i) /= matrix.at(i).at(i);
    }
    for (std::size_t i = unknowns; i-- > 0;) {
      for (std::size_t k = i + 1; k < unknowns; ++k) z.at(i) -= matrix.at(k).at(i) * z.at(k);
      z.at(i) /= matrix.at(i).at(i);
    }
  }
  for (std::size_t n = 0; n < sides.size(); ++n) {
    sides[n].to_east = 0;
    sides[n].to_north = 0;
    for (std::size_t i = 0; i < unknowns; ++i) {
      sides[n].to_east += solved[0].at(i) * rows[n].at(i);
      sides[n].to_north += solved[1].at(i) * rows[n].at(i);
    }
  }
  return true;
}

// The value of a side, NaN if missing, along its normal (x, y).
struct GivenNormal {
  double weight = 0;
  double x = 0;
  double y = 0;
  double value = 0;
};

// The constant vector by least squares: NaN if every side is missing, or if the normals of those
// that are given are within some 20 degrees of one line, where errors grow more than threefold.
PlanePoint fitted_vector(const std::vector<GivenNormal>& sides, MissingNormal missing) {
  const PlanePoint unknown{unknown_weight, unknown_weight};
  if (std::all_of(sides.begin(), sides.end(),
                  [](const GivenNormal& side) { return std::isnan(side.value); })) {
    return unknown;
  }
  double xx = 0;
  double xy = 0;
  double yy = 0;
  PlanePoint right{};
  for (const auto& [weight, x, y, given] : sides) {
    if (std::isnan(given) && missing == MissingNormal::unknown) continue;
    const double value = std::isnan(given) ? 0 : given;
    xx += weight * x * x;
    xy += weight * x * y;
    yy += weight * y * y;
    right[0] += weight * x * value;
    right[1] += weight * y * value;
  }
  const double determinant = xx * yy - xy * xy;
  constexpr double flat = 0.03;  // sin(20 degrees)^2 / 4, for two sides of equal weights
  if (!(determinant > flat * (xx + yy) * (xx + yy))) return unknown;
  return {(yy * right[0] - xy * right[1]) / determinant,
          (xx * right[1] - xy * right[0]) / determinant};
}

}  // namespace

struct EdgeWeights::Maker {
  Maker(const Mesh& of, const MeshEdges& edges, EdgeWeights& to)
      : mesh(of), all(edges), out(to), has_normals(!edges.normals.empty()) {}

  void make() {
    if (has_normals) find_cells_beside();
    out.first_.push_back(0);
    for (std::size_t c = 0; c < mesh.cells(); ++c) add_cell(c);
  }

  void find_cells_beside() {
    beside.assign(all.count, {no_cell_beside, no_cell_beside});
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        if (all.of_sides[i] == no_mesh_edge) continue;
        auto& cells = beside[all.of_sides[i]];
        cells.at(cells[0] == no_cell_beside ? 0 : 1) = static_cast<std::uint32_t>(c);
      }
    }
  }

  // The areas of the triangles between the centroid and the sides of a cell.
  void weigh_sides(std::size_t cell) {
    outline_of(mesh, cell, outline);
    chart_of(mesh, cell, outline.polar, chart);
    const PlanePoint middle = chart.centroid();
    const PlanePoint placed = chart.in_plane(middle);
    center = in_space(placed, mesh.on_sphere);
    sides.clear();
    for (std::size_t i = 0; i < chart.points.size(); ++i) {
      const std::uint32_t edge = all.of_sides[mesh.first[cell] + i];
      if (edge == no_mesh_edge) continue;
      const PlanePoint& a = chart.points[i];
      const PlanePoint& b = chart.points[(i + 1) % chart.points.size()];
      const double area = std::abs((a[0] - middle[0]) * (b[1] - middle[1]) -
                                   (a[1] - middle[1]) * (b[0] - middle[0]));
      Seen& side = sides.emplace_back();
      side.edge = edge;
      side.weight = all.in_order ? area : 1;
    }
    double sum = 0;
    for (const Seen& side : sides) sum += side.weight;
    for (Seen& side : sides) side.weight = sum > 0 ? side.weight / sum : unknown_weight;
  }

  void look_at(Seen& side, const std::array<SpaceVector, 2>& axes) const {
    const SpaceVector& middle = all.middles[side.edge];
    const SpaceVector way{middle[0] - center[0], middle[1] - center[1], middle[2] - center[2]};
    for (std::size_t a = 0; a < 2; ++a) {
      side.normal.at(a) = along(all.normals[side.edge], axes.at(a));
      side.offset.at(a) = along(way, axes.at(a));
    }
  }

  // The edges of the cells that share an edge with this one.
  void add_neighbours(std::size_t cell, const std::array<SpaceVector, 2>& axes) {
    const std::size_t own = sides.size();
    for (std::size_t n = 0; n < own; ++n) {
      for (const std::uint32_t other : beside[sides[n].edge]) {
        if (other == no_cell_beside || other == cell) continue;
        for (std::uint32_t i = mesh.first[other]; i < mesh.first[other + 1]; ++i) {
          const std::uint32_t edge = all.of_sides[i];
          const bool is_known = edge == no_mesh_edge ||
                                std::any_of(sides.begin(), sides.end(),
                                            [&](const Seen& one) { return one.edge == edge; });
          if (is_known) continue;
          Seen& more = sides.emplace_back();
          more.edge = edge;
          look_at(more, axes);
        }
      }
    }
  }

  void add_cell(std::size_t cell) {
    weigh_sides(cell);
    const std::size_t own = sides.size();
    if (has_normals) {
      const auto axes = axes_at(center, mesh.on_sphere);
      for (Seen& side : sides) look_at(side, axes);
      constexpr std::size_t corners_of_triangle = 3;
      if (own == corners_of_triangle) add_neighbours(cell, axes);
      if (own != corners_of_triangle || !fit_linear(sides)) {
        sides.resize(own);
        fit_constant(sides);
      }
    }
    for (const Seen& side : sides) {
      out.edges_.push_back(side.edge);
      out.mean_.push_back(static_cast<float>(side.weight));
      if (!has_normals) continue;
      out.east_.push_back(static_cast<float>(side.to_east));
      out.north_.push_back(static_cast<float>(side.to_north));
    }
    for (std::size_t n = 0; n < own && has_normals; ++n) {
      const auto& [x, y] = sides[n].normal;
      out.normals_.push_back({static_cast<float>(x), static_cast<float>(y)});
    }
    out.sides_.push_back(static_cast<std::uint8_t>(own));
    out.first_.push_back(static_cast<std::uint32_t>(out.edges_.size()));
  }

  const Mesh& mesh;
  const MeshEdges& all;
  EdgeWeights& out;
  bool has_normals;
  std::vector<std::array<std::uint32_t, 2>> beside;  // the cells at each edge
  Outline outline;
  ChartCell chart;
  SpaceVector center{};
  std::vector<Seen> sides;
};

EdgeWeights::EdgeWeights(const Mesh& mesh, const MeshEdges& edges) {
  Maker(mesh, edges, *this).make();
}

void EdgeWeights::gather(EdgePart part, MissingNormal missing, const float* values,
                         float* out) const {
  if (part == EdgePart::mean) {
    gather_means(values, out);
    return;
  }
  const std::vector<float>& weights = part == EdgePart::east ? east_ : north_;
  std::vector<GivenNormal> given;
  std::size_t own = 0;  // in `normals_`
  for (std::size_t c = 0; c < sides_.size(); ++c) {
    const std::uint32_t begin = first_[c];
    double sum = 0;
    bool is_whole = true;
    for (std::uint32_t i = begin; i < first_[c + 1] && is_whole; ++i) {
      const auto value = static_cast<double>(values[edges_[i]]);
      is_whole = !std::isnan(value);
      sum += static_cast<double>(weights[i]) * value;
    }
    if (!is_whole) {
      given.clear();
      for (std::uint32_t n = 0; n < sides_[c]; ++n) {
        const auto& [x, y] = normals_[own + n];
        given.push_back({static_cast<double>(mean_[begin + n]), static_cast<double>(x),
                         static_cast<double>(y), static_cast<double>(values[edges_[begin + n]])});
      }
      const PlanePoint vector = fitted_vector(given, missing);
      sum = vector[part == EdgePart::east ? 0 : 1];
    }
    out[c] = static_cast<float>(sides_[c] == 0 ? unknown_weight : sum);
    own += sides_[c];
  }
}

void EdgeWeights::gather_means(const float* values, float* out) const {
  for (std::size_t c = 0; c < sides_.size(); ++c) {
    double sum = 0;
    double weight = 0;
    bool is_masked = true;
    for (std::uint32_t i = first_[c]; i < first_[c] + sides_[c]; ++i) {
      const auto value = static_cast<double>(values[edges_[i]]);
      if (std::isnan(value)) continue;
      is_masked = false;
      sum += static_cast<double>(mean_[i]) * value;
      weight += static_cast<double>(mean_[i]);
    }
    out[c] = static_cast<float>(is_masked ? unknown_weight : sum / weight);
  }
}

}  // namespace windsplat::data::cf
