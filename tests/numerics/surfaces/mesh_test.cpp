// Isosurfaces and sections as triangles: closed forms, topology, masked samples.
#include "server/surface/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "server/base/thread_pool.hpp"

namespace windsplat::test {
namespace {

using Function = std::function<double(const glm::dvec3&)>;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

glm::dvec3 vec(const surface::Point& p) { return {p[0], p[1], p[2]}; }

// A lattice with the values of a function at its samples.
struct Lattice {
  std::array<std::vector<double>, 3> positions;
  std::vector<surface::Point> places;
  int around = 0;
  std::vector<float> values;

  [[nodiscard]] surface::Samples samples() const {
    surface::Samples out;
    for (std::size_t a = 0; a < 3; ++a) {
      out.dims.at(a) = static_cast<int>(positions.at(a).size());
      out.positions.at(a) = positions.at(a).data();
    }
    if (!places.empty()) out.places = places.data();
    out.around = around;
    return out;
  }
  void fill(const Function& f) {
    const surface::Samples at = samples();
    values.clear();
    for (int k = 0; k < at.dims[2]; ++k) {
      for (int j = 0; j < at.dims[1]; ++j) {
        for (int i = 0; i < at.dims[0]; ++i) {
          values.push_back(static_cast<float>(f(at.place(i, j, k))));
        }
      }
    }
  }
  [[nodiscard]] surface::Mesh isosurface(double level, unsigned threads = 1) const {
    ThreadPool pool(threads);
    surface::Cut cut;
    cut.level = level;
    cut.values = values.data();
    return surface::extract(samples(), cut, nullptr, pool);
  }
};

std::vector<double> even(int count, double low = -1, double high = 1) {
  std::vector<double> at;
  for (int n = 0; n < count; ++n) at.push_back(low + (high - low) * n / (count - 1));
  return at;
}

Lattice cube(int count, const Function& f) {
  Lattice lattice{{even(count), even(count), even(count)}, {}, 0, {}};
  lattice.fill(f);
  return lattice;
}

// A globe of `columns` x 9 x 5 samples that closes, of radii 0.8 to 1.
Lattice globe(int columns) {
  Lattice lattice{{even(columns), even(9), even(5)}, {}, columns, {}};
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 9; ++j) {
      for (int i = 0; i < columns; ++i) {
        const double longitude = 2 * std::numbers::pi * i / columns;
        const double latitude = (j - 4) / 4.0 * 1.2;
        const double radius = 0.8 + 0.05 * k;
        lattice.places.push_back(
            {static_cast<float>(radius * std::cos(latitude) * std::cos(longitude)),
             static_cast<float>(radius * std::cos(latitude) * std::sin(longitude)),
             static_cast<float>(radius * std::sin(latitude))});
      }
    }
  }
  return lattice;
}

// How many triangles have each side.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides_of(const surface::Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const auto& t : mesh.triangles) {
    for (std::size_t n = 0; n < 3; ++n) ++sides[std::minmax(t.at(n), t.at((n + 1) % 3))];
  }
  return sides;
}

// Vertices in use - sides + triangles.
long euler(const surface::Mesh& mesh) {
  std::set<std::uint32_t> used;
  for (const auto& t : mesh.triangles) used.insert(t.begin(), t.end());
  return static_cast<long>(used.size()) - static_cast<long>(sides_of(mesh).size()) +
         static_cast<long>(mesh.triangles.size());
}

long open_sides(const surface::Mesh& mesh) {
  const auto sides = sides_of(mesh);
  return std::count_if(sides.begin(), sides.end(), [](const auto& s) { return s.second != 2; });
}

double area(const surface::Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const glm::dvec3 p = vec(mesh.places[t[0]]);
    sum += 0.5 * glm::length(glm::cross(vec(mesh.places[t[1]]) - p, vec(mesh.places[t[2]]) - p));
  }
  return sum;
}

double squared(const glm::dvec3& p) { return glm::dot(p, p); }

