// Transmittances from the sun against closed forms.
#include "server/light/sunlight.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "server/light/ground_rays.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Lattice;
using scene::SampleFactors;

double factor(const SampleFactors& factors, std::size_t n) {
  return factors[n] / scene::full_factor;
}

SampleFactors sunlight_in(const Lattice& lattice, const std::shared_ptr<const data::Volume>& field,
                          const glm::dvec3& sun) {
  return light::sunlight(lattice, light::extinctions(lattice, {medium(field, {1, 1, 1})}), sun);
}

// Calls visit(number of the sample, its place).
void each_sample(const Lattice& lattice,
                 const std::function<void(std::size_t, const glm::dvec3&)>& visit) {
  std::size_t n = 0;
  for (const double z : lattice.positions[2]) {
    for (const double y : lattice.positions[1]) {
      for (const double x : lattice.positions[0]) visit(n++, {x, y, z});
    }
  }
}

// n cells in all, growing by a factor from the first to the last.
std::vector<double> stretched(int n, double length, double growth) {
  std::vector<double> widths;
  double total = 0;
  for (int i = 0; i < n; ++i) {
    widths.push_back(std::pow(growth, (i + 0.5) / n));
    total += widths.back();
  }
  for (double& width : widths) width *= length / total;
  return widths;
}

// Largest error in a homogeneous box of 2 x 2 x 1 where the sun's rays come through its top, but
// not near it or where those through a side begin.
double slab_error(int n, bool uneven, const glm::dvec3& sun, double sigma) {
  const double growth = uneven ? 4 : 1;
  const Lattice lattice = make_lattice(
      {stretched(n, 2, 1), stretched(n, 2, uneven ? 2 : 1), stretched(n / 2, 1, growth)});
  const SampleFactors factors =
      sunlight_in(lattice, uniform(lattice, static_cast<float>(sigma)), sun);
  double most = 0;
  int judged = 0;
  each_sample(lattice, [&](std::size_t at, const glm::dvec3& place) {
    const double way = (lattice.box_max.z - place.z) / sun.z;
    const glm::dvec3 enters = place + way * sun;
    constexpr double margin = 0.3;
    for (int a = 0; a < 2; ++a) {
      const double way_in = sun[a] > 0 ? enters[a] : -enters[a];
      if (sun[a] != 0 && way_in > 1 - margin) return;
    }
    if (lattice.box_max.z - place.z < margin) return;
    most = std::max(most, std::abs(factor(factors, at) - std::exp(-sigma * way)));
    ++judged;
  });
  EXPECT_GT(judged, n * n / 4);
  return most;
}

SampleFactors on_ground(const Lattice& lattice, const std::shared_ptr<const data::Volume>& field,
                        const glm::dvec3& sun) {
  return light::ground_sunlight(lattice, light::extinctions(lattice, {medium(field, {1, 1, 1})}),
                                sun);
}

// The ray leaves the box through its top or a side; a single layer is no exception.
TEST(Sunlight, OnTheGroundOfAHomogeneousBoxIsThatOfTheWholeWay) {
  for (const int layers : {1, 2, 17}) {
    for (const bool uneven : {false, true}) {
      const double growth = uneven ? 4 : 1;
      const Lattice lattice = make_lattice(
          {stretched(20, 2, growth), stretched(12, 2, 1), stretched(layers, 1, growth)});
      for (const double sigma : {0.1, 1.0, 100.0}) {
        const auto field = uniform(lattice, static_cast<float>(sigma));
        for (const glm::dvec3& towards :
             {glm::dvec3(0, 0, 1), glm::dvec3(0.4, -0.2, 0.7), glm::dvec3(-2, 1, 0.05),
              glm::dvec3(1, 0.3, 1e-7), glm::dvec3(1, 0.3, 0)}) {
          const glm::dvec3 sun = glm::normalize(towards);
          const SampleFactors factors = on_ground(lattice, field, sun);
          ASSERT_EQ(factors.size(), 20U * 12);
          for (std::size_t n = 0; n < factors.size(); ++n) {
            const std::array<double, 2> from{lattice.positions[0][n % 20],
                                             lattice.positions[1][n / 20]};
            double way = sun.z > 0 ? 1 / sun.z : 1e30;
            for (int a = 0; a < 2; ++a) {
              if (sun[a] == 0) continue;
              const double face = sun[a] > 0 ? lattice.box_max[a] : lattice.box_min[a];
              way = std::min(way, (face - from.at(static_cast<std::size_t>(a))) / sun[a]);
            }
            ASSERT_NEAR(factor(factors, n), std::exp(-sigma * way), 2e-5)
                << layers << ' ' << uneven << ' ' << sigma << ' ' << towards.z;
          }
        }
      }
    }
  }
}

