// Surfaces in pictures: closed forms of what they cover and let through, by every method.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/reference/reference.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/surfaces/ball.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;
using surface::Color;
using surface::Mesh;
using surface::Shown;

constexpr Color green{0.1F, 0.8F, 0.2F};
constexpr Color red{0.9F, 0.2F, 0.1F};

// A horizontal square of half the width `half` at height z, whose values are x.
Shown square(double z, double opacity, Color color, double half = 5) {
  auto mesh = std::make_shared<Mesh>();
  for (const double y : {-half, half}) {
    for (const double x : {-half, half}) {
      mesh->places.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
      mesh->normals.push_back({0, 0, 1});
      mesh->values.push_back(static_cast<float>(x));
    }
  }
  mesh->triangles = {{0, 1, 3}, {0, 3, 2}};
  Shown shown;
  shown.mesh = std::move(mesh);
  shown.opacity = opacity;
  shown.colors = {color};
  return shown;
}

std::vector<double> reference_values(const Scene& scene) {
  ThreadPool pool(2);
  auto picture = engine::reference::render(scene, pool, CancelToken(), {});
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(picture->rgba);
}

std::vector<double> picture_of(Scene scene, Method method) {
  if (method == Method::reference) return reference_values(scene);
  scene.method = method;
  const engine::Image image = render(scene).image;
  return {image.rgba.begin(), image.rgba.end()};
}

constexpr std::array drawing_methods{Method::reference, Method::slab, Method::kernel};

// Looks down on a square of 2 x 2, without perspective.
scene::Camera from_above(int size) { return look({0, 0, 0}, {0, 0, -1}, 3, size, size, false, 1); }

Scene empty_scene(int size) {
  Scene scene;
  scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
  scene.camera = from_above(size);
  return scene;
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += (a[n] - b[n]) * (a[n] - b[n]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(Surfaces, ASphereAloneCoversItsDiscAndIsLitByItsNormals) {
  constexpr int size = 90;
  constexpr double radius = 0.7;
  constexpr double distance = 3;
  for (const bool perspective : {true, false}) {
    Scene scene = empty_scene(size);
    const double half_height = perspective ? 0.3 : 0.9;
    scene.camera =
        look({0, 0, 0}, {0.3, 0.8, -0.4}, distance, size, size, perspective, half_height);
    scene.surfaces = {ball(radius, 1, green)};
    const double pixel = 2 * half_height / size;
    const double limb =
        (perspective ? radius / std::sqrt(distance * distance - radius * radius) : radius) / pixel;
    for (const Method method : drawing_methods) {
      const std::vector<double> rgba = picture_of(scene, method);
      double area = 0;
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          const double* const at = rgba.data() + 4 * (static_cast<std::size_t>(y) * size + x);
          const double off = std::hypot(x + 0.5 - size / 2.0, y + 0.5 - size / 2.0);
          area += at[3];
          if (off > limb + 1) {
            EXPECT_EQ(at[3], 0);
          }
          if (off >= limb - 1.5) continue;
          EXPECT_NEAR(at[3], 1, 1e-6);
          if (perspective || off > 0.95 * limb) continue;
          const double shade = 0.3 + 0.7 * std::sqrt(1 - off * off / (limb * limb));
          for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(at[c], shade * static_cast<double>(green.at(c)), 5e-3);
          }
        }
      }
      EXPECT_NEAR(area, pi * limb * limb, 5e-3 * area);  // of second order in the cells
    }
  }
}

TEST(Surfaces, ATranslucentSphereIsSeenTwiceThroughItself) {
  Scene scene = empty_scene(40);
  scene.surfaces = {ball(0.7, 0.3, green)};
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    EXPECT_NEAR(rgba[4 * (20 * 40 + 20) + 3], 1 - 0.7 * 0.7, 1e-4);
  }
}