double farthest_from_sphere(const surface::Mesh& mesh, double radius) {
  double most = 0;
  for (const surface::Point& p : mesh.places)
    most = std::max(most, std::abs(glm::length(vec(p)) - radius));
  return most;
}

TEST(SurfaceMesh, IsosurfaceOfTheSquaredRadiusIsASphereToSecondOrder) {
  constexpr double radius = 0.71;
  const double whole = 4 * std::numbers::pi * radius * radius;
  std::array<double, 2> distance{};
  std::array<double, 2> missing{};
  for (std::size_t n = 0; n < 2; ++n) {
    const surface::Mesh mesh = cube(n == 0 ? 17 : 33, squared).isosurface(radius * radius);
    distance.at(n) = farthest_from_sphere(mesh, radius);
    missing.at(n) = std::abs(area(mesh) / whole - 1);
    EXPECT_EQ(euler(mesh), 2);
    EXPECT_EQ(open_sides(mesh), 0);
    for (std::size_t v = 0; v < mesh.places.size(); ++v) {
      // Central differences of a square are exact, and linear between samples.
      const glm::dvec3 outward = glm::normalize(vec(mesh.places[v]));
      EXPECT_NEAR(glm::dot(outward, vec(mesh.normals[v])), 1, 1e-5);
    }
  }
  EXPECT_GT(distance[0] / distance[1], 3.5);
  EXPECT_LT(distance[1], 0.002);
  EXPECT_GT(missing[0] / missing[1], 3.5);
  EXPECT_LT(missing[1], 0.005);
}

TEST(SurfaceMesh, TorusHasTheEulerCharacteristicZero) {
  const surface::Mesh mesh = cube(41, [](const glm::dvec3& p) {
                               const double ring = std::hypot(p.x, p.y) - 0.6;
                               return ring * ring + p.z * p.z;
                             }).isosurface(0.06);
  EXPECT_EQ(euler(mesh), 0);
  EXPECT_EQ(open_sides(mesh), 0);
}

TEST(SurfaceMesh, NoiseHasAClosedManifoldWithoutCracks) {
  // Every configuration of corners occurs, ambiguous faces among them.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Lattice lattice = cube(20, [&](const glm::dvec3&) { return uniform(random); });
  const surface::Samples at = lattice.samples();
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) {
        const int least = std::min({i, j, k});
        if (least == 0 || std::max({i, j, k}) == 19) lattice.values[at.index(i, j, k)] = -1;
      }
    }
  }
  const surface::Mesh mesh = lattice.isosurface(0.1);
  EXPECT_GT(mesh.triangles.size(), 5000U);
  EXPECT_EQ(open_sides(mesh), 0);
}

TEST(SurfaceMesh, LinearFieldIsCutExactlyFlatOnAnUnevenAxis) {
  const glm::dvec3 normal = glm::normalize(glm::dvec3(1, 2, -0.5));
  Lattice lattice{{even(12), even(9), {-1, -0.95, -0.7, -0.1, 0.6, 0.62, 1}}, {}, 0, {}};
  lattice.fill([&](const glm::dvec3& p) { return 3 * glm::dot(p, normal); });
  for (const bool plane : {false, true}) {
    ThreadPool pool(1);
    surface::Cut cut;
    cut.level = 0.6;
    cut.values = lattice.values.data();
    if (plane) cut.kind = surface::Cut::Kind::plane;
    cut.normal = normal;
    cut.point = 0.2 * normal;
    const surface::Mesh mesh =
        surface::extract(lattice.samples(), cut, lattice.values.data(), pool);
    ASSERT_FALSE(mesh.places.empty());
    for (std::size_t v = 0; v < mesh.places.size(); ++v) {
      EXPECT_NEAR(glm::dot(vec(mesh.places[v]), normal), 0.2, 2e-7);
      EXPECT_NEAR(glm::dot(vec(mesh.normals[v]), normal), 1, 1e-6);
      EXPECT_NEAR(mesh.values[v], 0.6, 1e-6);
    }
  }
}

