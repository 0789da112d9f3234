// Tangents are differences of positions on the unit sphere, expressed along local east and north.
#include "server/data/cf/fields/rotation.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace windsplat::data::cf {

namespace {

struct Plane {
  double east = 0;
  double north = 0;
};

class Tangents {
 public:
  explicit Tangents(const Columns& columns) : columns_(columns) {}

  // Direction of a line of `count` columns, `stride` apart, at column n, the index-th of them: in
  // the tangent plane. At an end that of the parabola through three columns.
  [[nodiscard]] Plane along(std::size_t n, std::size_t index, std::size_t count,
                            std::size_t stride) const {
    const bool at_start = index == 0;
    const bool at_end = index + 1 >= count;
    const double longitude = columns_.longitude[n] * degree;
    const double latitude = columns_.latitude[n] * degree;
    Way way = from_to(at_start ? n : n - stride, at_end ? n : n + stride);
    if (at_start != at_end && count > 2) {
      const std::size_t far = at_start ? n + 2 * stride : n - 2 * stride;
      const Way beyond = at_start ? from_to(n + stride, far) : from_to(far, n - stride);
      const double near_length = length_of(way);
      const double far_length = length_of(beyond);
      // Derivative at 0 of the parabola through 0, near and near + far, times a positive factor.
      const double turn = far_length > 0 ? near_length / far_length : 0;
      for (std::size_t c = 0; c < 3; ++c) {
        way[c] += turn * (way[c] - turn * beyond[c]) / (1 + turn);
      }
    }
    const double outward = std::cos(longitude) * way[0] + std::sin(longitude) * way[1];
    Plane plane{-std::sin(longitude) * way[0] + std::cos(longitude) * way[1],
                -std::sin(latitude) * outward + std::cos(latitude) * way[2]};
    const double length = std::hypot(plane.east, plane.north);
    if (length > 0) {
      plane.east /= length;
      plane.north /= length;
    }
    return plane;
  }

 private:
  using Way = std::array<double, 3>;
  static constexpr double degree = std::numbers::pi / 180.0;
  static double length_of(const Way& way) { return std::hypot(way[0], way[1], way[2]); }
  [[nodiscard]] Way from_to(std::size_t from, std::size_t to) const {
    const auto a = place(from);
    const auto b = place(to);
    return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  }
  [[nodiscard]] std::array<double, 3> place(std::size_t n) const {
    const double longitude = columns_.longitude[n] * degree;
    const double latitude = columns_.latitude[n] * degree;
    return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
            std::sin(latitude)};
  }
  const Columns& columns_;
};

}  // namespace

GridBearing bearing_of(const Columns& columns, std::size_t width) {
  const Tangents tangents(columns);
  const std::size_t count = columns.longitude.size();
  const std::size_t height = count / width;
  AxisTangents out;
  for (std::size_t n = 0; n < count; ++n) {
    const Plane x = tangents.along(n, n % width, width, 1);
    const Plane y = tangents.along(n, n / width, height, width);
    out.x.push_back({static_cast<float>(x.east), static_cast<float>(x.north)});
    out.y.push_back({static_cast<float>(y.east), static_cast<float>(y.north)});
  }
  return bearing_of(out);
}

GridBearing bearing_of(const AxisTangents& tangents) {
  const auto& [x, y] = tangents;
  double turning = 0;  // positive if y is to the left of x
  for (std::size_t n = 0; n < x.size(); ++n) {
    turning += static_cast<double>(x[n][0] * y[n][1] - x[n][1] * y[n][0]);
  }
  GridBearing bearing;
  bearing.side = turning < 0 ? -1.0F : 1.0F;
  for (std::size_t n = 0; n < x.size(); ++n) {
    float east = x[n][0] + bearing.side * y[n][1];
    float north = x[n][1] - bearing.side * y[n][0];
    const float length = std::hypot(east, north);
    east = length > 0 ? east / length : 1;
    north = length > 0 ? north / length : 0;
    bearing.east.push_back(east);
    bearing.north.push_back(north);
  }
  return bearing;
}

void rotate(const GridBearing& bearing, std::size_t levels, float* east, float* north) {
  const std::size_t layer = bearing.east.size();
  for (std::size_t k = 0; k < levels; ++k) {
    for (std::size_t n = 0; n < layer; ++n) {
      float& u = east[k * layer + n];
      float& v = north[k * layer + n];
      const float along_x = u * bearing.east[n] + v * bearing.north[n];
      const float along_y = bearing.side * (v * bearing.east[n] - u * bearing.north[n]);
      u = along_x;
      v = along_y;
    }
  }
}

}  // namespace windsplat::data::cf
