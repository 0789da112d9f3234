// Where a point of the world lies on the Earth, by the placement of a dataset.
#pragma once

#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "server/ground/atlas.hpp"
#include "server/ground/identity.hpp"

namespace windsplat::ground {

// east, north: gradients of the ways to the east and to the north, in degrees of a great circle per
// world unit.
struct Located {
  Place place;
  glm::dvec3 east{0}, north{0};
};

class Map {
 public:
  Map() = default;
  Map(const Map&) = delete;
  Map& operator=(const Map&) = delete;
  virtual ~Map() = default;
  [[nodiscard]] virtual Located locate(const glm::dvec3& point) const = 0;
  // The unit vector away from the ground.
  [[nodiscard]] virtual glm::dvec3 up(const glm::dvec3& /*point*/) const { return {0, 0, 1}; }
  // Whether a degree of longitude is as long at every latitude: meridians do not converge.
  [[nodiscard]] virtual bool has_parallel_meridians() const { return false; }
  // Adds what distinguishes it from other maps.
  virtual void identify(Identity& to) const = 0;
};

// About the origin; longitude 0 lies towards -y, longitude 90 towards +x, the north pole towards
// +z.
class Globe : public Map {
 public:
  [[nodiscard]] Located locate(const glm::dvec3& point) const override;
  [[nodiscard]] glm::dvec3 up(const glm::dvec3& point) const override;
  void identify(Identity& to) const override;
};

// Degrees of samples and their positions, at least two of each; linear between them and beyond.
struct Axis {
  std::vector<double> degrees;
  std::vector<double> positions;  // ascending
};

// Longitudes along x, latitudes along y.
class AxesMap : public Map {
 public:
  AxesMap(Axis x, Axis y);
  [[nodiscard]] bool has_parallel_meridians() const override { return true; }
  [[nodiscard]] Located locate(const glm::dvec3& point) const override;
  void identify(Identity& to) const override;

 private:
  Axis x_, y_;
};

// A longitude and a latitude for every column, x fastest; linear along x and y in each cell of four
// columns, and beyond the outermost as in them.
struct Columns {
  std::vector<double> x, y;  // positions, ascending, at least two of each
  std::shared_ptr<const std::vector<double>> longitudes, latitudes;
};

class ColumnsMap : public Map {
 public:
  explicit ColumnsMap(Columns columns);
  [[nodiscard]] Located locate(const glm::dvec3& point) const override;
  void identify(Identity& to) const override;

 private:
  Columns columns_;
};

}  // namespace windsplat::ground
