// Columns and levels -> positions -> mean cells and the box.
#include "server/scene/bend.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "server/base/check.hpp"
#include "server/scene/angles.hpp"
#include "server/scene/masked_heights.hpp"

namespace windsplat::scene {

namespace {

using data::AxisKind;
using protocol::GeometryMapping;
using protocol::VerticalPlacement;

constexpr double shell_share = 0.15;

Error no_heights(const std::string& detail) {
  return make_error_at(ErrorKind::invalid, "/geometry/heightField", detail);
}

// Longitude and latitude of every column, degrees, x fastest.
data::Columns columns_of(const data::Grid& grid) {
  if (grid.columns) return *grid.columns;
  data::Columns columns;
  for (const double latitude : grid.axes[1].coordinates) {
    for (const double longitude : grid.axes[0].coordinates) {
      columns.longitude.push_back(longitude);
      columns.latitude.push_back(latitude);
    }
  }
  return columns;
}

// Uniform coordinates over the range of the columns, as many as the axis has.
void span_evenly(const std::vector<double>& values, data::Axis& axis, AxisKind kind) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const std::size_t count = axis.coordinates.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double share = count < 2 ? 0.5 : static_cast<double>(i) / static_cast<double>(count - 1);
    axis.coordinates[i] = *low + share * (*high - *low);
  }
  axis.kind = kind;
}

// World units per degree and the degree at the origin, along one axis of a uniform lattice.
struct Affine {
  double scale = 0;
  double centre = 0;
  [[nodiscard]] double operator()(double value) const { return (value - centre) * scale; }
};

Affine map_of(const data::Axis& axis, const std::vector<double>& world) {
  const std::vector<double>& raw = axis.coordinates;
  Affine map;
  if (raw.size() > 1) map.scale = (world.back() - world.front()) / (raw.back() - raw.front());
  map.centre = 0.5 * (raw.front() + raw.back());
  return map;
}

// World height of every sample; masked heights are replaced (extend_over_mask).
class Elevations {
 public:
  // around: as Lattice::around.
  Elevations(const Lattice& straight, const Heights* heights,
             const std::optional<std::array<double, 2>>& extent, int around)
      : levels_(straight.positions[2]),
        width_(static_cast<std::size_t>(straight.dims[0])),
        period_(static_cast<std::size_t>(around)) {
    layer_.resize(width_ * static_cast<std::size_t>(straight.dims[1]));
    if (heights == nullptr) return;
    values_ = heights->values->component(0);
    masked_ = heights->values->masked > 0;
    if (!extent) return;
    map_.scale = (straight.box_max.z - straight.box_min.z) / ((*extent)[1] - (*extent)[0]);
    map_.centre = 0.5 * ((*extent)[0] + (*extent)[1]);
  }
  // By column. Valid until the next call.
  const std::vector<double>& of_level(std::size_t level) {
    if (values_ == nullptr) {
      std::fill(layer_.begin(), layer_.end(), levels_[level]);
      return layer_;
    }
    const float* const from = values_ + level * layer_.size();
    for (std::size_t c = 0; c < layer_.size(); ++c) {
      layer_[c] = map_(static_cast<double>(from[c]));
    }
    if (masked_) extend_over_mask(layer_, width_, period_);
    return layer_;
  }

 private:
  const std::vector<double>& levels_;
  std::size_t width_ = 0;
  std::size_t period_ = 0;
  const float* values_ = nullptr;
  bool masked_ = false;
  Affine map_;
  std::vector<double> layer_;
};

// Bottom and top of the box as raw heights: half a mean cell beyond the extreme samples. Empty for
// a single level at constant height.
std::optional<std::array<double, 2>> extent_of(const Heights& heights, const data::Axis& means) {
  double low = static_cast<double>(heights.values->range[0]);
  double high = static_cast<double>(heights.values->range[1]);
  const std::vector<double>& at = means.coordinates;
  if (at.size() > 1) {
    low -= 0.5 * (at[1] - at[0]);
    high += 0.5 * (at[at.size() - 1] - at[at.size() - 2]);
  }
  if (!(high > low)) return std::nullopt;
  return std::array{low, high};
}

