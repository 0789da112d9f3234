// Sunlight on isosurfaces and on curved ground: closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "server/data/samples/samples.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/light/curved.hpp"
#include "server/light/ground_light.hpp"
#include "server/light/sunlight.hpp"
#include "server/scene/build.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/surfaces/ball.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

constexpr surface::Color colors_of_ball{0.5F, 1, 0.25F};

Scene ball_scene(const glm::dvec3& sun, double ambient, double strength) {
  Scene scene;
  scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
  scene.light = scene::Light{glm::normalize(sun), ambient, strength, 0, 1, {}};
  scene.surfaces = {ball(0.7, 1, colors_of_ball, 41)};
  return scene;
}

std::vector<double> rgba_of(Scene scene, Method method) {
  if (method == Method::reference) {
    ThreadPool pool(2);
    return engine::reference::render(scene, pool, {}).value().rgba;
  }
  scene.method = method;
  const engine::Image image = render(scene).image;
  return {image.rgba.begin(), image.rgba.end()};
}

constexpr std::array sunlit_methods{Method::kernel, Method::slab, Method::reference};

// Lambert's cosine between the sun and the normal, and ambient light on the night side.
TEST(SunOnSurfaces, OfABallFollowsLambertsCosine) {
  constexpr int size = 60;
  constexpr double ambient = 0.15;
  for (const double strength : {0.6, 1.0, 2.0}) {
    Scene scene = ball_scene({1, -0.5, 0.7}, ambient, strength);
    scene.camera = look({0, 0, 0}, {0.2, 1, -0.3}, 3, size, size, false, 0.9);
    light::light_surfaces(scene, {});
    for (const Method method : sunlit_methods) {
      const std::vector<double> rgba = rgba_of(scene, method);
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          const double right = (x + 0.5 - size / 2.0) * 1.8 / size;
          const double up = (size / 2.0 - y - 0.5) * 1.8 / size;
          const double off2 = right * right + up * up;
          if (off2 > 0.63 * 0.63) continue;
          const glm::dvec3 normal = (right * scene.camera.right + up * scene.camera.up -
                                     std::sqrt(0.49 - off2) * scene.camera.forward) /
                                    0.7;
          const double cosine = std::max(0.0, glm::dot(normal, scene.light->sun));
          const double shade = ambient + (1 - ambient) * std::min(strength, 1.0) * cosine;
          const double* const at = rgba.data() + 4 * (static_cast<std::size_t>(y) * size + x);
          for (std::size_t c = 0; c < 3; ++c) {
            ASSERT_NEAR(at[c], shade * static_cast<double>(colors_of_ball.at(c)), 6e-3)
                << x << ' ' << y << " method " << static_cast<int>(method);
          }
        }
      }
    }
  }
}

// A horizontal sheet, whichever way its normals point, is bright on the side of the sun only.
TEST(SunOnSurfaces, LightsTheSideThatFacesTheSun) {
  for (const float up : {1.0F, -1.0F}) {
    auto mesh = std::make_shared<surface::Mesh>();
    for (const float y : {-5.0F, 5.0F}) {
      for (const float x : {-5.0F, 5.0F}) {
        mesh->places.push_back({x, y, 0});
        mesh->normals.push_back({0, 0, up});
      }
    }
    mesh->triangles = {{0, 1, 3}, {0, 3, 2}};
    Scene scene = ball_scene({0, 0.6, 0.8}, 0.1, 1);
    scene.surfaces[0].mesh = mesh;
    light::light_surfaces(scene, {});
    scene.camera = look({0, 0, 0}, {0, 0.2, -1}, 3, 9, 9, true, 0.3);
    EXPECT_NEAR(rgba_of(scene, Method::slab)[4 * 40 + 1], 0.1 + 0.9 * 0.8, 1e-5);
    scene.camera = look({0, 0, 0}, {0, 0.2, 1}, 3, 9, 9, true, 0.3);
    EXPECT_NEAR(rgba_of(scene, Method::slab)[4 * 40 + 1], 0.1, 1e-5);
  }
}

