// The Earth on the body of a scene: where coasts and the graticule are seen, and how wide.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/ground/paint.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::BodyShape;
using scene::Method;
using scene::Scene;

constexpr double degree = pi / 180;
constexpr double graticule_opacity = 0.28;

// White lines on black.
ground::Style lines_alone(int height) {
  ground::Style style;
  style.line = {1, 1, 1};
  style.scale = height / 720.0;
  return style;
}

glm::dvec3 direction(double longitude, double latitude) {
  return {std::cos(latitude * degree) * std::sin(longitude * degree),
          -std::cos(latitude * degree) * std::cos(longitude * degree), std::sin(latitude * degree)};
}

void set_paint(std::shared_ptr<const ground::Map> map, const ground::Style& style, Scene& scene) {
  scene.body->paint = std::make_shared<ground::Paint>(std::move(map), style);
}

// A globe of radius 0.9 seen from above a place, `span` degrees high.
Scene globe_above(double longitude, double latitude, double span, int size, bool perspective) {
  Scene scene;
  scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
  constexpr double radius = 0.9;
  constexpr double distance = 2;
  const double half = radius * 0.5 * span * degree;
  const glm::dvec3 at = radius * direction(longitude, latitude);
  scene.camera = look(at, -direction(longitude, latitude), distance, size, size, perspective,
                      perspective ? half / distance : half);
  scene.body = scene::Body{};
  scene.body->radius = radius;
  set_paint(std::make_shared<ground::Globe>(), lines_alone(size), scene);
  return scene;
}

// A map of the world 2 by 1 wide at z = 0.
std::shared_ptr<const ground::Map> flat_map() {
  return std::make_shared<ground::AxesMap>(ground::Axis{{-180, 180}, {-1, 1}},
                                           ground::Axis{{-90, 90}, {-0.5, 0.5}});
}

// Seen from above, `span` degrees high about a place.
Scene map_above(double longitude, double latitude, double span, int size, bool perspective) {
  Scene scene;
  scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
  constexpr double distance = 1.5;
  const double half = 0.5 * span / 180;
  scene.camera = look({longitude / 180, latitude / 180, 0}, {0, 0, -1}, distance, size, size,
                      perspective, perspective ? half / distance : half);
  scene.camera.right = {1, 0, 0};
  scene.camera.up = {0, 1, 0};
  scene.body = scene::Body{};
  scene.body->shape = BodyShape::ground;
  scene.body->low = {-1, -0.5};
  scene.body->high = {1, 0.5};
  set_paint(flat_map(), lines_alone(size), scene);
  return scene;
}

// Column and row of a world point, pixel centres at +0.5.
std::array<double, 2> seen_at(const scene::Camera& camera, const glm::dvec3& point) {
  const glm::dvec3 from = point - camera.eye;
  const double pixel = 2 * camera.half_height / camera.height;
  const double scale = pixel * (camera.perspective ? glm::dot(from, camera.forward) : 1);
  return {0.5 * camera.width + glm::dot(from, camera.right) / scale,
          0.5 * camera.height - glm::dot(from, camera.up) / scale};
}

// Distance in pixels from a point of the picture to the middle of the nearest bright pixel.
double to_bright(const engine::Image& image, const std::array<double, 2>& at) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (pixel(image, x, y)[0] < 0.4F) continue;
      nearest = std::min(nearest, std::hypot(x + 0.5 - at[0], y + 0.5 - at[1]));
    }
  }
  return nearest;
}

struct Cape {
  double longitude, latitude;
  double off_longitude, off_latitude;  // a place at sea nearby, without islands
};
constexpr std::array<Cape, 3> capes{{{-5.610, 36.000, -6.6, 35.7},    // Tarifa, near Gibraltar
                                     {18.473, -34.357, 17.6, -34.8},  // Cape of Good Hope
                                     {77.541, 8.078, 77.6, 7.0}}};    // Cape Comorin