// Edge vectors of the cells of samples, as defined in scene.hpp.
class Cells {
 public:
  explicit Cells(const Lattice& lattice) : lattice_(lattice) {
    stride_ = {
        1, static_cast<std::size_t>(lattice.dims[0]),
        static_cast<std::size_t>(lattice.dims[0]) * static_cast<std::size_t>(lattice.dims[1])};
  }
  [[nodiscard]] glm::dvec3 place(std::size_t n) const {
    const std::array<float, 3>& p = (*lattice_.places)[n];
    return {p[0], p[1], p[2]};
  }
  // index: index of sample n along axis a, which must have more than one sample.
  [[nodiscard]] glm::dvec3 edge(std::size_t n, std::size_t a, int index) const {
    if (a == 0 && lattice_.around > 0) {
      const auto around = static_cast<std::size_t>(lattice_.around);
      const auto at = static_cast<std::size_t>(index);
      const std::size_t row = n - at;
      return 0.5 * (place(row + (at + 1) % around) - place(row + (at + around - 1) % around));
    }
    const bool first = index == 0;
    const bool last = index + 1 == lattice_.dims[a];
    const glm::dvec3 across = place(last ? n : n + stride_[a]) - place(first ? n : n - stride_[a]);
    return first || last ? across : 0.5 * across;
  }

 private:
  const Lattice& lattice_;
  std::array<std::size_t, 3> stride_{};
};

// Calls body(n, index) for every sample.
template <class Body>
void for_samples(const std::array<int, 3>& dims, const Body& body) {
  std::size_t n = 0;
  std::array<int, 3> at{};
  for (at[2] = 0; at[2] < dims[2]; ++at[2]) {
    for (at[1] = 0; at[1] < dims[1]; ++at[1]) {
      for (at[0] = 0; at[0] < dims[0]; ++at[0]) body(n++, at);
    }
  }
}

// Sets spacing[a] to the mean edge lengths by index along axis a, and positions accordingly,
// centred on 0.
void measure(Lattice& lattice, std::size_t a) {
  const Cells cells(lattice);
  std::vector<double> sums(static_cast<std::size_t>(lattice.dims[a]), 0.0);
  for_samples(lattice.dims, [&](std::size_t n, const std::array<int, 3>& at) {
    sums[static_cast<std::size_t>(at[a])] += glm::length(cells.edge(n, a, at[a]));
  });
  double samples = 1;
  for (std::size_t b = 0; b < 3; ++b) samples *= b == a ? 1.0 : lattice.dims[b];
  double length = 0;
  for (double& sum : sums) {
    sum /= samples;
    length += sum;
  }
  double edge = -0.5 * length;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    lattice.positions[a][i] = edge + 0.5 * sums[i];
    edge += sums[i];
  }
  lattice.spacing[a] = std::move(sums);
}

// An axis of one sample gets the smallest thickness of the others.
void thin_axes(Lattice& lattice) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    if (lattice.dims[a] > 1) thinnest = std::min(thinnest, cell_size(lattice, a));
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (lattice.dims[a] == 1 && std::isfinite(thinnest)) lattice.spacing[a] = {thinnest};
  }
}

// Translates and scales so that the box is centred on the origin and its longest edge is 2.
void settle(Lattice& lattice, std::vector<std::array<float, 3>>& places) {
  const glm::dvec3 centre = 0.5 * (lattice.box_min + lattice.box_max);
  const glm::dvec3 edge = lattice.box_max - lattice.box_min;
  const double scale = 2.0 / std::max({edge.x, edge.y, edge.z});
  for (auto& place : places) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto value = static_cast<double>(place[a]) - centre[static_cast<int>(a)];
      place[a] = static_cast<float>(value * scale);
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    for (double& at : lattice.positions[a]) at = (at - centre[static_cast<int>(a)]) * scale;
    for (double& width : lattice.spacing[a]) width *= scale;
  }
  lattice.box_min = -0.5 * scale * edge;
  lattice.box_max = 0.5 * scale * edge;
}

