// Lattice -> stride, length and least magnitude of lines that stay apart.
#include "server/scene/defaults/spacing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "protocol/limits.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/defaults/some_samples.hpp"
#include "server/scene/lattice.hpp"

namespace windsplat::scene {

namespace {

constexpr double coverage_most = 0.8;  // of the projected box by lines
constexpr double gap_least = 3.0;      // between lines of a layer, line widths
constexpr double strides_least = 2.0;  // length of the longest lines
constexpr double long_least = 24.0;    // likewise, line widths
constexpr double strides_most = 5.0;
constexpr double line_share = 0.75;   // mean length of lines relative to the longest
constexpr double widths_least = 2.0;  // length of the shortest lines that show a direction
constexpr int stride_most = 16;

// The width of a line at half its opacity, pixels of a picture of the default size.
double line_width() {
  const protocol::VectorView plain;
  return plain.r1 + plain.r2;
}

// The axis that is not drawn over: of a slice, or the only one of one sample. -1: there is none.
int thin_axis(const Lattice& lattice, const std::optional<Slice>& slice) {
  if (slice) return slice->axis;
  if (std::count(lattice.dims.begin(), lattice.dims.end(), 1) != 1) return -1;
  return static_cast<int>(std::find(lattice.dims.begin(), lattice.dims.end(), 1) -
                          lattice.dims.begin());
}

// Mean distance of samples along the horizontal axes that are drawn over; of the vertical one if
// there is no other.
double cell_of(const Lattice& lattice, const std::optional<Slice>& slice) {
  constexpr double of_one_sample = 0.2;
  double sum = 0;
  int axes = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const bool wanted = a < 2 || axes == 0;
    const bool across = slice && slice->axis == static_cast<int>(a);
    if (!wanted || across || lattice.dims[a] < 2) continue;
    sum += cell_size(lattice, a);
    ++axes;
  }
  return axes == 0 ? of_one_sample : sum / axes;
}

double lines_at(int stride, const Lattice& lattice, const std::optional<Slice>& slice) {
  double lines = 1;
  for (int a = 0; a < 3; ++a) {
    const bool across = slice && slice->axis == a;
    if (!across) lines *= std::ceil(static_cast<double>(lattice.drawn(a)) / stride);
  }
  return lines;
}

// Whether an axis of few samples keeps enough of them.
bool keeps_layers(int stride, const Lattice& lattice, const std::optional<Slice>& slice) {
  for (int a = 0; a < 3; ++a) {
    const int samples = lattice.drawn(a);
    if (a == thin_axis(lattice, slice) || samples == 1) continue;
    if (stride > (samples < 5 ? samples - 1 : (samples - 1) / 2)) return false;
  }
  return true;
}

// The projected box in the default picture: pixels, and pixels for a world unit.
struct Projected {
  double area, scale;
};

Projected projected(const Lattice& lattice, const std::optional<Slice>& slice) {
  const protocol::ImageView image;
  const protocol::CameraView camera;
  const OrbitFrame frame = orbit_frame(default_azimuth, front_elevation(lattice, image));
  const Framing framing = frame_box(lattice, frame, {0, 0, 0}, camera.fov_y, image);
  const double scale = image.height / framing.height;
  const glm::dvec3 edge = lattice.box_max - lattice.box_min;
  // What is thin is assumed to be viewed along its normal.
  const std::array<double, 3> sides = {edge.y * edge.z, edge.x * edge.z, edge.x * edge.y};
  const int thin = thin_axis(lattice, slice);
  const double area =
      thin >= 0 ? sides.at(static_cast<std::size_t>(thin))
                : sides[2] * std::abs(frame.forward.z) + sides[1] * std::abs(frame.forward.y);
  return {area * scale * scale, scale};
}

}  // namespace

double readable_grain(double most) { return std::pow(10.0, std::floor(std::log10(most))) / 20.0; }

LineDensity line_density(const LineSpacing& spacing, const Lattice& lattice,
                         const std::optional<Slice>& slice) {
  const Projected box = projected(lattice, slice);
  const double apart = spacing.stride * cell_of(lattice, slice) * box.scale;
  const double length = spacing.length * box.scale;
  const double lines = lines_at(spacing.stride, lattice, slice);
  // A line of a layer of parallel ones has an area of apart^2 for itself.
  return {lines * line_share * length * line_width() / box.area, apart,
          apart * apart / (length * line_width())};
}

double spaced_length(double strides, int stride, const Lattice& lattice,
                     const std::optional<Slice>& slice) {
  const double length = strides * cell_of(lattice, slice) * stride;
  // Lengths of whole grains remain as they are.
  const double grain = std::pow(10.0, std::floor(std::log10(length)) - 2.0);
  const double rounded = std::floor(length / grain * (1 + 1e-12)) * grain;
  return std::clamp(rounded, 1e-9, protocol::limits::line_length_max);
}

LineSpacing default_spacing(const Lattice& lattice, const std::optional<Slice>& slice) {
  int stride = 1;
  double strides = 0;
  while (true) {
    const LineSpacing one{stride, stride * cell_of(lattice, slice)};
    const LineDensity density = line_density(one, lattice, slice);
    strides = std::min({coverage_most / density.coverage, density.gap / gap_least, strides_most});
    const bool is_long = strides * density.apart_px >= long_least * line_width();
    if ((strides >= strides_least && is_long) || stride == stride_most) break;
    if (!keeps_layers(stride + 1, lattice, slice)) break;
    ++stride;
  }
  return {stride, spaced_length(std::max(strides, strides_least), stride, lattice, slice)};
}

double default_min_magnitude(const protocol::Range& magnitude_range, const LineSpacing& spacing,
                             const data::Volume& volume, const Lattice& lattice,
                             const std::optional<Slice>& slice) {
  const double top = magnitude_range[1];
  std::vector<double> magnitudes;
  for_some_samples(volume, slice,
                   [&](std::size_t, double magnitude) { magnitudes.push_back(magnitude); });
  std::sort(magnitudes.begin(), magnitudes.end(), std::greater<>());
  const double grain = top > 0 ? readable_grain(top) : 1.0;
  // Below the greatest magnitude by more than the rounding of floats: of a uniform flow, all lines
  // are drawn.
  const double greatest = magnitudes.empty() ? 0.0 : (1 - 1e-6) * magnitudes.front();
  const auto readable = [&](double magnitude) {
    double rounded = std::round(magnitude / grain) * grain;
    if (rounded > greatest) rounded = std::max(0.0, rounded - grain);
    return std::max(std::max(0.0, top) / 100.0, rounded);
  };
  // The longest line has apart^2 / (gap w) pixels.
  const LineDensity density = line_density(spacing, lattice, slice);
  const double longest = density.apart_px * density.apart_px / (density.gap * line_width());
  const double median = magnitudes.empty() ? 0.0 : magnitudes[magnitudes.size() / 2];
  const double least = std::min(top * widths_least * line_width() / longest, median);
  const std::size_t visited = std::min(SampleOrder(volume.dims, slice).count(), some_samples_max);
  // The coverage by one of these samples if its line is of full length.
  const double whole = density.coverage / line_share / static_cast<double>(visited);
  double covered = 0;
  for (const double magnitude : magnitudes) {
    covered += whole * (top > 0 ? std::min(magnitude / top, 1.0) : 1.0);
    if (covered <= coverage_most) continue;
    return readable(std::min(std::max(magnitude, least), 0.9 * top));
  }
  return readable(least);
}

}  // namespace windsplat::scene