// Coasts are within 0.015 degrees of the data, and gazetteers within 2 km of them: 0.04 degrees.
TEST(Ground, CapesAreSeenAtTheirPixels) {
  constexpr int size = 200;
  constexpr double span = 4;
  constexpr double tolerance = 0.04 / span * size + 1;
  for (const Cape& cape : capes) {
    for (const bool perspective : {true, false}) {
      Scene globe = globe_above(cape.longitude + 0.5, cape.latitude - 0.3, span, size, perspective);
      Scene map = map_above(cape.longitude + 0.5, cape.latitude - 0.3, span, size, perspective);
      set_paint(std::make_shared<ground::Globe>(), lines_alone(720), globe);
      set_paint(flat_map(), lines_alone(720), map);
      const auto globe_pixel = [&](double longitude, double latitude) {
        return seen_at(globe.camera, 0.9 * direction(longitude, latitude));
      };
      const auto map_pixel = [&](double longitude, double latitude) {
        return seen_at(map.camera, {longitude / 180, latitude / 180, 0});
      };
      const engine::Image on_globe = render(globe).image;
      const engine::Image on_map = render(map).image;
      EXPECT_LT(to_bright(on_globe, globe_pixel(cape.longitude, cape.latitude)), tolerance);
      EXPECT_LT(to_bright(on_map, map_pixel(cape.longitude, cape.latitude)), tolerance);
      constexpr double clear = 0.4 / span * size;
      EXPECT_GT(to_bright(on_globe, globe_pixel(cape.off_longitude, cape.off_latitude)), clear);
      EXPECT_GT(to_bright(on_map, map_pixel(cape.off_longitude, cape.off_latitude)), clear);
    }
  }
}

// The parallel of 10 degrees and the meridian of 20, of a graticule of 10 degrees.
TEST(Ground, TheGraticuleIsSeenWhereItsFormulaPutsIt) {
  constexpr int size = 240;
  for (const bool perspective : {true, false}) {
    Scene globe = globe_above(25, 14, 30, size, perspective);
    Scene map = map_above(25, 14, 30, size, perspective);
    ground::Style style = lines_alone(720);
    style.coastlines = false;
    style.graticule = 10;
    set_paint(std::make_shared<ground::Globe>(), style, globe);
    set_paint(flat_map(), style, map);
    const engine::Image on_globe = render(globe).image;
    const engine::Image on_map = render(map).image;
    for (double along = 11; along < 19; along += 0.37) {
      // A point of a line half a pixel away from the middles of pixels at most has 0.6 of it.
      const auto light = [](const engine::Image& image, const std::array<double, 2>& at) {
        return static_cast<double>(
            pixel(image, static_cast<int>(at[0]), static_cast<int>(at[1]))[0]);
      };
      const auto check = [&](double longitude, double latitude, double low, double high) {
        const double on =
            light(on_globe, seen_at(globe.camera, 0.9 * direction(longitude, latitude)));
        EXPECT_GT(on, low);
        EXPECT_LT(on, high);
        const double flat =
            light(on_map, seen_at(map.camera, {longitude / 180, latitude / 180, 0}));
        EXPECT_GT(flat, low);
        EXPECT_LT(flat, high);
      };
      check(20, along, 0.05, 0.3);
      check(15 + along, 10, 0.05, 0.3);
      if (along > 11.5 && along < 18.5) check(10 + along, along, -1e-6, 1e-6);
    }
  }
}

// The light of a line across it: its width times its opacity, whatever the size of the picture.
TEST(Ground, WidthsFollowTheHeightOfThePicture) {
  for (const int size : {720, 1440, 2160}) {
    Scene scene = map_above(25, 14, 30, size, false);
    scene.camera.width = 64;
    scene.camera.eye.x = 20.0 / 180;
    ground::Style style = lines_alone(size);
    style.coastlines = false;
    style.graticule = 10;
    set_paint(flat_map(), style, scene);
    const engine::Image image = render(scene).image;
    double light = 0;
    const int row = size / 2 - size / 30;  // at latitude 15
    for (int x = 0; x < image.width; ++x) light += static_cast<double>(pixel(image, x, row)[0]);
    EXPECT_NEAR(light, graticule_opacity * 0.9 * size / 720, 1e-3) << size;
  }
}

// A lit globe with land, sea and every kind of line, whole and near, and maps.
std::vector<Scene> scenes_of_the_earth() {
  std::vector<Scene> all;
  for (const bool perspective : {true, false}) {
    for (const double span : {8.0, 150.0}) {
      all.push_back(globe_above(12, 44, span, 96, perspective));
      all.push_back(map_above(12, 44, 0.5 * span, 96, perspective));
    }
    all.push_back(globe_above(170, 87, 60, 96, perspective));
    all.push_back(globe_above(-178, -75, 60, 96, perspective));
  }
  for (Scene& scene : all) {
    ground::Style style = lines_alone(96);
    style.land = {0.3, 0.2, 0.1};
    style.sea = {0.05, 0.1, 0.3};
    style.line = {0.9, 0.8, 0.7};
    style.borders = true;
    style.graticule = 10;
    const bool globe = scene.body->shape == BodyShape::sphere;
    set_paint(globe ? std::make_shared<const ground::Globe>() : flat_map(), style, scene);
  }
  return all;
}

