#include "server/data/cf/mesh/centers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/cell_lists.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::size_t cells_compared = 10'000;

// Longitudes and latitudes of the entries of a dimension; -1: none.
std::array<int, 2> centers_on(const FileContents& contents, int dimension) {
  std::array<int, 2> out{-1, -1};
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    const int side = side_of(variable);
    if (!variable.numeric || variable.dims != std::vector{dimension} || side == 0) continue;
    int& own = out.at(side < 0 ? 0 : 1);
    if (own < 0) own = static_cast<int>(v);
  }
  return out;
}

// Whether a position lies in the box around a cell, enlarged by a quarter on each side. True for
// cells at a pole, which have no box.
bool is_near_cell(const Mesh& mesh, std::size_t cell, double longitude, double latitude,
                  Outline& outline) {
  if (!outline_of(mesh, cell, outline) || outline.polar) return true;
  std::array<double, 2> low{std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::infinity()};
  std::array<double, 2> high{-low[0], -low[1]};
  for (const PlanePoint& point : outline.points) {
    for (std::size_t a = 0; a < 2; ++a) {
      low.at(a) = std::min(low.at(a), point.at(a));
      high.at(a) = std::max(high.at(a), point.at(a));
    }
  }
  constexpr double sizes_max = 0.75;  // from the middle of the box
  const double aside = std::remainder(longitude - (low[0] + high[0]) / 2, 360.0);
  return std::abs(aside) <= sizes_max * (high[0] - low[0]) &&
         std::abs(latitude - (low[1] + high[1]) / 2) <= sizes_max * (high[1] - low[1]);
}

// Whether a position is equally far from all corners of a cell, within a twentieth of its longest
// edge, on the sphere or in a plane of longitudes and latitudes. The circumcentre of a cell with an
// obtuse angle lies outside of it.
bool is_circumcenter(const Mesh& mesh, std::size_t cell, double longitude, double latitude,
                     ChartCell& chart) {
  constexpr double radian = std::numbers::pi / 180;
  chart_of(mesh, cell, false, chart);
  const PlanePoint center = chart.in_chart(longitude, latitude);
  const auto in_space = [](const PlanePoint& p) {
    const double from_axis = std::cos(p[1] * radian);
    return std::array<double, 3>{from_axis * std::cos(p[0] * radian),
                                 from_axis * std::sin(p[0] * radian), std::sin(p[1] * radian)};
  };
  const auto chord = [&](const PlanePoint& a, const PlanePoint& b) {
    const auto one = in_space(a);
    const auto other = in_space(b);
    return std::hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]);
  };
  const double shrink = std::cos(chart.mean()[1] * radian);
  const auto shrunk = [&](const PlanePoint& a, const PlanePoint& b) {
    return std::hypot((a[0] - b[0]) * shrink, a[1] - b[1]);
  };
  const auto plain = [](const PlanePoint& a, const PlanePoint& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1]);
  };
  const auto is_equally_far = [&](const auto& distance) {
    constexpr double tolerance = 0.05;
    double nearest = std::numeric_limits<double>::infinity();
    double farthest = 0;
    double longest = 0;
    for (std::size_t i = 0; i < chart.points.size(); ++i) {
      const double own = distance(center, chart.points[i]);
      nearest = std::min(nearest, own);
      farthest = std::max(farthest, own);
      const PlanePoint& next = chart.points[(i + 1) % chart.points.size()];
      longest = std::max(longest, distance(chart.points[i], next));
    }
    return farthest - nearest <= tolerance * longest;
  };
  return is_equally_far(chord) || is_equally_far(shrunk) || is_equally_far(plain);
}

}  // namespace

Result<void> check_centers(const ArrayFile& file, const std::vector<int>& dimensions,
                           const Mesh& mesh) {
  if (!mesh.on_sphere) return {};
  const std::size_t stride = std::max<std::size_t>(1, mesh.cells() / cells_compared);
  Outline outline;
  ChartCell chart;
  for (const int dimension : dimensions) {
    const auto [x, y] = centers_on(file.contents(), dimension);
    if (x < 0 || y < 0) continue;
    const auto longitudes = unpacked_degrees(file, x);
    if (!longitudes) return longitudes.error();
    const auto latitudes = unpacked_degrees(file, y);
    if (!latitudes) return latitudes.error();
    std::size_t compared = 0;
    std::size_t apart = 0;
    std::size_t first = 0;
    for (std::size_t c = 0; c < mesh.cells(); c += stride) {
      if (!std::isfinite((*longitudes)[c]) || !std::isfinite((*latitudes)[c])) continue;
      ++compared;
      if (is_near_cell(mesh, c, (*longitudes)[c], (*latitudes)[c], outline) ||
          is_circumcenter(mesh, c, (*longitudes)[c], (*latitudes)[c], chart)) {
        continue;
      }
      if (apart++ == 0) first = c;
    }
    if (apart * 100 <= compared) continue;
    return make_error(ErrorKind::bad_data,
                      "the cells of the mesh do not lie where " +
                          in_quotes(file.contents().variables[at(x)].name) + " and " +
                          in_quotes(file.contents().variables[at(y)].name) + " place them: " +
                          std::to_string(apart) + " of " + std::to_string(compared) +
                          " compared, first cell " + std::to_string(first + 1) +
                          "; the mesh belongs to other data, or the numbers of its nodes start at "
                          "another index than the file says");
  }
  return {};
}

}  // namespace windsplat::data::cf