// A Gaussian cloud above the ground: its depth along the whole ray.
TEST(Sunlight, OnTheGroundShadowsLieWhereTheirRaysMeetIt) {
  constexpr double w = 0.15;
  constexpr double peak = 4;
  for (const glm::dvec3& towards : {glm::dvec3(0, 0, 1), glm::dvec3(0.5, 0.3, 0.8)}) {
    const glm::dvec3 sun = glm::normalize(towards);
    const auto error = [&](int n) {
      const Lattice lattice =
          make_lattice({stretched(n, 2, 1), stretched(n, 2, 1), stretched(n, 2, 3)});
      const auto cloud = make_volume(lattice, 1, [&](int, double x, double y, double z) {
        return static_cast<float>(peak * std::exp(-(x * x + y * y + z * z) / (2 * w * w)));
      });
      const SampleFactors factors = on_ground(lattice, cloud, sun);
      double most = 0;
      for (std::size_t m = 0; m < factors.size(); ++m) {
        const auto count = static_cast<std::size_t>(n);
        const glm::dvec3 place(lattice.positions[0][m % count], lattice.positions[1][m / count],
                               lattice.box_min.z);
        const double along = glm::dot(place, sun);
        const double beside2 = glm::dot(place, place) - along * along;
        const double depth = peak * std::exp(-beside2 / (2 * w * w)) * w * std::sqrt(2 * pi);
        most = std::max(most, std::abs(factor(factors, m) - std::exp(-depth)));
      }
      return most;
    };
    const double coarse = error(20);
    const double fine = error(40);
    EXPECT_LT(fine, 0.02);
    EXPECT_GT(coarse, 3 * (fine - 2e-5));
  }
}

TEST(Sunlight, InASlabDecaysExponentiallyToSecondOrderInTheCells) {
  const std::vector<glm::dvec3> suns{{0, 0, 1}, {0.3, -0.2, 0.8}, {-0.8, 0.3, 0.35}};
  for (const glm::dvec3& direction : suns) {
    for (const bool uneven : {false, true}) {
      const glm::dvec3 sun = glm::normalize(direction);
      const double coarse = slab_error(32, uneven, sun, 2);
      const double fine = slab_error(64, uneven, sun, 2);
      const double finest = slab_error(128, uneven, sun, 2);
      EXPECT_LT(fine, 4e-3) << direction.x << ' ' << uneven;
      EXPECT_GT(coarse, 3.3 * (fine - 2e-5)) << direction.x << ' ' << uneven;
      EXPECT_GT(fine, 3.3 * (finest - 2e-5)) << direction.x << ' ' << uneven;
    }
  }
}

