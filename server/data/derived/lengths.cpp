// Units of axes by data/cf/units; derivatives of the polynomial through two or three samples.
#include "server/data/derived/lengths.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/data/cf/fields/atmosphere.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::derived {

namespace {

constexpr double widest_gap = 1.5;  // of a circle that closes, in spacings

// Great-circle distance of two columns in radians.
double distance(const Columns& columns, std::size_t a, std::size_t b) {
  const double north = std::sin(0.5 * degree * (columns.latitude[b] - columns.latitude[a]));
  const double east = std::sin(0.5 * degree * (columns.longitude[b] - columns.longitude[a]));
  const double part = north * north + std::cos(degree * columns.latitude[a]) *
                                          std::cos(degree * columns.latitude[b]) * east * east;
  return 2 * std::asin(std::min(1.0, std::sqrt(part)));
}

// Whether the ends of every row are neighbours.
bool rows_close(const Columns& columns, std::size_t width) {
  for (std::size_t first = 0; first < columns.longitude.size(); first += width) {
    double widest = 0;
    for (std::size_t i = first; i + 1 < first + width; ++i) {
      widest = std::max(widest, distance(columns, i, i + 1));
    }
    const double gap = distance(columns, first + width - 1, first);
    if (gap > widest_gap * widest) return false;
  }
  return true;
}

bool ends_coincide(const Columns& columns, std::size_t width) {
  for (std::size_t first = 0; first < columns.longitude.size(); first += width) {
    const double gap = distance(columns, first + width - 1, first);
    if (gap > 1e-3 * distance(columns, first, first + 1)) return false;
  }
  return true;
}

}  // namespace

Surface surface_of(const Grid& grid) {
  const auto& [x, y, z] = grid.axes;
  if (x.coordinates.size() < 2 || y.coordinates.size() < 2) return Surface::unknown;
  if (grid.columns) return Surface::sphere;
  if (x.kind == AxisKind::longitude && y.kind == AxisKind::latitude) return Surface::sphere;
  return metres_in(x.units) && metres_in(y.units) ? Surface::plane : Surface::unknown;
}

std::optional<std::vector<double>> level_heights(const Grid& grid) {
  const Axis& z = grid.axes[2];
  if (z.coordinates.size() < 2) return std::nullopt;
  std::vector<double> heights = z.coordinates;
  if (const auto metres = metres_in(z.units)) {
    const double up = z.coordinates.back() < z.coordinates.front() ? -*metres : *metres;
    for (double& height : heights) height *= up;
    return heights;
  }
  const auto pascals = pascals_in(z.units);
  if (!pascals || z.kind != AxisKind::pressure) return std::nullopt;
  for (double& height : heights) height = cf::standard_height(height * *pascals);
  // An axis may also hold values that are no pressures of air.
  const auto ascends = [](double below, double above) { return above > below; };
  if (!std::isfinite(heights.front()) || !std::isfinite(heights.back()) ||
      !std::equal(heights.begin(), heights.end() - 1, heights.begin() + 1, ascends)) {
    return std::nullopt;
  }
  return heights;
}

Along::Along(std::vector<double> coordinates, std::size_t distinct, double period)
    : coordinates_(std::move(coordinates)), distinct_(distinct), period_(period) {
  const auto any = [](std::size_t) { return true; };
  usual_.resize(coordinates_.size());
  for (std::size_t sample = 0; sample < usual_.size(); ++sample) {
    for (const Offsets& offsets : choices) {
      usual_[sample] = stencil(sample, offsets);
      if (all_usable(usual_[sample], any)) break;
    }
  }
}

Stencil Along::stencil(std::size_t sample, const Offsets& offsets) const {
  Stencil out;
  std::array<double, 3> place{};
  const auto size = static_cast<std::ptrdiff_t>(period_ > 0 ? distinct_ : coordinates_.size());
  for (std::size_t m = 0; m < offsets.count; ++m) {
    auto index = static_cast<std::ptrdiff_t>(sample) + offsets.of[m];
    double shift = 0;
    if (offsets.of[m] != 0 && (index < 0 || index >= size)) {
      if (period_ <= 0) return {};
      const std::ptrdiff_t turns = index < 0 ? -1 : 1;
      index -= turns * size;
      shift = static_cast<double>(turns) * period_;
    }
    out.at[m] = static_cast<std::size_t>(index);
    place[m] = coordinates_[out.at[m]] + shift;
  }
  const double here = coordinates_[sample];
  if (offsets.count == 2) {
    out.span = place[1] - place[0];
    out.weight = {-1 / out.span, 1 / out.span, 0};
  } else {
    out.span = place[2] - place[0];
    for (std::size_t m = 0; m < 3; ++m) {
      const double a = place[(m + 1) % 3];
      const double b = place[(m + 2) % 3];
      out.weight[m] = (2 * here - a - b) / ((place[m] - a) * (place[m] - b));
    }
  }
  out.span = std::abs(out.span);
  out.count = offsets.count;
  return out;
}

Along along_x(const Grid& grid) {
  const Axis& x = grid.axes[0];
  const std::vector<double>& at = x.coordinates;
  const std::size_t width = at.size();
  if (width < 4) return Along(at);
  const double extent = at.back() - at.front();
  if (grid.columns) {
    if (!rows_close(*grid.columns, width)) return Along(at);
    if (ends_coincide(*grid.columns, width)) return Along(at, width - 1, extent);
    return Along(at, width, extent + 0.5 * (at[width - 1] - at[width - 2] + at[1] - at[0]));
  }
  if (x.kind != AxisKind::longitude) return Along(at);
  double widest = 0;
  for (std::size_t i = 0; i + 1 < width; ++i) widest = std::max(widest, at[i + 1] - at[i]);
  const double gap = 360 - extent;
  if (std::abs(gap) <= 1e-3 * widest) return Along(at, width - 1, 360);
  return gap > 0 && gap <= widest_gap * widest ? Along(at, width, 360) : Along(at);
}

}  // namespace windsplat::data::derived