// Fog above dims it by the law of Beer and Lambert, along the slant of the rays.
TEST(SunOnSurfaces, BelowFogIsDimmedByItsOpticalDepth) {
  constexpr double sigma = 0.8;
  Scene scene = ball_scene({0.6, 0, 0.8}, 0, 1);
  scene.lattice = even_lattice({100, 4, 40}, {0.1, 1, 0.05});  // z up to 1
  const std::vector<float> fog(std::size_t{100} * 4 * 40, static_cast<float>(sigma));
  light::SunAtPlaces sun;
  sun.media = std::make_shared<const surface::Transmittances>(surface::Transmittances{
      scene.lattice.positions, std::make_shared<const scene::SampleFactors>(
                                   light::sunlight(scene.lattice, fog, scene.light->sun))});
  light::light_surfaces(scene, sun);
  scene.camera = look({0, 0, 0}, {0, 0, -1}, 3, 11, 11, false, 0.5);
  // Only the light, not the view, passes the fog here: the scene has no medium.
  const std::vector<double> rgba = rgba_of(scene, Method::reference);
  for (const int x : {3, 5, 7}) {
    const double right = (x - 5) / 11.0;
    const double height = std::sqrt(0.49 - right * right);
    const double cosine = (0.6 * right + 0.8 * height) / 0.7;
    const double expected = cosine * std::exp(-sigma * (1 - height) / 0.8);
    EXPECT_NEAR(rgba[4 * static_cast<std::size_t>(5 * 11 + x) + 1], expected, 0.01) << x;
  }
}

TEST(SunOnSurfaces, OfAViewLightsIsosurfacesAndLeavesSectionsTheirColours) {
  auto source = data::open_sample("climate", {24, 16, 8}, 1);
  data::Dataset dataset(std::move(*source), "climate", 64U << 20U);
  protocol::View view;
  view.dataset = "climate";
  view.image.width = 200;
  view.image.height = 150;
  protocol::SurfaceView one;
  one.field = "cloud";
  one.isovalue = 0.3;
  view.surfaces.push_back(one);
  one.isovalue.reset();
  one.slice = protocol::SliceView{protocol::GridAxis::z, 2};
  view.surfaces.push_back(one);
  EXPECT_EQ(scene::build_scene(view, dataset).value().surfaces[0].sun, nullptr);
  view.light.emplace();
  for (const auto mapping : {protocol::GeometryMapping::flat, protocol::GeometryMapping::sphere}) {
    view.geometry.mapping = mapping;
    const Scene scene = scene::build_scene(view, dataset).value();
    ASSERT_NE(scene.surfaces[0].sun, nullptr);
    EXPECT_EQ(scene.surfaces[1].sun, nullptr);
    const surface::Sun& sun = *scene.surfaces[0].sun;
    EXPECT_EQ(sun.direction, scene.light->sun);
    EXPECT_EQ(sun.ambient, view.light->ambient);
    ASSERT_NE(sun.media, nullptr);
    // High above the data nothing lies before the sun.
    EXPECT_NEAR(sun.media->at(50.0 * scene.light->sun), 1, 1e-3);
  }
  view.geometry.mapping = protocol::GeometryMapping::flat;
  view.light->elevation = -5;
  EXPECT_EQ(scene::build_scene(view, dataset).value().surfaces[0].sun->strength, 0);
}

// A terrain-following lattice of 64 x 8 x 24 cells over [-2, 2] x [-0.5, 0.5], whose lowest edge is
// at `hill`, 1.2 high.
scene::Lattice over_hills(double hill) {
  scene::Lattice lattice = even_lattice({64, 8, 24}, {4.0 / 64, 1.0 / 8, 1.2 / 24});
  displace(lattice, [hill](const glm::dvec3& p) {
    return glm::dvec3(p.x, p.y, p.z + 0.6 + hill * std::sin(2 * p.x));
  });
  return lattice;
}

light::SunAtPlaces sun_over(const scene::Lattice& lattice, const std::vector<float>& extinctions,
                            const glm::dvec3& sun) {
  const scene::Lattice grid = light::grid_around(lattice);
  light::SunAtPlaces out;
  out.media = std::make_shared<const surface::Transmittances>(surface::Transmittances{
      grid.positions, std::make_shared<const scene::SampleFactors>(
                          light::grid_sunlight(lattice, extinctions, grid, sun))});
  out.below = light::below_ground(lattice, grid, sun);
  return out;
}

// The ground below a cloud that follows it, between 0.4 and 0.8 above, and below fog down to it.
TEST(SunOnCurvedGround, HasTheShadowOfASlabOfCloudOverTerrain) {
  constexpr double hill = 0.25;
  constexpr double sigma = 2;
  const scene::Lattice lattice = over_hills(hill);
  for (const auto& [low, high] : {std::array{0.4, 0.8}, std::array{0.0, 0.6}}) {
    std::vector<float> cloud;
    for (int k = 0; k < 24; ++k) {
      const double above = (k + 0.5) * 0.05;
      cloud.insert(cloud.end(), std::size_t{64} * 8,
                   above > low && above < high ? static_cast<float>(sigma) : 0.0F);
    }
    for (const double slant : {0.0, 0.5}) {
      Scene scene;
      scene.lattice = lattice;
      const glm::dvec3 sun = glm::normalize(glm::dvec3(0, slant, 1));
      scene.light = scene::Light{sun, 0, 1, 0, 1, {}};
      const light::SunAtPlaces at = sun_over(lattice, cloud, sun);
      const light::GroundLight ground(scene, at.media, at.below);
      for (double x = -1.5; x <= 1.5; x += 0.11) {
        const double y = -0.25;  // far from where the lattice ends
        const double depth = sigma * (high - low) / sun.z;
        const double expected = std::exp(-depth);
        EXPECT_NEAR(ground.factor({x, y, hill * std::sin(2 * x)}), expected, 0.04)
            << x << " slant " << slant << " low " << low;
      }
    }
  }
}