TEST(SurfaceMesh, PlaneThroughACubeHasTheAreaOfItsSection) {
  const Lattice lattice = cube(7, squared);
  ThreadPool pool(1);
  surface::Cut cut;
  cut.kind = surface::Cut::Kind::plane;
  cut.normal = glm::normalize(glm::dvec3(1, 1, 1));
  cut.values = lattice.values.data();
  const surface::Mesh mesh = surface::extract(lattice.samples(), cut, nullptr, pool);
  EXPECT_NEAR(area(mesh), 3 * std::sqrt(3.0), 1e-5);  // a regular hexagon of side sqrt(2)
}

TEST(SurfaceMesh, FirstMiddleAndLastLayersAreWhole) {
  const Lattice lattice = cube(5, squared);
  ThreadPool pool(1);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double index : {0.0, 1.0, 2.75, 4.0}) {
      surface::Cut cut;
      cut.kind = surface::Cut::Kind::layer;
      cut.axis = axis;
      cut.index = index;
      cut.values = lattice.values.data();
      const surface::Mesh mesh = surface::extract(lattice.samples(), cut, nullptr, pool);
      EXPECT_NEAR(area(mesh), 4, 1e-6) << axis << ' ' << index;
      for (const surface::Point& p : mesh.places) {
        EXPECT_NEAR(p.at(static_cast<std::size_t>(axis)), -1 + 0.5 * index, 1e-6);
      }
    }
  }
}

// Only the two samples of every axis on the far side of the section are valid, or on the near one.
TEST(SurfaceMesh, SectionAlongSamplesNeedsThoseSamplesOnly) {
  ThreadPool pool(1);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int number : {0, 2, 4}) {
      for (const int valid : {-1, 0, 1}) {  // besides the layer: those before, none, those after
        Lattice lattice = cube(5, squared);
        const surface::Samples samples = lattice.samples();
        for (int n = 0; n < 125; ++n) {
          const std::array<int, 3> at{n % 5, n / 5 % 5, n / 25};
          const int off = at.at(static_cast<std::size_t>(axis)) - number;
          if (off != 0 && off * valid <= 0) {
            lattice.values[samples.index(at[0], at[1], at[2])] = nan_value;
          }
        }
        surface::Cut cut;
        cut.values = lattice.values.data();
        for (const bool plane : {false, true}) {
          cut.kind = plane ? surface::Cut::Kind::plane : surface::Cut::Kind::layer;
          cut.axis = axis;
          cut.index = number;
          cut.normal = glm::dvec3(0);
          cut.normal[axis] = number == 2 ? valid == 1 ? 1 : -1 : number - 2;
          cut.point = glm::dvec3(0);
          cut.point[axis] = -1 + 0.5 * number;
          const surface::Mesh mesh = surface::extract(samples, cut, lattice.values.data(), pool);
          EXPECT_NEAR(area(mesh), 4, 1e-6) << axis << ' ' << number << ' ' << valid << plane;
          for (std::size_t v = 0; v < mesh.places.size(); ++v) {
            EXPECT_NEAR(mesh.values[v], squared(vec(mesh.places[v])), 1e-6);
          }
        }
      }
    }
  }
}

// The column at the seam has one cell on each side of it as any other.
TEST(SurfaceMesh, LayerAcrossLongitudesIsOneMeridian) {
  Lattice lattice = globe(24);
  lattice.fill(squared);
  ThreadPool pool(1);
  surface::Cut cut;
  cut.kind = surface::Cut::Kind::layer;
  cut.axis = 0;
  cut.values = lattice.values.data();
  for (const double index : {0.0, 5.0, 7.5, 23.0, 23.5, 24.0}) {
    cut.index = index;
    const surface::Mesh mesh = surface::extract(lattice.samples(), cut, nullptr, pool);
    EXPECT_EQ(mesh.triangles.size(), 8U * 4 * 2) << index;
    for (const surface::Point& p : mesh.places) {
      const double longitude = 2 * std::numbers::pi * index / 24;
      const double off = p[0] * std::sin(longitude) - p[1] * std::cos(longitude);
      EXPECT_NEAR(off, 0, 1e-6) << index;
      EXPECT_GT(p[0] * std::cos(longitude) + p[1] * std::sin(longitude), 0) << index;
    }
  }
}