// Of exp(-r^2 / (2 w^2)) the optical depth from a place on is a Gaussian of the distance of the ray
// times an error function.
TEST(Sunlight, BehindASmoothCloudApproachesTheIntegralToSecondOrder) {
  constexpr double w = 0.2;
  constexpr double peak = 6;
  for (const glm::dvec3& direction : {glm::dvec3{0, 0, 1}, {0.5, 0.7, -0.4}, {-0.9, 0.2, 0.6}}) {
    const glm::dvec3 sun = glm::normalize(direction);
    const auto error = [&](int n) {
      const Lattice lattice =
          make_lattice({stretched(n, 2, 1), stretched(n, 2, 1), stretched(n, 2, 3)});
      const auto cloud = make_volume(lattice, 1, [&](int, double x, double y, double z) {
        return static_cast<float>(peak * std::exp(-(x * x + y * y + z * z) / (2 * w * w)));
      });
      const SampleFactors factors = sunlight_in(lattice, cloud, sun);
      double most = 0;
      each_sample(lattice, [&](std::size_t at, const glm::dvec3& place) {
        const double along = glm::dot(place, sun);
        const double beside2 = glm::dot(place, place) - along * along;
        const double depth = peak * std::exp(-beside2 / (2 * w * w)) * w * std::sqrt(pi / 2) *
                             std::erfc(along / (w * std::sqrt(2.0)));
        most = std::max(most, std::abs(factor(factors, at) - std::exp(-depth)));
      });
      return most;
    };
    const double coarse = error(24);
    const double fine = error(48);
    EXPECT_LT(fine, 0.01) << direction.x;
    EXPECT_GT(coarse, 3 * fine) << direction.x;
  }
}

TEST(Sunlight, ReachesHalfOfAnOpaqueSurfaceAndNothingBehindIt) {
  const Lattice lattice = even_lattice({12, 12, 12}, {0.1, 0.1, 0.1});
  for (const float extinction : {1e6F, 1e30F, 3e38F}) {
    const SampleFactors factors = sunlight_in(lattice, uniform(lattice, extinction), {0, 0, 1});
    each_sample(lattice, [&](std::size_t n, const glm::dvec3& place) {
      EXPECT_NEAR(factor(factors, n), place.z > 0.5 ? 0.5 : 0.0, 1e-4);
    });
  }
}

TEST(Sunlight, IsFullWithoutAMediumAndWhereSamplesAreMasked) {
  const Lattice lattice = even_lattice({9, 7, 5}, {0.1, 0.2, 0.3});
  for (const float value : {0.0F, std::nanf("")}) {
    const SampleFactors factors =
        sunlight_in(lattice, uniform(lattice, value), glm::normalize(glm::dvec3{1, 2, 3}));
    EXPECT_TRUE(std::all_of(factors.begin(), factors.end(), [](int f) { return f == 65535; }));
  }
}

// A plate above the ground throws its shadow where the sun's rays meet the ground.
TEST(Sunlight, OfAPlateIsAbsentInItsShadowOnly) {
  const Lattice lattice = even_lattice({40, 40, 20}, {0.05, 0.05, 0.05});
  const auto plate = make_volume(lattice, 1, [](int, double x, double y, double z) {
    return z > 0.3 && z < 0.35 && std::abs(x) < 0.3 && std::abs(y) < 0.3 ? 1e4F : 0.0F;
  });
  const glm::dvec3 sun = glm::normalize(glm::dvec3{0.5, 0.25, 1});
  const SampleFactors factors = sunlight_in(lattice, plate, sun);
  each_sample(lattice, [&](std::size_t n, const glm::dvec3& place) {
    if (place.z > 0.25) return;
    const glm::dvec3 above = place + ((0.325 - place.z) / sun.z) * sun;
    const double beside = std::max(std::abs(above.x), std::abs(above.y));
    if (beside < 0.22) {
      EXPECT_LT(factor(factors, n), 1e-3);
    }
    if (beside > 0.38) {
      EXPECT_GT(factor(factors, n), 0.999);
    }
  });
}

// One axis of a single sample, and cells of extreme proportions.
TEST(Sunlight, CrossesFlatLattices) {
  for (int axis = 0; axis < 3; ++axis) {
    std::array<int, 3> dims{6, 6, 6};
    dims[axis] = 1;
    std::array<double, 3> cell{0.3, 0.3, 0.3};
    cell[axis] = 1e-6;
    const Lattice lattice = even_lattice(dims, cell);
    const SampleFactors factors =
        sunlight_in(lattice, uniform(lattice, 1), glm::normalize(glm::dvec3{0.3, 0.2, 0.9}));
    for (const auto f : factors) EXPECT_GT(f / scene::full_factor, 0.1);
  }
}

}  // namespace
}  // namespace windsplat::test