// Radii of a shell of outer radius 1.
struct Shell {
  double inner = 1;  // radius(share) is by relative height
  [[nodiscard]] double radius(double share) const { return inner + share * (1.0 - inner); }
};

// The longer edge of a region in radii where it is widest, at most 1; by its axes in degrees.
double extent_on_globe(const data::Grid& even) {
  const auto span = [&even](std::size_t a) {
    const std::vector<double>& at = even.axes[a].coordinates;
    if (at.size() < 2) return 0.0;
    return (at.back() - at.front()) / (1 - 1.0 / static_cast<double>(at.size()));
  };
  const auto& at = even.axes[1].coordinates;
  const double nearest = std::max({at.front(), -at.back(), 0.0});  // latitude, to the equator
  const double degrees = std::max(span(0) * std::cos(nearest * radians_per_degree), span(1));
  return degrees > 0 ? std::min(degrees * radians_per_degree, 1.0) : 1.0;
}

// A single level is as thick as its columns are apart, at most as a full shell.
Shell shell_of(const Lattice& straight, const data::Grid& even, double scale, bool one_height) {
  Shell shell{1.0 / (1.0 + shell_share * extent_on_globe(even) * scale)};
  if (straight.dims[2] > 1 || !one_height) return shell;
  for (std::size_t a = 0; a < 2; ++a) {
    const std::vector<double>& at = even.axes[a].coordinates;
    if (at.size() < 2) continue;
    const double step =
        (at.back() - at.front()) / static_cast<double>(at.size() - 1) * radians_per_degree;
    shell.inner = std::max(shell.inner, 1.0 - step);
  }
  return shell;
}

using Places = std::vector<std::array<float, 3>>;

// Unit vectors from the centre of the globe to the columns.
std::vector<glm::dvec3> directions_of(const data::Columns& columns) {
  std::vector<glm::dvec3> up;
  up.reserve(columns.longitude.size());
  for (std::size_t c = 0; c < columns.longitude.size(); ++c) {
    const double longitude = columns.longitude[c] * radians_per_degree;
    const double latitude = columns.latitude[c] * radians_per_degree;
    up.emplace_back(std::cos(latitude) * std::sin(longitude),
                    -std::cos(latitude) * std::cos(longitude), std::sin(latitude));
  }
  return up;
}

// Whether in each row of `width` columns the first and column `last` are at most `steps` times as
// far apart as the farthest neighbours between them.
bool meet(const std::vector<glm::dvec3>& up, std::size_t width, std::size_t last, double steps) {
  const auto angle = [&up](std::size_t a, std::size_t b) {
    return std::asin(std::min(0.5 * glm::distance(up[a], up[b]), 1.0));
  };
  for (std::size_t row = 0; row < up.size(); row += width) {
    double farthest = 0;
    for (std::size_t i = row; i < row + last; ++i) farthest = std::max(farthest, angle(i, i + 1));
    if (angle(row, row + last) > steps * farthest) return false;
  }
  return true;
}

// Whether a row reaches around more than half the globe.
bool turn(const data::Columns& columns, std::size_t width) {
  const std::vector<double>& at = columns.longitude;
  for (std::size_t row = 0; row < at.size(); row += width) {
    if (std::abs(at[row + width - 1] - at[row]) > 180) return true;
  }
  return false;
}

// Lattice::around. Up to two columns may repeat the first ones, as in some ocean models.
int columns_around(const data::Columns& columns, const std::vector<glm::dvec3>& up,
                   std::size_t width) {
  if (!turn(columns, width)) return 0;
  constexpr double same = 0.01;  // steps
  constexpr double next = 1.5;
  constexpr std::size_t fewest = 3;
  for (const std::size_t repeated : {2, 1}) {
    if (width < fewest + repeated || !meet(up, width, width - repeated, same)) continue;
    return static_cast<int>(width - repeated);
  }
  return width >= fewest && meet(up, width, width - 1, next) ? static_cast<int>(width) : 0;
}

