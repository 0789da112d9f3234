// Transmittances from the sun on curved lattices.
#include "server/light/curved.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "server/light/sunlight.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Lattice;
using scene::SampleFactors;

SampleFactors factors_of(const Lattice& lattice, const scene::ScalarLayer& layer,
                         const glm::dvec3& sun) {
  return light::curved_sunlight(lattice, light::extinctions(lattice, {layer}), sun);
}

// A slab between parallel hills, in cells that follow them: light from above falls off with the
// depth below the surface.
TEST(CurvedSunlight, BelowHillsDecaysWithTheDepthBelowThem) {
  const auto hills = [](const glm::dvec3& p) {
    return glm::dvec3(p.x, p.y, p.z + 0.2 * std::sin(3 * p.x) + 0.1 * p.y);
  };
  const auto error = [&](int n) {
    std::vector<double> layers;  // the lowest three times as high as the highest
    for (int k = 0; k < n / 2; ++k) layers.push_back((3 - 4.0 * (k + 0.5) / n) / n);
    const std::vector<double> even(static_cast<std::size_t>(n), 2.0 / n);
    Lattice lattice = make_lattice({even, even, layers});
    const auto field = uniform(lattice, 2);
    displace(lattice, hills);
    const SampleFactors factors = factors_of(lattice, medium(field, {1, 1, 1}), {0, 0, 1});
    double sum2 = 0;
    std::size_t at = 0;
    for (const double z : lattice.positions[2]) {
      for (int i = 0; i < n * n; ++i) {
        const double off = factors[at++] / scene::full_factor - std::exp(-2 * (0.5 - z));
        sum2 += off * off;
      }
    }
    return std::sqrt(sum2 / static_cast<double>(at));
  };
  const double coarse = error(24);
  const double fine = error(48);
  EXPECT_LT(fine, 0.009);
  EXPECT_LT(fine, 0.6 * coarse);
}

TEST(CurvedSunlight, OfStraightCellsIsThatOfARectilinearLattice) {
  Lattice lattice = even_lattice({30, 26, 20}, {0.05, 0.06, 0.04});
  const auto cloud = make_volume(lattice, 1, [](int, double x, double y, double z) {
    return static_cast<float>(5 * std::exp(-8 * (x * x + y * y + 2 * z * z)));
  });
  const auto layer = medium(cloud, {1, 1, 1});
  const glm::dvec3 sun = glm::normalize(glm::dvec3{0.4, -0.3, 0.8});
  const SampleFactors straight =
      light::sunlight(lattice, light::extinctions(lattice, {layer}), sun);
  displace(lattice, [](const glm::dvec3& p) { return p; });
  const SampleFactors curved = factors_of(lattice, layer, sun);
  for (std::size_t n = 0; n < straight.size(); ++n) {
    ASSERT_NEAR(curved[n] / scene::full_factor, straight[n] / scene::full_factor, 0.02);
  }
}

// A shell of longitudes and latitudes around a globe.
TEST(CurvedSunlight, OfAGlobeIsAbsentOnItsNightSide) {
  Lattice lattice = even_lattice({72, 36, 6}, {2 * pi / 72, pi / 36, 0.02});
  const auto clear = uniform(lattice, 0.01F);
  lattice.inner_radius = 0.8;
  lattice.around = 72;
  displace(lattice, [](const glm::dvec3& p) {
    const double r = 0.8 + 0.06 + p.z;
    return r *
           glm::dvec3(std::cos(p.y) * std::sin(p.x), -std::cos(p.y) * std::cos(p.x), std::sin(p.y));
  });
  const glm::dvec3 sun = glm::normalize(glm::dvec3{1, -1, 0.4});
  const SampleFactors factors = factors_of(lattice, medium(clear, {1, 1, 1}), sun);
  for (std::size_t n = 0; n < factors.size(); ++n) {
    const auto& p = (*lattice.places)[n];
    const glm::dvec3 place{p[0], p[1], p[2]};
    const double along = glm::dot(place, sun);
    const double beside = glm::length(place - along * sun);
    if (along > 0.2) {
      EXPECT_GT(factors[n] / scene::full_factor, 0.98);
    }
    if (along < -0.2 && beside < 0.55) {
      EXPECT_LT(factors[n] / scene::full_factor, 1e-3);
    }
  }
}

TEST(CurvedSunlight, OfOneLayerAndOfAnyExtinctionStaysWithinBounds) {
  for (const float extinction : {0.0F, 1.0F, 1e30F}) {
    Lattice lattice = even_lattice({9, 8, 1}, {0.2, 0.25, 0.1});
    const auto field = uniform(lattice, extinction);
    displace(lattice,
             [](const glm::dvec3& p) { return glm::dvec3(p.x, p.y, p.z + 0.1 * p.x * p.y); });
    for (const auto factor : factors_of(lattice, medium(field, {1, 1, 1}), {0, 0, 1})) {
      if (extinction == 0) {
        EXPECT_EQ(factor, 65535);
      }
      if (extinction == 1) {
        EXPECT_GT(factor, 58000);
      }
      if (extinction > 1) {
        EXPECT_LT(factor, 65535);
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::test