TEST(Surfaces, HalfATransparentMediumLiesBehindASurfaceInItsMiddle) {
  constexpr int size = 12;
  constexpr double opacity = 0.5;
  constexpr std::array<float, 3> blue{0.2F, 0.3F, 0.9F};
  Scene scene = empty_scene(size);
  scene.lattice = even_lattice({24, 24, 16}, {0.2, 0.2, 0.1});
  scene.scalars.push_back(medium(uniform(scene.lattice, 1.2F), blue));
  const std::size_t middle = 4 * (6 * size + 6);
  const double through = std::sqrt(1 - reference_values(scene)[middle + 3]);
  ASSERT_LT(through, 0.5);
  scene.surfaces = {square(0, opacity, green)};
  constexpr std::array tolerance{1e-8, 2e-3, 6e-2};
  for (std::size_t n = 0; n < drawing_methods.size(); ++n) {
    const std::vector<double> rgba = picture_of(scene, drawing_methods.at(n));
    EXPECT_NEAR(1 - rgba[middle + 3], through * through * (1 - opacity), n == 0 ? 1e-8 : 1e-5);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto cloud = static_cast<double>(blue.at(c)) * (1 - through);
      const double behind = opacity * static_cast<double>(green.at(c)) + (1 - opacity) * cloud;
      EXPECT_NEAR(rgba[middle + c], cloud + through * behind, tolerance.at(n)) << n;
    }
  }
}

// A line at height z, along x.
Scene line_scene(double z, int size) {
  Scene scene = empty_scene(size);
  scene.lattice = even_lattice({1, 1, 1}, {0.1, 0.1, 0.1});
  scene.lattice.positions[2][0] = z;
  const auto field = make_volume(
      scene.lattice, 3, [](int c, double, double, double) { return c == 0 ? 1.0F : 0.0F; });
  auto lines = plain_lines(field, red);
  lines.length = 1.0;
  lines.r1 = 3;
  lines.r2 = 4;
  lines.opacity = 0.9;
  scene.vector = lines;
  return scene;
}

// Blocks of pixels at the edge hold both surfaces, some of their pixels only the opaque one.
TEST(Surfaces, AnOpaqueOneHidesLinesAlsoAtTheEdgesOfAnother) {
  Scene scene = line_scene(-0.3, 40);
  scene.surfaces = {square(0, 1, green), square(0.3, 0.5, green, 0.33)};
  for (const Method method : drawing_methods) {
    Scene without = scene;
    without.vector.reset();
    const std::vector<double> rgba = picture_of(scene, method);
    const std::vector<double> expected = picture_of(without, method);
    for (std::size_t n = 0; n < rgba.size(); ++n) EXPECT_NEAR(rgba[n], expected[n], 1e-6) << n;
  }
}

TEST(Surfaces, LinesAreSeenBeforeASurfaceAndThroughIt) {
  constexpr int size = 40;
  constexpr std::size_t middle = 4 * (20 * size + 20);
  for (const double z : {0.3, -0.3}) {
    Scene scene = line_scene(z, size);
    scene.surfaces = {square(0, 0.5, green)};
    for (const Method method : drawing_methods) {
      const std::vector<double> rgba = picture_of(scene, method);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto line = static_cast<double>(red.at(c));
        const auto own = static_cast<double>(green.at(c));
        const double expected = z > 0 ? 0.9 * line + 0.1 * 0.5 * own : 0.5 * own + 0.5 * 0.9 * line;
        EXPECT_NEAR(rgba[middle + c], expected, 1e-5) << z;
      }
    }
  }
}

TEST(Surfaces, LiePerPixelInOrderOfDepthWithLinesAndTheBodyBetween) {
  constexpr int size = 40;
  constexpr std::size_t middle = 4 * (20 * size + 20);
  Scene scene = line_scene(0.1, size);
  scene.body.emplace();
  scene.body->shape = scene::BodyShape::ground;
  scene.body->height = -0.2;
  scene.body->color = {1, 1, 1};
  // The last one lies below the body.
  scene.surfaces = {square(-0.1, 0.25, red), square(0.3, 0.5, green), square(-0.5, 1, red)};
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto line = static_cast<double>(red.at(c));
      const double expected =
          0.5 * static_cast<double>(green.at(c)) + 0.5 * (0.9 * line + 0.1 * (0.25 * line + 0.75));
      EXPECT_NEAR(rgba[middle + c], expected, 1e-5);
    }
    EXPECT_NEAR(rgba[middle + 3], 1, 1e-6);
  }
}

