#include "server/data/cf/mesh/weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

namespace windsplat::data::cf {

namespace {

constexpr double chart_latitude_max = 80;  // degrees; nearer to a pole offsets are about the pole

// The triangle of apex and edge around a point of a chart, and the weights of the edge's ends. For
// a point in none, which happens at the rim of cells that are not star-shaped, the nearest.
SamplePlace place_in(const ChartCell& cell, const PlanePoint& apex, const PlanePoint& point) {
  SamplePlace out;
  const double px = point[0] - apex[0];
  const double py = point[1] - apex[1];
  double best = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < cell.points.size(); ++i) {
    const std::size_t next = i + 1 < cell.points.size() ? i + 1 : 0;
    const double ax = cell.points[i][0] - apex[0];
    const double ay = cell.points[i][1] - apex[1];
    const double bx = cell.points[next][0] - apex[0];
    const double by = cell.points[next][1] - apex[1];
    const double area = ax * by - ay * bx;
    if (area == 0) continue;
    const double first = (px * by - py * bx) / area;
    const double second = (ax * py - ay * px) / area;
    const double least = std::min({first, second, 1 - first - second});
    if (!(least > best)) continue;
    best = least;
    out.first = cell.nodes[i];
    out.second = cell.nodes[next];
    const double a = std::max(first, 0.0);
    const double b = std::max(second, 0.0);
    const double sum = std::max(a + b, 1.0);
    out.first_weight = static_cast<float>(a / sum);
    out.second_weight = static_cast<float>(b / sum);
    if (least >= 0) break;
  }
  return out;
}

// Offsets of positions from a node, on the sphere in a plane that touches it there.
class OffsetChart {
 public:
  OffsetChart(const Mesh& mesh, std::uint32_t node)
      : on_sphere_(mesh.on_sphere), x_(mesh.x[node]), y_(mesh.y[node]) {
    about_pole_ = on_sphere_ && std::abs(y_) > chart_latitude_max;
    shrink_ = on_sphere_ ? std::cos(y_ * std::numbers::pi / 180) : 1;
    if (about_pole_) own_ = polar(x_, y_);
  }
  [[nodiscard]] PlanePoint to(const PlanePoint& place) const {
    if (about_pole_) {
      const PlanePoint there = polar(place[0], place[1]);
      return {there[0] - own_[0], there[1] - own_[1]};
    }
    const double dx = place[0] - x_;
    return {(on_sphere_ ? std::remainder(dx, 360.0) : dx) * shrink_, place[1] - y_};
  }

 private:
  [[nodiscard]] PlanePoint polar(double x, double y) const {
    const double from_pole = 90 - std::copysign(1.0, y_) * y;
    return {from_pole * std::cos(x * std::numbers::pi / 180),
            from_pole * std::sin(x * std::numbers::pi / 180)};
  }

  bool on_sphere_;
  bool about_pole_ = false;
  double x_;
  double y_;
  double shrink_ = 1;
  PlanePoint own_{};
};

// Sets the weights of positions with these offsets: as near to 1 as their weighted mean of 0
// allows, at least 0; all 1 if hardly any remain, which is so where all positions lie to one side.
void balance(const std::vector<PlanePoint>& offsets, float* weights) {
  double sx = 0;
  double sy = 0;
  double xx = 0;
  double yy = 0;
  double xy = 0;
  for (const auto& [x, y] : offsets) {
    sx += x;
    sy += y;
    xx += x * x;
    yy += y * y;
    xy += x * y;
  }
  const double determinant = xx * yy - xy * xy;
  constexpr double flat = 1e-6;  // of the square of the spread: positions on a line
  const bool is_flat = !(determinant > flat * (xx + yy) * (xx + yy));
  const double to_x = is_flat ? 0 : (xy * sy - yy * sx) / determinant;
  const double to_y = is_flat ? 0 : (xy * sx - xx * sy) / determinant;
  double sum = 0;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const double weight = std::max(1 + to_x * offsets[i][0] + to_y * offsets[i][1], 0.0);
    sum += weight;
    weights[i] = static_cast<float>(weight);
  }
  constexpr double least_mean = 0.25;
  if (sum < least_mean * static_cast<double>(offsets.size())) {
    std::fill_n(weights, offsets.size(), 1.0F);
  }
}

}  // namespace

MeshWeights::MeshWeights(const Mesh& mesh, const MeshLattice& lattice,
                         const std::vector<std::uint32_t>& cells, MeshLocation location)
    : mesh_(mesh), location_(location) {
  place_samples(lattice, cells);
  if (location == MeshLocation::face) weigh_cells();
}

