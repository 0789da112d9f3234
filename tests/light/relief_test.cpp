// Factors by the gradient of a field against closed forms.
#include "server/light/relief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

scene::ScalarLayer layer_of(const scene::Lattice& lattice,
                            const std::function<double(const glm::dvec3&)>& value) {
  scene::ScalarLayer layer = medium(make_volume(lattice, 1,
                                                [&](int, double x, double y, double z) {
                                                  return static_cast<float>(value({x, y, z}));
                                                }),
                                    {1, 1, 1});
  layer.color.range = {-1, 1};
  return layer;
}

TEST(Relief, OfALinearFieldIsTheCosineBetweenItsGradientAndTheSun) {
  const scene::Lattice lattice =
      make_lattice({std::vector{0.1, 0.2, 0.3, 0.2, 0.1}, std::vector{0.2, 0.2, 0.2},
                    std::vector{0.05, 0.1, 0.2, 0.4}});
  const glm::dvec3 sun = glm::normalize(glm::dvec3{0.3, -0.4, 0.8});
  for (const glm::dvec3& slope : {glm::dvec3{20, 0, 0}, {0, 0, -20}, {10, 20, 30}}) {
    const auto factors = light::relief(
        lattice, layer_of(lattice, [&](const glm::dvec3& p) { return glm::dot(slope, p); }), sun);
    for (const auto factor : factors) {
      EXPECT_NEAR(factor / scene::full_factor, std::abs(glm::dot(glm::normalize(slope), sun)),
                  1e-3);
    }
  }
}

TEST(Relief, OfASphereFacesTheSunOnBothSides) {
  const scene::Lattice lattice = even_lattice({41, 41, 41}, {0.05, 0.05, 0.05});
  const glm::dvec3 sun = glm::normalize(glm::dvec3{1, 2, 3});
  const auto factors = light::relief(
      lattice, layer_of(lattice, [](const glm::dvec3& p) { return 10 * glm::dot(p, p); }), sun);
  std::size_t n = 0;
  for (const double z : lattice.positions[2]) {
    for (const double y : lattice.positions[1]) {
      for (const double x : lattice.positions[0]) {
        const glm::dvec3 p{x, y, z};
        const double factor = factors[n++] / scene::full_factor;
        const bool inside = std::max({std::abs(x), std::abs(y), std::abs(z)}) < 0.99;
        if (!inside || glm::length(p) < 0.3) continue;
        EXPECT_NEAR(factor, std::abs(glm::dot(glm::normalize(p), sun)), 0.01);
      }
    }
  }
}

TEST(Relief, FadesToOneWhereTheFieldIsUniformOrMasked) {
  const scene::Lattice lattice = even_lattice({8, 8, 8}, {0.1, 0.1, 0.1});
  for (const double slope : {0.0, 1e-3, std::nan("")}) {
    const auto factors = light::relief(
        lattice, layer_of(lattice, [&](const glm::dvec3& p) { return slope * p.x; }), {0, 0, 1});
    for (const auto factor : factors) EXPECT_GT(factor, 65000);
  }
}

// On a lattice that is turned in the world, so are the gradients.
TEST(Relief, OfACurvedLatticeFollowsThePlacesOfItsSamples) {
  scene::Lattice lattice = even_lattice({6, 5, 4}, {0.1, 0.1, 0.1});
  const auto layer = layer_of(lattice, [](const glm::dvec3& p) { return 20 * p.x; });
  displace(lattice, [](const glm::dvec3& p) { return glm::dvec3(-p.y, p.x, p.z + p.x); });
  // x = Y in the world.
  const glm::dvec3 sun = glm::normalize(glm::dvec3{1, 2, 3});
  for (const auto factor : light::relief(lattice, layer, sun)) {
    EXPECT_NEAR(factor / scene::full_factor, sun.y, 1e-3);
  }
}

}  // namespace
}  // namespace windsplat::test