// A plane through the poles holds two meridians: both are drawn.
TEST(SurfaceMesh, PlaneThroughTwoMeridiansOfAGlobeHasBoth) {
  Lattice lattice = globe(24);
  lattice.fill(squared);
  ThreadPool pool(1);
  surface::Cut cut;
  cut.kind = surface::Cut::Kind::plane;
  cut.normal = {0, 1, 0};
  cut.values = lattice.values.data();
  const surface::Mesh mesh = surface::extract(lattice.samples(), cut, nullptr, pool);
  double most = 0;
  double least = 0;
  for (const surface::Point& p : mesh.places) {
    most = std::max(most, static_cast<double>(p[0]));
    least = std::min(least, static_cast<double>(p[0]));
  }
  EXPECT_NEAR(most, 1, 1e-6);
  EXPECT_NEAR(least, -1, 1e-6);
}

TEST(SurfaceMesh, LayerOfAGlobeIsAShellOfConstantRadiusThatCloses) {
  Lattice lattice = globe(24);
  lattice.fill(squared);
  ThreadPool pool(2);
  surface::Cut cut;
  cut.kind = surface::Cut::Kind::layer;
  cut.axis = 2;
  cut.index = 1.5;
  cut.values = lattice.values.data();
  const surface::Mesh mesh = surface::extract(lattice.samples(), cut, nullptr, pool);
  EXPECT_EQ(mesh.triangles.size(), 24U * 8 * 2);
  EXPECT_LT(farthest_from_sphere(mesh, 0.875), 1e-6);
  EXPECT_EQ(open_sides(mesh), 2 * 24);  // the rings at the highest latitudes
  EXPECT_EQ(euler(mesh), 0);            // a cylinder
  for (std::size_t v = 0; v < mesh.places.size(); ++v) {
    // One-sided differences at the highest latitudes are off by half a cell.
    const glm::dvec3 up = glm::normalize(vec(mesh.places[v]));
    EXPECT_GT(glm::dot(up, vec(mesh.normals[v])), std::abs(up.z) > 0.9 ? 0.98 : 0.99999);
  }
}

TEST(SurfaceMesh, CellsWithAMaskedCornerAreAHoleOfThatSize) {
  Lattice lattice = cube(11, [](const glm::dvec3& p) { return p.z + 0.05; });
  const double before = area(lattice.isosurface(0));
  EXPECT_NEAR(before, 4, 1e-6);
  lattice.values[lattice.samples().index(5, 5, 5)] = nan_value;
  const surface::Mesh mesh = lattice.isosurface(0);
  EXPECT_NEAR(area(mesh), 4 - 4 * 0.2 * 0.2, 1e-6);
  EXPECT_EQ(euler(mesh), 0);  // an annulus
  for (const surface::Point& normal : mesh.normals) EXPECT_NEAR(normal[2], 1, 1e-6);
}

TEST(SurfaceMesh, IsTheSameForAnyNumberOfThreadsAndAsMeasured) {
  const Lattice lattice = cube(19, squared);
  const surface::Mesh one = lattice.isosurface(0.4, 1);
  const surface::Mesh three = lattice.isosurface(0.4, 3);
  EXPECT_EQ(one.places, three.places);
  EXPECT_EQ(one.normals, three.normals);
  EXPECT_EQ(one.triangles, three.triangles);
  ThreadPool pool(2);
  surface::Cut cut;
  cut.level = 0.4;
  cut.values = lattice.values.data();
  const surface::MeshSize size = surface::measure(lattice.samples(), cut, pool);
  EXPECT_EQ(size.bytes(false), one.bytes());
}

}  // namespace
}  // namespace windsplat::test