TEST(Ground, EveryMethodDrawsTheSame) {
  for (Scene& scene : scenes_of_the_earth()) {
    ThreadPool pool(2);
    const auto truth =
        engine::reference::render(scene, pool, CancelToken(), engine::reference::Options());
    ASSERT_TRUE(truth);
    for (const Method method : {Method::kernel, Method::slab}) {
      scene.method = method;
      const engine::Image image = render(scene).image;
      double most = 0;
      for (std::size_t i = 0; i < image.rgba.size(); ++i) {
        most = std::max(most, std::abs(static_cast<double>(image.rgba[i]) - truth->rgba[i]));
      }
      EXPECT_LT(most, 1e-5);
    }
  }
}

TEST(Ground, ThreadsAndInstructionSetsDrawTheSame) {
  for (const Scene& scene : scenes_of_the_earth()) {
    const engine::Rendered one = render(scene, 1);
    EXPECT_EQ(one.image.rgba, render(scene, 2).image.rgba);
    EXPECT_EQ(one.image.rgba, render(scene, 3).image.rgba);
    for (const auto* table : engine::kernels::usable_tables()) {
      EXPECT_LT(largest_difference(one, render_with(*table, scene)), 1e-5F);
    }
  }
}

// What is gathered once for a square of pixels gives each of them the colour that it has alone.
TEST(Ground, SquaresOfPixelsHaveTheColorsOfTheirPixels) {
  int even = 0;
  int uneven = 0;
  for (const Scene& scene : scenes_of_the_earth()) {
    const terrain::View view{scene.camera.eye,
                             scene.camera.right,
                             -scene.camera.up,
                             scene.camera.forward,
                             2 * scene.camera.half_height / scene.camera.height,
                             scene.camera.near,
                             scene.camera.perspective};
    const ground::Paint& paint = *scene.body->paint;
    const auto depth_at = [&](double x, double y) {
      const glm::dvec3 aside = view.pixel * (x * view.right + y * view.down);
      const glm::dvec3 from = view.perspective ? view.eye : view.eye + aside;
      const glm::dvec3 way = view.perspective ? view.forward + aside : view.forward;
      if (scene.body->shape == BodyShape::ground) return -from.z / way.z;
      const double b = glm::dot(from, way) / glm::dot(way, way);
      const double c = (glm::dot(from, from) - 0.81) / glm::dot(way, way);
      return -b - std::sqrt(b * b - c);
    };
    for (double y = -46; y < 42; y += 4) {
      for (double x = -46; x < 42; x += 4) {
        const auto seen = [&](double i, double j) {
          return paint.seen(view, x + i, y + j, depth_at(x + i, y + j), glm::dvec3(0));
        };
        if (!std::isfinite(depth_at(x, y) + depth_at(x + 3, y) + depth_at(x, y + 3) +
                           depth_at(x + 3, y + 3))) {
          continue;
        }
        ground::Near near;
        if (!paint.find_near(seen(2, 2), 2, near)) continue;
        ++(near.is_even ? even : uneven);
        for (int l = 0; l < 16; ++l) {
          const ground::Color own = paint.color(seen(l % 4, l / 4));
          const ground::Color fast =
              near.is_even ? paint.even_color(near) : paint.color(seen(l % 4, l / 4), near);
          for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(own[c], fast[c], 1e-9);
        }
      }
    }
  }
  EXPECT_GT(even, 150);
  EXPECT_GT(uneven, 200);
}

// Toward the limb lines would crowd: they fade before it, and nothing is drawn beside it.
TEST(Ground, LinesFadeTowardTheLimb) {
  constexpr int size = 200;
  const double limb = 0.5 * size / (0.5 * 130 * degree);
  int near = 0;
  for (const double longitude : {0.0, 60.0, 120.0, 180.0, -120.0, -60.0}) {
    Scene scene = globe_above(longitude, 10, 130, size, false);
    ground::Style style = lines_alone(720);
    style.graticule = 2;
    set_paint(std::make_shared<ground::Globe>(), style, scene);
    const engine::Image image = render(scene).image;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double off = std::hypot(x + 0.5 - 0.5 * size, y + 0.5 - 0.5 * size) / limb;
        const float* const at = pixel(image, x, y);
        if (off > std::sqrt(1 - 0.03 * 0.03)) {
          ++near;
          EXPECT_EQ(at[0], 0);
        }
        if (off > 1 + 1 / limb) {
          EXPECT_EQ(at[3], 0);
        }
      }
    }
  }
  EXPECT_GT(near, 1000);
}

