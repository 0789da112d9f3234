#include "server/data/cf/mesh/accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace windsplat::data::cf {

namespace {

constexpr std::size_t samples_measured = 20'000;

class TestWave {
 public:
  TestWave(bool on_sphere, double length) : on_sphere_(on_sphere) {
    constexpr double degrees = 180 / std::numbers::pi;
    number_ = 2 * std::numbers::pi / length * (on_sphere ? degrees : 1);
  }
  [[nodiscard]] double at(const PlanePoint& place) const {
    if (!on_sphere_) return std::sin(number_ * place[0]) + std::sin(number_ * place[1]);
    const double longitude = place[0] * std::numbers::pi / 180;
    const double latitude = place[1] * std::numbers::pi / 180;
    const double x = std::cos(latitude) * std::cos(longitude);
    const double y = std::cos(latitude) * std::sin(longitude);
    return std::sin(number_ * x) + std::sin(number_ * y) + std::sin(number_ * std::sin(latitude));
  }

 private:
  bool on_sphere_;
  double number_ = 1;
};

// Values of the wave at the places of values.
std::vector<float> sampled(const Mesh& mesh, const TestWave& wave, MeshLocation location) {
  std::vector<float> out;
  if (location == MeshLocation::node) {
    for (std::size_t n = 0; n < mesh.nodes(); ++n) {
      out.push_back(static_cast<float>(wave.at({mesh.x[n], mesh.y[n]})));
    }
    return out;
  }
  ChartCell chart;
  Outline outline;
  for (std::size_t c = 0; c < mesh.cells(); ++c) {
    outline_of(mesh, c, outline);
    chart_of(mesh, c, outline.polar, chart);
    out.push_back(static_cast<float>(wave.at(chart.in_plane(chart.centroid()))));
  }
  return out;
}

double cell_size(const Mesh& mesh, std::size_t cell, Outline& outline) {
  if (!outline_of(mesh, cell, outline)) return 0;
  const double area = std::abs(doubled_area(outline.points)) / 2;
  double sum_y = 0;
  for (const PlanePoint& point : outline.points) sum_y += point[1];
  const double latitude = sum_y / static_cast<double>(outline.points.size());
  return std::sqrt(area * (mesh.on_sphere ? std::cos(latitude * std::numbers::pi / 180) : 1));
}

}  // namespace

double error_of_wave(const Mesh& mesh, const MeshLattice& lattice, MeshWeights& weights,
                     MeshLocation location) {
  const TestWave wave(mesh.on_sphere, test_wave_cells * lattice.median_size);
  const std::vector<float> values = sampled(mesh, wave, location);
  std::vector<float> drawn(lattice.samples());
  weights.gather(values.data(), drawn.data());
  const std::size_t stride = std::max<std::size_t>(1, lattice.samples() / samples_measured);
  Outline outline;
  double errors = 0;
  double squares = 0;
  for (std::size_t n = 0; n < drawn.size(); n += stride) {
    const std::uint32_t cell = weights.cell_of(n);
    if (cell == no_mesh_cell ||
        cell_size(mesh, cell, outline) > test_cell_size_max * lattice.median_size) {
      continue;
    }
    const double true_value =
        wave.at({lattice.x.at(n % lattice.x.count), lattice.y.at(n / lattice.x.count)});
    const double error = static_cast<double>(drawn[n]) - true_value;
    errors += error * error;
    squares += true_value * true_value;
  }
  return squares > 0 ? std::sqrt(errors / squares) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace windsplat::data::cf