// Layers a tenth as high as the cells of the grid between: its points do not miss any.
TEST(SunOnCurvedGround, IsEvenBelowLayersThinnerThanTheGrid) {
  std::vector<double> layers(20, 0.01);
  layers.insert(layers.end(), 4, 0.5);
  const std::vector<double> even(12, 0.2);
  scene::Lattice lattice = make_lattice({even, even, layers});
  const double lowest = lattice.box_min.z;
  const auto rise = [](double x, double y) { return 0.05 * std::sin(3 * x) + 0.1 * y; };
  displace(lattice,
           [&](const glm::dvec3& p) { return glm::dvec3(p.x, p.y, p.z + rise(p.x, p.y)); });
  std::vector<float> cloud(std::size_t{144} * 24, 0.0F);
  std::fill_n(cloud.begin() + std::ptrdiff_t{144} * 8, std::size_t{144} * 5, 20.0F);
  Scene scene;
  scene.lattice = lattice;
  scene.light = scene::Light{{0, 0, 1}, 0, 1, 0, 1, {}};
  const light::SunAtPlaces at = sun_over(lattice, cloud, {0, 0, 1});
  const light::GroundLight ground(scene, at.media, at.below);
  std::vector<double> factors;
  for (double x = -0.9; x <= 0.9; x += 0.07) {
    for (double y = -0.9; y <= 0.9; y += 0.07) {
      factors.push_back(ground.factor({x, y, lowest + rise(x, y)}));
    }
  }
  const auto [least, most] = std::minmax_element(factors.begin(), factors.end());
  EXPECT_LT(*most - *least, 0.08);
  EXPECT_NEAR(0.5 * (*least + *most), std::exp(-1.0), 0.12);
}

// On a globe the cosine of the sun remains, and clouds between it and the ground dim it.
TEST(SunOnCurvedGround, OfAGlobeHasTheShadowsOfClouds) {
  constexpr double sigma = 6;
  constexpr double inner = 0.8;
  scene::Lattice lattice = even_lattice({96, 48, 8}, {2 * pi / 96, pi / 48, 0.03});
  lattice.inner_radius = inner;
  lattice.around = 96;
  std::vector<float> cloud;
  // East of longitude 0, in the upper half of the shell.
  for (int k = 0; k < 8; ++k) {
    for (int j = 0; j < 48; ++j) {
      for (int i = 0; i < 96; ++i) {
        cloud.push_back(k >= 4 && i >= 48 ? static_cast<float>(sigma) : 0.0F);
      }
    }
  }
  displace(lattice, [](const glm::dvec3& p) {
    const double r = inner + 0.12 + p.z;
    return r *
           glm::dvec3(std::cos(p.y) * std::sin(p.x), -std::cos(p.y) * std::cos(p.x), std::sin(p.y));
  });
  Scene scene;
  scene.lattice = lattice;
  const glm::dvec3 sun(0, -1, 0);
  scene.light = scene::Light{sun, 0, 1, 0, 1, {}};
  const light::SunAtPlaces at = sun_over(lattice, cloud, sun);
  const light::GroundLight ground(scene, at.media, at.below);
  const auto at_longitude = [&](double degrees) {
    const double lon = degrees * pi / 180;
    return ground.factor(inner * 0.999 * glm::dvec3(std::sin(lon), -std::cos(lon), 0));
  };
  for (const double degrees : {10.0, 20.0, 30.0, 50.0}) {
    const double cosine = std::cos(degrees * pi / 180);
    EXPECT_NEAR(at_longitude(-degrees), cosine, 0.04) << degrees;
    // The way of the ray through the cloud between two spheres.
    const double across = inner * std::sin(degrees * pi / 180);
    const auto height = [across](double r) { return std::sqrt(r * r - across * across); };
    const double way = height(inner + 0.24) - height(inner + 0.12);
    EXPECT_NEAR(at_longitude(degrees), cosine * std::exp(-sigma * way), 0.06) << degrees;
  }
  EXPECT_EQ(at_longitude(120), 0);
}

}  // namespace
}  // namespace windsplat::test