// The coast on a slope: land to the east of x = 0 by its columns, at any height of the terrain.
TEST(Ground, TerrainHasTheColorOfTheColumnBelow) {
  std::vector<terrain::Terrain::Vertex> vertices;
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 17; ++i) {
      const float x = -1 + 0.125F * static_cast<float>(i);
      const float y = -0.5F + 0.125F * static_cast<float>(j);
      vertices.push_back({x, y, 0.1F * std::cos(7 * x) * std::cos(5 * y)});
    }
  }
  Scene scene = map_above(12, 44, 60, 96, false);
  scene.camera =
      look({0.06, 0.2, 0}, glm::normalize(glm::dvec3(0.3, 0.8, -0.9)), 3, 96, 96, true, 0.12);
  scene.body->shape = BodyShape::terrain;
  scene.body->terrain =
      std::make_shared<terrain::Terrain>(std::move(vertices), 17, terrain::Base::map);
  ground::Style style = lines_alone(96);
  style.coastlines = false;
  style.land = {1, 1, 1};
  style.sea = {0, 0, 0};
  set_paint(flat_map(), style, scene);
  const engine::Image image = render(scene).image;
  int checked = 0;
  for (int y = 1; y < 95; y += 3) {
    for (int x = 1; x < 95; x += 3) {
      const double pixel_size = 2 * scene.camera.half_height / 96;
      const glm::dvec3 along =
          scene.camera.forward +
          pixel_size * ((x + 0.5 - 48) * scene.camera.right - (y + 0.5 - 48) * scene.camera.up);
      const terrain::Ray ray{scene.camera.eye, along, 0};
      terrain::Hit hit;
      scene.body->terrain->meet(&ray, 1, &hit);
      if (!std::isfinite(hit.along)) continue;
      const glm::dvec3 at = ray.from + hit.along * ray.along;
      // Only where a pixel around lies on one side of the coast.
      const ground::Level& level = ground::atlas(0);
      int land = 0;
      for (double dx = -2.4; dx < 2.5; dx += 0.6) {
        for (double dy = -4; dy < 4.1; dy += 1) {
          land += level.is_land({180 * at.x + dx, 180 * at.y + dy}) ? 1 : 0;
        }
      }
      if (land % 81 != 0) continue;
      ++checked;
      EXPECT_EQ(pixel(image, x, y)[0] > 0, land == 81) << x << ' ' << y;
    }
  }
  EXPECT_GT(checked, 100);
}

// A plane that rises to the south-east faces the light, one that rises to the north-west is dark.
TEST(Ground, SlopesAreShadedByALightFromTheNorthWest) {
  const glm::dvec3 up(0, 0, 1);
  EXPECT_NEAR(terrain::relief_of(up, up, terrain::Base::map), 1, 1e-12);
  for (const double slope : {-0.3, -0.1, 0.1, 0.3}) {
    const glm::dvec3 normal = glm::normalize(glm::dvec3(-slope, slope, 1));
    const double formula = (1 + std::sqrt(2.0) * slope) / std::sqrt(1 + 2 * slope * slope);
    EXPECT_NEAR(terrain::relief_of(normal, up, terrain::Base::map), std::clamp(formula, 0.5, 1.35),
                1e-12);
    // Slopes along the light's own direction differ, those across it do not.
    const glm::dvec3 across = glm::normalize(glm::dvec3(slope, slope, 1));
    EXPECT_NEAR(terrain::relief_of(across, up, terrain::Base::map),
                1 / std::sqrt(1 + 2 * slope * slope), 1e-12);
    const glm::dvec3 place = direction(40, 25);
    const glm::dvec3 east(std::cos(40 * degree), std::sin(40 * degree), 0);
    const glm::dvec3 north = glm::cross(place, east);
    EXPECT_NEAR(terrain::relief_of(glm::normalize(place - slope * east + slope * north), place,
                                   terrain::Base::globe),
                std::clamp(formula, 0.5, 1.35), 1e-12);
  }
}

}  // namespace
}  // namespace windsplat::test
