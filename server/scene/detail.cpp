// Levels of detail: from the size of a cell in pixels to the coarser lattice and its lines.
#include "server/scene/detail.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/scene/camera.hpp"
#include "server/scene/lattice.hpp"

namespace windsplat::scene {

namespace {

// Calls visit(first, end) with the half-open range of every group of 2^halvings samples.
template <class Visit>
void each_group(std::size_t samples, int halvings, const Visit& visit) {
  const std::size_t size = std::size_t{1} << static_cast<unsigned>(halvings);
  for (std::size_t first = 0; first < samples; first += size) {
    visit(first, std::min(first + size, samples));
  }
}

double width_of(const std::vector<double>& spacing, std::size_t first, std::size_t end) {
  double width = 0;
  for (std::size_t i = first; i < end; ++i) width += spacing[i];
  return width;
}

double widest_cell(const std::vector<double>& spacing, int halvings) {
  double widest = 0;
  each_group(spacing.size(), halvings, [&](std::size_t first, std::size_t end) {
    widest = std::max(widest, width_of(spacing, first, end));
  });
  return widest;
}

}  // namespace

double pixels_per_unit(const Camera& camera, const Lattice& lattice) {
  const double scale = 0.5 * camera.height / camera.half_height;
  return camera.perspective ? scale / view_depths(camera, lattice)[0] : scale;
}

std::array<int, 3> choose_level(const Camera& camera, const Lattice& lattice,
                                const std::optional<Slice>& slice, const MergeLimits& limits) {
  std::array<int, 3> level{0, 0, 0};
  if (lattice.places) return level;
  const double scale = pixels_per_unit(camera, lattice);
  for (double merged = 1; 2 * merged <= limits.samples; merged *= 2) {
    std::size_t finest = 3;
    double finest_px = halved_below_px;
    for (std::size_t a = 0; a < 3; ++a) {
      const bool stays = (slice && slice->axis == static_cast<int>(a)) ||
                         level[a] == limits.halvings ||
                         data::halved(lattice.dims[a], level[a] + 1) < 2;
      const double cell_px = stays ? 0 : widest_cell(lattice.spacing[a], level[a]) * scale;
      if (stays || cell_px >= finest_px) continue;
      finest = a;
      finest_px = cell_px;
    }
    if (finest == 3) break;
    ++level[finest];
  }
  return level;
}

double finest_cell_px(const Camera& camera, const Lattice& lattice,
                      const std::optional<Slice>& slice) {
  if (lattice.places) return 0;
  double finest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    const bool stays =
        (slice && slice->axis == static_cast<int>(a)) || data::halved(lattice.dims[a], 1) < 2;
    if (!stays) finest = std::min(finest, widest_cell(lattice.spacing[a], 0));
  }
  return std::isfinite(finest) ? finest * pixels_per_unit(camera, lattice) : 0;
}

std::array<int, 3> coarser_level(const Lattice& lattice, const std::optional<Slice>& slice,
                                 std::array<int, 3> level, int times) {
  constexpr double as_fine = 1.5;
  if (lattice.places) return level;
  for (int n = 0; n < times; ++n) {
    std::array<double, 3> widest{};
    double finest = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < 3; ++a) {
      const bool stays = (slice && slice->axis == static_cast<int>(a)) ||
                         data::halved(lattice.dims[a], level[a] + 1) < 2;
      widest[a] = stays ? std::numeric_limits<double>::infinity()
                        : widest_cell(lattice.spacing[a], level[a]);
      finest = std::min(finest, widest[a]);
    }
    for (std::size_t a = 0; a < 3; ++a) level[a] += widest[a] < as_fine * finest ? 1 : 0;
  }
  return level;
}

data::Coarsening coarsening_of(const Lattice& lattice, const std::array<int, 3>& level) {
  data::Coarsening how;
  how.halvings = level;
  for (std::size_t a = 0; a < 3; ++a) {
    if (level[a] > 0) how.widths[a] = lattice.spacing[a];
  }
  return how;
}

std::vector<double> coarsen_along(const std::vector<double>& values,
                                  const std::vector<double>& widths, int halvings) {
  if (halvings == 0) return values;
  std::vector<double> out;
  out.reserve(values.size() / 2 + 1);
  each_group(values.size(), halvings, [&](std::size_t first, std::size_t end) {
    double sum = 0;
    for (std::size_t i = first; i < end; ++i) sum += widths[i] * values[i];
    out.push_back(end - first == 1 ? values[first] : sum / width_of(widths, first, end));
  });
  return out;
}

Lattice coarsen_lattice(const Lattice& lattice, const std::array<int, 3>& level) {
  Lattice out = lattice;
  for (std::size_t a = 0; a < 3; ++a) {
    if (level[a] == 0) continue;
    const auto& spacing = lattice.spacing[a];
    out.positions[a] = coarsen_along(lattice.positions[a], spacing, level[a]);
    out.dims[a] = data::halved(lattice.dims[a], level[a]);
    out.spacing[a].clear();
    each_group(spacing.size(), level[a], [&](std::size_t first, std::size_t end) {
      out.spacing[a].push_back(width_of(spacing, first, end));
    });
  }
  return out;
}

namespace {

bool is_even(const std::vector<double>& spacing) {
  constexpr double rounding = 1e-9;
  const auto [least, most] = std::minmax_element(spacing.begin(), spacing.end());
  return *most - *least <= rounding * *most;
}

// Places and boxes of the samples of an uneven axis, in widths of their groups.
void place_in_groups(const Lattice& fine, std::size_t a, int halvings, VectorLayer& layer) {
  const auto& spacing = fine.spacing[a];
  const auto stride = static_cast<std::size_t>(layer.data_stride);
  const std::vector<double> centres = coarsen_along(fine.positions[a], spacing, halvings);
  std::size_t group = 0;
  each_group(spacing.size(), halvings, [&](std::size_t first, std::size_t end) {
    const double width = width_of(spacing, first, end);
    for (std::size_t i = first; i < end; ++i) {
      const std::size_t kernel = i / stride * stride;
      const double box = width_of(spacing, kernel, std::min(kernel + stride, spacing.size()));
      layer.group_place[a].push_back(
          static_cast<float>((fine.positions[a][i] - centres[group]) / width));
      layer.group_box[a].push_back(static_cast<float>(box / width));
    }
    ++group;
  });
}

}  // namespace

void merge_lines(const Lattice& fine, const std::array<int, 3>& level, double pixels_per_unit,
                 VectorLayer& layer) {
  layer.halvings = level;
  layer.data_dims = fine.dims;
  layer.first_sample = fine.first;
  if (level == std::array{0, 0, 0}) return;
  layer.data_stride = std::exchange(layer.stride, 1);
  double lines = 1;
  double apart_px = 0;  // first to last line of a group, at the nearest point of the box
  for (std::size_t a = 0; a < 3; ++a) {
    layer.drawn_places[a] = data::drawn_places(level[a], layer.data_stride);
    const bool even = is_even(fine.spacing[a]) || (level[a] == 0 && layer.data_stride == 1);
    if (!even) place_in_groups(fine, a, level[a], layer);
    const double group = layer.drawn_places[a];
    const double apart = layer.data_stride * cell_size(fine, a);
    lines *= group;
    apart_px = std::max(apart_px, (group - 1) * apart * pixels_per_unit);
  }
  const double together = lines * layer.opacity;
  layer.opacity = std::min(1.0, together);
  if (together <= 1) return;
  const double wider = 0.5 * std::min((together - 1) * (layer.r1 + layer.r2), apart_px);
  layer.r1 += wider;
  layer.r2 += wider;
}

}  // namespace windsplat::scene