TEST(Surfaces, MoreThanTheLayersOfAPixelKeepTheirLight) {
  constexpr int size = 8;
  Scene scene = empty_scene(size);
  double left = 1;
  std::array<double, 3> light{};
  for (int n = 0; n < 25; ++n) {
    const Color color{static_cast<float>(n) / 25, 0.5F, n % 2 != 0 ? 1.0F : 0.0F};
    scene.surfaces.push_back(square(0.9 - 0.07 * n, 0.1, color));
    for (std::size_t c = 0; c < 3; ++c)
      light.at(c) += left * 0.1 * static_cast<double>(color.at(c));
    left *= 0.9;
  }
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    const std::size_t middle = 4 * (4 * size + 4);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(rgba[middle + c], light.at(c), 1e-5);
    EXPECT_NEAR(rgba[middle + 3], 1 - left, 1e-5);
  }
}

TEST(Surfaces, EdgesCoverPartsOfPixels) {
  constexpr int size = 20;  // 10 pixels a unit
  Scene scene = empty_scene(size);
  scene.surfaces = {square(0, 1, green, 0.525)};
  // Behind it and as wide as the picture: no background is seen at the edges.
  const std::vector<double> alone = picture_of(scene, Method::slab);
  EXPECT_NEAR(alone[4 * (10 * size + 4) + 3], 0.25, 1e-5);
  EXPECT_NEAR(alone[4 * (4 * size + 4) + 3], 0.0625, 1e-5);
  scene.surfaces.push_back(square(-0.5, 1, red));
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    for (std::size_t p = 0; p < rgba.size(); p += 4) EXPECT_NEAR(rgba[p + 3], 1, 1e-5);
    const double edge = 0.25 * static_cast<double>(green[0]) + 0.75 * static_cast<double>(red[0]);
    EXPECT_NEAR(rgba[4 * (10 * size + 4)], edge, 1e-5);
  }
}

TEST(Surfaces, ColoursAndContoursFollowTheValuesOfPixels) {
  constexpr int size = 64;
  Scene scene = empty_scene(size);
  Shown shown = square(0, 1, green);
  shown.colors = {{0, 0, 0}, {1, 0, 0.5F}};
  shown.range = {-1, 1};
  scene.surfaces = {shown};
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    for (int x = 0; x < size; ++x) {
      EXPECT_NEAR(rgba[4 * static_cast<std::size_t>(7 * size + x)], (x + 0.5) / size, 1e-5);
    }
  }
  // A line of two pixels where x = 0, +-0.5 and +-1.
  scene.surfaces[0].contours = {0.5, 2, {1, 1, 1}, {}};
  const std::vector<double> rgba = picture_of(scene, Method::slab);
  for (int x = 0; x < size; ++x) {
    const double from = std::abs(std::remainder(x + 0.5, 16));
    const double green_of = rgba[4 * static_cast<std::size_t>(7 * size + x) + 1];
    EXPECT_NEAR(green_of, std::clamp(1.5 - from, 0.0, 1.0), 1e-4) << x;
  }
}