Places on_sphere(const Lattice& straight, const std::vector<glm::dvec3>& up, Elevations& elevations,
                 const Shell& shell) {
  const double bottom = straight.box_min.z;
  const double height = straight.box_max.z - bottom;
  Places places;
  places.reserve(up.size() * straight.positions[2].size());
  for (std::size_t k = 0; k < straight.positions[2].size(); ++k) {
    const std::vector<double>& heights = elevations.of_level(k);
    for (std::size_t c = 0; c < up.size(); ++c) {
      const glm::dvec3 p = up[c] * shell.radius((heights[c] - bottom) / height);
      places.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    }
  }
  return places;
}

// columns: null if the columns lie along the axes.
Places on_map(const Lattice& straight, const data::Grid& even, const data::Columns* columns,
              Elevations& elevations) {
  Affine map_x = map_of(even.axes[0], straight.positions[0]);
  Affine map_y = map_of(even.axes[1], straight.positions[1]);
  if (map_x.scale == 0) map_x.scale = map_y.scale;
  if (map_y.scale == 0) map_y.scale = map_x.scale;
  const auto width = static_cast<std::size_t>(straight.dims[0]);
  const std::size_t layer = width * static_cast<std::size_t>(straight.dims[1]);
  Places places;
  places.reserve(layer * straight.positions[2].size());
  for (std::size_t k = 0; k < straight.positions[2].size(); ++k) {
    const std::vector<double>& heights = elevations.of_level(k);
    for (std::size_t c = 0; c < layer; ++c) {
      const double x =
          columns == nullptr ? straight.positions[0][c % width] : map_x(columns->longitude[c]);
      const double y =
          columns == nullptr ? straight.positions[1][c / width] : map_y(columns->latitude[c]);
      places.push_back(
          {static_cast<float>(x), static_cast<float>(y), static_cast<float>(heights[c])});
    }
  }
  return places;
}

// Converts levels to distances from the middle of the shell.
void set_radii(const Shell& shell, Lattice& lattice) {
  const double height = lattice.box_max.z - lattice.box_min.z;
  for (std::size_t k = 0; k < lattice.positions[2].size(); ++k) {
    const double share = (lattice.positions[2][k] - lattice.box_min.z) / height;
    lattice.positions[2][k] = shell.radius(share) - shell.radius(0.5);
    lattice.spacing[2][k] *= (1.0 - shell.inner) / height;
  }
}

Result<void> check_cells(const Lattice& lattice) {
  for (const std::vector<double>& spacing : lattice.spacing) {
    for (const double width : spacing) {
      if (!(width > 0) || !std::isfinite(width)) {
        return make_error(ErrorKind::bad_data, "neighbouring columns have equal positions");
      }
    }
  }
  return {};
}

}  // namespace

void set_box(Lattice& lattice) {
  const Cells cells(lattice);
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high(-std::numeric_limits<double>::infinity());
  for_samples(lattice.dims, [&](std::size_t n, const std::array<int, 3>& at) {
    glm::dvec3 reach(0);
    for (std::size_t a = 0; a < 3; ++a) {
      if (lattice.dims[a] > 1) {
        reach += 0.5 * glm::abs(cells.edge(n, a, at[a]));
      } else {
        reach = glm::max(reach, glm::dvec3(0.5 * lattice.spacing[a][0]));
      }
    }
    low = glm::min(low, cells.place(n) - reach);
    high = glm::max(high, cells.place(n) + reach);
  });
  lattice.box_min = low;
  lattice.box_max = high;
}

Result<void> check_mapping(const data::Grid& grid, GeometryMapping mapping) {
  if (mapping == GeometryMapping::flat || grid.columns) return {};
  const auto& [x, y, z] = grid.axes;
  const bool along_axes = x.kind == AxisKind::longitude && y.kind == AxisKind::latitude;
  if (mapping == GeometryMapping::sphere && along_axes) return {};
  return make_error_at(ErrorKind::invalid, "/geometry/mapping",
                       mapping == GeometryMapping::sphere
                           ? "sphere requires longitudes and latitudes, which this dataset lacks"
                           : "curvilinear requires 2-D longitudes and latitudes without gaps, "
                             "which this dataset lacks");
}

