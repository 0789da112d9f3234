// Values, gradients and the box -> an opacity curve.
#include "server/scene/defaults/opacity.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "server/scene/camera.hpp"
#include "server/scene/defaults/some_samples.hpp"
#include "server/scene/lattice.hpp"

namespace windsplat::scene {

namespace {

using Curve = std::vector<std::array<double, 2>>;

constexpr double depth_most = 1.0;      // mean optical depth of the box
constexpr double width_least = 0.25;    // of the curve above the median, fractions of the range
constexpr std::size_t points = 8;       // of a curve that follows gradients, beyond the first
constexpr double gradient_least = 0.1;  // weight of values without a gradient
constexpr double step_least = 1e-29;    // distance of points of a curve

std::array<std::size_t, 3> index_of(std::size_t at, const data::Volume& volume) {
  const auto row = static_cast<std::size_t>(volume.dims[0]);
  const auto rows = static_cast<std::size_t>(volume.dims[1]);
  return {at % row, at / row % rows, at / (row * rows)};
}

double cell_volume(std::size_t at, const data::Volume& volume, const Lattice& lattice) {
  const auto index = index_of(at, volume);
  double product = 1;
  for (std::size_t a = 0; a < 3; ++a) product *= lattice.spacing[a][index[a]];
  return product;
}

// The norm of the gradient by differences of neighbours, for each world unit; along axes of one
// sample and towards masked samples it is 0.
double gradient_at(std::size_t at, const data::Volume& volume, const Lattice& lattice) {
  const auto index = index_of(at, volume);
  const auto values = volume.component(0);
  double square = 0;
  std::size_t step = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto samples = static_cast<std::size_t>(volume.dims[a]);
    const std::size_t low = index[a] > 0 ? 1 : 0;
    const std::size_t high = index[a] + 1 < samples ? 1 : 0;
    const double width =
        lattice.positions[a][index[a] + high] - lattice.positions[a][index[a] - low];
    const double rise = static_cast<double>(values[at + high * step]) -
                        static_cast<double>(values[at - low * step]);
    if (width > 0 && std::isfinite(rise)) square += rise * rise / (width * width);
    step *= samples;
  }
  return std::sqrt(square);
}

double interpolated(const Curve& curve, double value) {
  if (value <= curve.front()[0]) return curve.front()[1];
  for (std::size_t n = 1; n < curve.size(); ++n) {
    if (value > curve[n][0]) continue;
    const auto& [from, low] = curve[n - 1];
    const auto& [to, high] = curve[n];
    return to > from ? std::lerp(low, high, (value - from) / (to - from)) : high;
  }
  return curve.back()[1];
}

// Rises from `clear` to 1 at the top of the range.
Curve ramp(double clear, const protocol::Range& range) {
  if (!(clear > range[0])) return {{range[0], 0}, {range[1], 1}};
  return {{range[0], 0}, {clear, 0}, {range[1], 1}};
}

// The median of the values, or what the style takes for clear where most values are near the top.
double clear_end(const ScalarStyle& style, const protocol::Range& range,
                 const data::Volume& volume) {
  const double width = range[1] - range[0];
  const double median = quantiles(volume, 0.5, 0.5)[0];
  const double most = range[1] - width_least * width;
  return median <= most ? std::max(median, range[0]) : range[0] + style.clear_below * width;
}

// A ramp from `clear`, times the mean gradient near each value relative to the greatest.
Curve gradient_ramp(double clear, const protocol::Range& range, const data::Volume& volume,
                    const Lattice& lattice) {
  const double step = (range[1] - clear) / points;
  if (!(step > step_least)) return ramp(clear, range);
  std::array<double, points + 1> sum{};
  std::array<double, points + 1> weight{};
  for_some_samples(volume, std::nullopt, [&](std::size_t at, double value) {
    const double place = std::min((value - clear) / step, 1.0 * points);
    if (place < 0) return;
    const auto below = std::min(static_cast<std::size_t>(place), points - 1);
    const double part = place - static_cast<double>(below);
    const double volume_of_cell = cell_volume(at, volume, lattice);
    const double gradient = gradient_at(at, volume, lattice) * volume_of_cell;
    sum[below] += (1 - part) * gradient;
    weight[below] += (1 - part) * volume_of_cell;
    sum[below + 1] += part * gradient;
    weight[below + 1] += part * volume_of_cell;
  });
  double most = 0;
  for (std::size_t n = 0; n <= points; ++n) {
    sum[n] = weight[n] > 0 ? sum[n] / weight[n] : 0;
    most = std::max(most, sum[n]);
  }
  Curve curve;
  if (clear > range[0]) curve.push_back({range[0], 0});
  for (std::size_t n = 0; n <= points; ++n) {
    const double share = static_cast<double>(n) / points;
    const double steepness = most > 0 ? sum[n] / most : 1;
    curve.push_back(
        {std::lerp(clear, range[1], share), share * std::lerp(gradient_least, 1.0, steepness)});
  }
  return curve;
}

// Down to two digits, those of whole grains not at all.
double two_digits_below(double value) {
  const double grain = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::floor(value / grain * (1 + 1e-12)) * grain;
}

}  // namespace

double mean_chord(const Lattice& lattice) {
  if (lattice.inner_radius > 0) return 2 * (lattice.box_max.z - lattice.inner_radius);
  const OrbitFrame frame =
      orbit_frame(default_azimuth, front_elevation(lattice, protocol::ImageView{}));
  const glm::dvec3 edge = lattice.box_max - lattice.box_min;
  // The volume over the area of the parallel projection.
  return edge.y * edge.z /
         (edge.y * std::abs(frame.forward.z) + edge.z * std::abs(frame.forward.y));
}

double mean_extinction(const Curve& curve, const data::Volume& volume, const Lattice& lattice) {
  double sum = 0;
  double whole = 0;
  for_some_samples(volume, std::nullopt, [&](std::size_t at, double value) {
    const double weight = cell_volume(at, volume, lattice);
    sum += weight * interpolated(curve, value);
    whole += weight;
  });
  return whole > 0 ? sum / whole : 0;
}

Curve transparent_extinction(const ScalarStyle& style, const protocol::Range& range,
                             const data::Volume& volume, const Lattice& lattice) {
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    shortest = std::min(shortest, cell_size(lattice, a) * lattice.dims[a]);
  }
  Curve curve = style.generic
                    ? gradient_ramp(clear_end(style, range, volume), range, volume, lattice)
                    : ramp(range[0] + style.clear_below * (range[1] - range[0]), range);
  const double most = two_digits_below(style.opacity / shortest);
  const double seen = mean_extinction(curve, volume, lattice) * mean_chord(lattice);
  const double top = seen * most > depth_most ? two_digits_below(depth_most / seen) : most;
  for (auto& [value, extinction] : curve) extinction *= top;
  return curve;
}

}  // namespace windsplat::scene