TEST(Surfaces, ContoursLieAtLevelsWithAndWithoutAnInterval) {
  constexpr int size = 64;  // values grow by 1 / 32 a pixel
  Scene scene = empty_scene(size);
  Shown shown = square(0, 1, {0, 0, 0});
  // The first two are closer than a pixel: their lines add up. The last lies outside.
  shown.contours = {0, 2, {1, 1, 1}, {-0.5, -0.49, 0.125, 7}};
  scene.surfaces = {shown};
  const auto line = [](double x, double level) {
    return std::clamp(1.5 - std::abs(x + 0.5 - 32 - 32 * level), 0.0, 1.0);
  };
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    for (int x = 0; x < size; ++x) {
      const double expected = std::min(line(x, -0.5) + line(x, -0.49) + line(x, 0.125), 1.0);
      EXPECT_NEAR(rgba[4 * static_cast<std::size_t>(7 * size + x)], expected, 1e-4) << x;
    }
  }
  scene.surfaces[0].contours = {0.5, 2, {1, 1, 1}, {0.125, 0.5}};
  const std::vector<double> rgba = picture_of(scene, Method::slab);
  for (int x = 0; x < size; ++x) {
    const double even = std::clamp(1.5 - std::abs(std::remainder(x + 0.5, 16)), 0.0, 1.0);
    EXPECT_NEAR(rgba[4 * static_cast<std::size_t>(7 * size + x)], std::max(even, line(x, 0.125)),
                1e-4)
        << x;
  }
}

TEST(Surfaces, APlaneBesideTheEyeEndsAtTheHorizon) {
  constexpr int size = 40;
  Scene scene = empty_scene(size);
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 0, size, size, true, 0.5);
  scene.camera.near = 0.01;
  scene.surfaces = {square(-0.1, 1, green, 1e5)};
  for (const Method method : drawing_methods) {
    const std::vector<double> rgba = picture_of(scene, method);
    for (int y = 0; y < size; ++y) {
      for (const int x : {0, 17, size - 1}) {
        const double alpha = rgba[4 * static_cast<std::size_t>(y * size + x) + 3];
        EXPECT_NEAR(alpha, y < size / 2 ? 0 : 1, 1e-5) << x << ' ' << y;
      }
    }
  }
}

TEST(Surfaces, SlabsAndKernelsStayAsCloseToTheReferenceAsWithoutThem) {
  Scene scene = cloudy_scene(14, 70);
  scene.stop_transmittance = 0;
  std::array<double, 2> before{};
  std::array<double, 2> after{};
  const auto measure = [&](std::array<double, 2>& to) {
    const std::vector<double> truth = reference_values(scene);
    to = {rms(picture_of(scene, Method::slab), truth),
          rms(picture_of(scene, Method::kernel), truth)};
  };
  measure(before);
  scene.surfaces = {ball(0.8, 0.4, green), ball(0.5, 0.6, red), ball(0.2, 1, green)};
  measure(after);
  EXPECT_LT(after[0], 1.2 * before[0] + 1e-4);
  EXPECT_LT(after[1], 1.2 * before[1] + 1e-4);
}

TEST(Surfaces, PicturesAreTheSameForAnyNumberOfThreadsAndNearlyForEveryInstructionSet) {
  Scene scene = cloudy_scene(12, 150);
  scene.surfaces = {ball(0.8, 0.4, green), ball(0.5, 0.6, red)};
  for (const Method method : {Method::slab, Method::kernel}) {
    scene.method = method;
    const auto one = render(scene, 1);
    EXPECT_EQ(largest_difference(one, render(scene, 3)), 0);
    for (const auto* table : engine::kernels::usable_tables()) {
      EXPECT_LT(largest_difference(one, render_with(*table, scene)), 2e-5F) << table->name;
    }
  }
}

TEST(Surfaces, OutsideOfThePictureChangeNothing) {
  Scene scene = cloudy_scene(12, 100);
  for (const Method method : {Method::slab, Method::kernel}) {
    scene.method = method;
    scene.surfaces.clear();
    const auto without = render(scene);
    scene.surfaces = {square(50, 0.5, green, 1)};
    const auto with = render(scene);
    EXPECT_EQ(largest_difference(without, with), 0);
    EXPECT_EQ(without.work.pixel_updates, with.work.pixel_updates);
    EXPECT_EQ(without.work.exponentials, with.work.exponentials);
  }
}

}  // namespace
}  // namespace windsplat::test