void MeshWeights::place_samples(const MeshLattice& lattice,
                                const std::vector<std::uint32_t>& cells) {
  places_.resize(cells.size());
  ChartCell chart;
  Outline outline;
  PlanePoint apex{};
  std::uint32_t current = no_mesh_cell;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    if (cells[n] == no_mesh_cell) continue;
    if (cells[n] != current) {
      current = cells[n];
      outline_of(mesh_, current, outline);
      chart_of(mesh_, current, outline.polar, chart);
      apex = location_ == MeshLocation::face ? chart.centroid() : chart.mean();
    }
    const double x = lattice.x.at(n % lattice.x.count);
    const double y = lattice.y.at(n / lattice.x.count);
    places_[n] = place_in(chart, apex, chart.in_chart(x, y));
    places_[n].cell = current;
  }
}

void MeshWeights::weigh_cells() {
  std::vector<PlanePoint> centroids(mesh_.cells());
  ChartCell chart;
  Outline outline;
  for (std::size_t c = 0; c < mesh_.cells(); ++c) {
    outline_of(mesh_, c, outline);
    chart_of(mesh_, c, outline.polar, chart);
    centroids[c] = chart.in_plane(chart.centroid());
  }
  first_.assign(mesh_.nodes() + 1, 0);
  for (const std::uint32_t node : mesh_.corners) ++first_[node + 1];
  for (std::size_t n = 0; n < mesh_.nodes(); ++n) first_[n + 1] += first_[n];
  around_.resize(mesh_.corners.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t c = 0; c < mesh_.cells(); ++c) {
    for (std::uint32_t i = mesh_.first[c]; i < mesh_.first[c + 1]; ++i) {
      around_[next[mesh_.corners[i]]++] = static_cast<std::uint32_t>(c);
    }
  }
  weights_.resize(around_.size());
  std::vector<PlanePoint> offsets;
  for (std::size_t n = 0; n < mesh_.nodes(); ++n) {
    const OffsetChart from_node(mesh_, static_cast<std::uint32_t>(n));
    offsets.clear();
    for (std::uint32_t i = first_[n]; i < first_[n + 1]; ++i) {
      offsets.push_back(from_node.to(centroids[around_[i]]));
    }
    balance(offsets, weights_.data() + first_[n]);
  }
}

void MeshWeights::complete_nodes(const float* values) {
  completed_.resize(mesh_.nodes());
  for (std::size_t n = 0; n < mesh_.nodes(); ++n) {
    double base = std::numeric_limits<double>::quiet_NaN();
    double sum = 0;
    double weight = 0;
    for (std::uint32_t i = first_[n]; i < first_[n + 1]; ++i) {
      const auto value = static_cast<double>(values[around_[i]]);
      if (std::isnan(value)) continue;
      if (std::isnan(base)) base = value;
      const auto own = static_cast<double>(weights_[i]);
      sum += own * (value - base);
      weight += own;
    }
    completed_[n] = static_cast<float>(weight > 0 ? base + sum / weight : base);
  }
}

void MeshWeights::complete_cells(const float* values) {
  completed_.resize(mesh_.cells());
  for (std::size_t c = 0; c < mesh_.cells(); ++c) {
    const std::uint32_t begin = mesh_.first[c];
    const std::uint32_t end = mesh_.first[c + 1];
    const auto base = static_cast<double>(values[mesh_.corners[begin]]);
    double sum = 0;
    for (std::uint32_t i = begin; i < end; ++i) {
      sum += static_cast<double>(values[mesh_.corners[i]]) - base;
    }
    completed_[c] = static_cast<float>(base + sum / static_cast<double>(end - begin));
  }
}

const float* MeshWeights::with_twins(const float* values) {
  if (location_ == MeshLocation::face || mesh_.twins.empty()) return values;
  filled_.assign(values, values + mesh_.nodes());
  for (const auto& [corner, other] : mesh_.twins) {
    if (std::isnan(filled_[corner])) filled_[corner] = filled_[other];
  }
  return filled_.data();
}

void MeshWeights::gather(const float* values, float* out) {
  const bool at_cells = location_ == MeshLocation::face;
  values = with_twins(values);
  if (at_cells) {
    complete_nodes(values);
  } else {
    complete_cells(values);
  }
  const float* cells = at_cells ? values : completed_.data();
  const float* nodes = at_cells ? completed_.data() : values;
  for (std::size_t n = 0; n < places_.size(); ++n) {
    const SamplePlace& place = places_[n];
    if (place.cell == no_mesh_cell) {
      out[n] = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    const auto apex = static_cast<double>(cells[place.cell]);
    const double first = static_cast<double>(nodes[place.first]) - apex;
    const double second = static_cast<double>(nodes[place.second]) - apex;
    out[n] = static_cast<float>(apex + static_cast<double>(place.first_weight) * first +
                                static_cast<double>(place.second_weight) * second);
  }
}

}  // namespace windsplat::data::cf