Result<data::Grid> grid_with_heights(const data::Grid& grid, const Heights& heights) {
  const std::array<int, 3> dims = grid.dims();
  WINDSPLAT_CHECK(heights.values->dims == dims && heights.values->components == 1);
  const std::size_t layer = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]);
  data::Grid out = grid;
  data::Axis& axis = out.axes[2];
  axis.name = heights.name;
  axis.standard_name.clear();
  axis.units = heights.units;
  axis.kind = AxisKind::height;
  for (std::size_t k = 0; k < axis.coordinates.size(); ++k) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t c = 0; c < layer; ++c) {
      const auto value = static_cast<double>(heights.values->component(0)[k * layer + c]);
      if (!std::isfinite(value)) continue;
      sum += value;
      ++count;
    }
    if (count == 0) return no_heights("level " + std::to_string(k) + " has only masked heights");
    axis.coordinates[k] = sum / static_cast<double>(count);
    if (k > 0 && !(axis.coordinates[k] > axis.coordinates[k - 1])) {
      return no_heights("level " + std::to_string(k) +
                        " is not above the level below it on average");
    }
  }
  return out;
}

Result<Lattice> bend_lattice(const data::Grid& grid, const protocol::GeometryView& geometry,
                             const Heights* heights) {
  const bool flat = geometry.mapping == GeometryMapping::flat;
  const bool sphere = geometry.mapping == GeometryMapping::sphere;
  if (sphere && geometry.vertical == VerticalPlacement::metric) {
    return make_error_at(ErrorKind::invalid, "/geometry/vertical",
                         "metric is not available on a sphere: set /geometry/scale/2");
  }
  data::Grid even = grid;
  protocol::GeometryView straight_geometry = geometry;
  std::optional<std::array<double, 2>> extent;
  if (heights != nullptr) {
    auto raised = grid_with_heights(grid, *heights);
    if (!raised) return raised.error();
    even = std::move(*raised);
    if (geometry.vertical != VerticalPlacement::metric) {
      straight_geometry.vertical = VerticalPlacement::linear;
    }
    extent = extent_of(*heights, even.axes[2]);
  }
  std::optional<data::Columns> columns;
  if (!flat) {
    if (auto ok = check_mapping(grid, geometry.mapping); !ok) return ok.error();
    columns = columns_of(grid);
    span_evenly(columns->longitude, even.axes[0], AxisKind::longitude);
    span_evenly(columns->latitude, even.axes[1], AxisKind::latitude);
  }
  if (sphere) straight_geometry.scale = {1, 1, 1};
  auto straight = place_straight(even, straight_geometry, extent);
  if (!straight) return straight.error();
  const bool one_height = !extent;
  const Shell shell = shell_of(*straight, even, geometry.scale[2], one_height);
  Lattice lattice = *straight;
  std::vector<glm::dvec3> up;
  if (sphere) {
    up = directions_of(*columns);
    lattice.around = columns_around(*columns, up, static_cast<std::size_t>(lattice.dims[0]));
  }
  Elevations elevations(*straight, heights, extent, lattice.around);
  auto places = std::make_shared<Places>();
  if (sphere) {
    *places = on_sphere(*straight, up, elevations, shell);
  } else {
    *places = on_map(*straight, even, columns ? &*columns : nullptr, elevations);
  }
  lattice.places = places;
  const auto measure_columns = [&lattice] {
    for (std::size_t a = 0; a < 2; ++a) {
      if (lattice.dims[a] > 1) measure(lattice, a);
    }
    thin_axes(lattice);
  };
  if (sphere) {
    set_radii(shell, lattice);
    lattice.inner_radius = shell.inner;
    measure_columns();
    set_box(lattice);
    lattice.box_min = glm::max(lattice.box_min, glm::dvec3(-1));
    lattice.box_max = glm::min(lattice.box_max, glm::dvec3(1));
  } else {
    thin_axes(lattice);
    set_box(lattice);
    settle(lattice, *places);
    if (!flat) measure_columns();
  }
  if (auto ok = check_cells(lattice); !ok) return ok.error();
  return lattice;
}

}  // namespace windsplat::scene
