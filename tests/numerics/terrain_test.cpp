// A terrain as the body of a scene: closed forms, a ray marcher, and what it hides.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/reference/body.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/study/truth/integrator.hpp"
#include "server/terrain/lower_boundary.hpp"
#include "server/terrain/terrain_pixel.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;
using terrain::Base;
using terrain::Hit;
using terrain::Ray;
using terrain::Terrain;

using Height = std::function<double(double, double)>;

// z(x, y) over [-1, 1] x [-1, 1].
std::shared_ptr<const Terrain> map_terrain(int columns, int rows, const Height& height) {
  std::vector<Terrain::Vertex> vertices;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double x = -1 + 2.0 * i / (columns - 1);
      const double y = -1 + 2.0 * j / (rows - 1);
      vertices.push_back(
          {static_cast<float>(x), static_cast<float>(y), static_cast<float>(height(x, y))});
    }
  }
  return std::make_shared<const Terrain>(std::move(vertices), columns, Base::map);
}

Hit met(const Terrain& terrain, const Ray& ray) {
  Hit hit;
  terrain.meet(&ray, 1, &hit);
  return hit;
}

bool is_met(const Hit& hit) { return std::isfinite(hit.along); }

scene::Body body_of(std::shared_ptr<const Terrain> terrain) {
  scene::Body body;
  body.shape = scene::BodyShape::terrain;
  body.terrain = std::move(terrain);
  body.color = {0.1F, 0.2F, 0.4F};
  return body;
}

double hill(double x, double y) { return 0.15 * std::cos(5 * x) * std::cos(4 * y + 0.3) - 0.1; }

std::vector<Ray> random_rays(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> draw(-1, 1);
  std::vector<Ray> rays;
  for (int n = 0; n < count; ++n) {
    const glm::dvec3 from{2 * draw(random), 2 * draw(random), 0.3 + std::abs(draw(random))};
    const glm::dvec3 to{draw(random), draw(random), 0.2 * draw(random)};
    rays.push_back({from, to - from, 0});
  }
  return rays;
}

TEST(Terrain, ARayMeetsATiltedPlaneAtItsDepthWithItsNormal) {
  const glm::dvec3 normal = glm::normalize(glm::dvec3(-0.25, 0.5, 1));
  const auto terrain = map_terrain(9, 6, [](double x, double y) { return 0.25 * x - 0.5 * y; });
  int count = 0;
  for (const Ray& ray : random_rays(2000, 1)) {
    const double along = -glm::dot(ray.from, normal) / glm::dot(ray.along, normal);
    const glm::dvec3 at = ray.from + along * ray.along;
    const double inside = 1 - std::max(std::abs(at.x), std::abs(at.y));
    if (std::abs(inside) < 1e-5) continue;
    const Hit hit = met(*terrain, ray);
    ASSERT_EQ(is_met(hit), along > 0 && inside > 0);
    if (!is_met(hit)) continue;
    ++count;
    EXPECT_NEAR(hit.along, along, 1e-6 / std::abs(glm::dot(glm::normalize(ray.along), normal)));
    EXPECT_GT(glm::dot(hit.normal, normal), 1 - 1e-6);
  }
  EXPECT_GT(count, 500);
}

// The height of the two triangles of a cell, by its formula in the coordinates of the cell.
double height_at(const Terrain& terrain, double x, double y) {
  const double u = (x + 1) / 2 * (terrain.width() - 1);
  const double v = (y + 1) / 2 * (terrain.height() - 1);
  const int i = std::clamp(static_cast<int>(u), 0, terrain.width() - 2);
  const int j = std::clamp(static_cast<int>(v), 0, terrain.height() - 2);
  const double s = u - i;
  const double t = v - j;
  const auto z = [&](int a, int b) { return terrain.vertex(i + a, j + b).z; };
  return s > t ? z(0, 0) + s * (z(1, 0) - z(0, 0)) + t * (z(1, 1) - z(1, 0))
               : z(0, 0) + t * (z(0, 1) - z(0, 0)) + s * (z(1, 1) - z(0, 1));
}

TEST(Terrain, RaysMeetHillsWhereAMarcherCrossesThem) {
  const auto terrain = map_terrain(33, 27, hill);
  int count = 0;
  for (const Ray& ray : random_rays(400, 2)) {
    const auto above = [&](double t) {
      const glm::dvec3 at = ray.from + t * ray.along;
      return at.z - height_at(*terrain, at.x, at.y);
    };
    const auto over = [&](double t) {
      const glm::dvec3 at = ray.from + t * ray.along;
      return std::max(std::abs(at.x), std::abs(at.y)) < 1;
    };
    double crossing = std::numeric_limits<double>::infinity();
    constexpr double step = 2e-4;
    for (double t = 0; t < 3 && std::isinf(crossing); t += step) {
      if (!over(t) || !over(t + step) || above(t) * above(t + step) > 0) continue;
      double low = t;
      double high = t + step;
      for (int n = 0; n < 60; ++n) {
        const double middle = 0.5 * (low + high);
        (above(low) * above(middle) <= 0 ? high : low) = middle;
      }
      crossing = low;
    }
    const Hit hit = met(*terrain, ray);
    if (is_met(hit) && hit.along > 2.9) continue;
    if (std::isinf(crossing)) continue;  // or between two steps of the marcher
    ++count;
    EXPECT_LE(hit.along, crossing + 1e-6);
    EXPECT_NEAR(above(hit.along), 0, 1e-6);
    if (hit.along > crossing - 2 * step) {
      EXPECT_NEAR(hit.along, crossing, 1e-5);
    }
  }
  EXPECT_GT(count, 200);
}

// Needle cells, a missing vertex; bundles of rays near each other from within, below and above, of
// one origin or one direction, and some of which the directions differ in sign.
TEST(Terrain, RaysTogetherMeetWhatEachOfThemMeetsAlone) {
  std::vector<Terrain::Vertex> vertices;
  for (int n = 0; n < 40 * 31; ++n) {
    const double x = -1 + n % 40 / 19.5;
    const double y = 1e-3 * (n / 40 - 15);
    const double z = n == 20 + 40 * 15 ? std::nan("") : 3 * hill(x, 800 * y);
    vertices.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  }
  const Terrain needles(vertices, 40, Base::map);
  const auto hills = map_terrain(33, 27, hill);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> draw(-1, 1);
  const auto vector = [&](double size) {
    return size * glm::dvec3(draw(random), draw(random), draw(random));
  };
  int count = 0;
  for (int bundle = 0; bundle < 2000; ++bundle) {
    const glm::dvec3 from = vector(bundle % 3 == 0 ? 0.3 : 2);
    const glm::dvec3 to = vector(0.5) - from;
    const double spread = std::exp(2 * draw(random) - 4);
    std::array<Ray, terrain::rays_max> rays;
    for (Ray& ray : rays) {
      ray = {from, to, bundle % 5 == 0 ? 0.2 : 0};
      if (bundle % 2 == 0) ray.along += vector(spread);
      if (bundle % 2 == 1 || bundle % 7 == 0) ray.from += vector(spread);
    }
    for (const Terrain* terrain : {hills.get(), &needles}) {
      std::array<Hit, rays.size()> hits;
      terrain->meet(rays.data(), static_cast<int>(rays.size()), hits.data());
      for (std::size_t r = 0; r < rays.size(); ++r) {
        const Hit alone = met(*terrain, rays[r]);
        ASSERT_EQ(is_met(hits[r]), is_met(alone)) << bundle;
        if (!is_met(alone)) continue;
        ++count;
        ASSERT_EQ(hits[r].along, alone.along) << bundle;
      }
    }
  }
  EXPECT_GT(count, 20000);
}

TEST(Terrain, NoRayPassesBetweenTriangles) {
  const auto terrain = map_terrain(17, 17, hill);
  for (int j = 1; j < 64; ++j) {
    for (int i = 1; i < 64; ++i) {
      const double x = -1 + i / 32.0;
      const double y = -1 + j / 32.0;
      EXPECT_TRUE(is_met(met(*terrain, {{x, y, 3}, {0, 0, -1}, 0}))) << x << ' ' << y;
    }
  }
}

TEST(Terrain, PartsOfAPixelThatAnEdgeCoversFollowItsArea) {
  const auto terrain = map_terrain(5, 5, [](double x, double) { return 0.5 * x; });
  constexpr int size = 80;
  constexpr double pixel = 0.03;
  Scene scene;
  scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0, 0, -1}, 2, size, size, false, 0.5 * size * pixel);
  scene.body = body_of(terrain);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    const engine::Rendered rendered = render(scene);
    double area = 0;
    for (std::size_t i = 3; i < rendered.image.rgba.size(); i += 4) area += rendered.image.rgba[i];
    // A quarter of a pixel along the edge.
    EXPECT_NEAR(area, 4 / (pixel * pixel), 8 / pixel / 4 / 2);
    const float* const middle = test::pixel(rendered.image, size / 2, size / 2);
    EXPECT_EQ(middle[3], 1);
    // The slope faces west, a light from the north-west.
    const double relief = (1 + 0.5 * std::sqrt(0.5)) / std::hypot(1, 0.5);
    const double shade = (0.6 + 0.4 / std::hypot(1, 0.5)) * relief;
    EXPECT_NEAR(middle[2], shade * 0.4, 1e-5);
  }
}

TEST(Terrain, CellsBesideMissingVerticesAreOpen) {
  std::vector<Terrain::Vertex> vertices;
  for (int n = 0; n < 25; ++n) {
    const float z = n == 12 ? std::numeric_limits<float>::quiet_NaN() : 0.0F;
    vertices.push_back({static_cast<float>(n % 5), static_cast<float>(n / 5), z});
  }
  const Terrain terrain(vertices, 5, Base::map);
  for (const double x : {0.5, 1.5, 2.5, 3.5}) {
    for (const double y : {0.5, 1.5, 2.5, 3.5}) {
      const bool open = std::abs(x - 2) < 1 && std::abs(y - 2) < 1;
      EXPECT_EQ(is_met(met(terrain, {{x, y, 1}, {0, 0, -1}, 0})), !open) << x << ' ' << y;
    }
  }
}

TEST(Terrain, AMapIsMetFromBelowAndAGlobeIsNot) {
  const auto map = map_terrain(4, 4, hill);
  EXPECT_TRUE(is_met(met(*map, {{0.1, 0.2, -2}, {0, 0, 1}, 0})));
  const std::vector<Terrain::Vertex> patch{
      {-.1F, -.1F, 1}, {.1F, -.1F, 1}, {-.1F, .1F, 1}, {.1F, .1F, 1}};
  const Terrain globe(patch, 2, Base::globe);
  EXPECT_TRUE(is_met(met(globe, {{0, 0, 2}, {0.001, 0.002, -1}, 0})));
  EXPECT_FALSE(is_met(met(globe, {{0, 0, 0}, {0.001, 0.002, 1}, 0})));
}

// A lattice over the hills; its lowest cells end at them.
Scene over_hills(bool perspective, std::array<int, 3> dims = {14, 12, 5}) {
  Scene scene;
  scene.lattice = even_lattice(dims, {2.0 / dims[0], 2.0 / dims[1], 0.5 / dims[2]});
  displace(scene.lattice, [](const glm::dvec3& p) {
    return glm::dvec3(p.x, p.y, 0.1 + p.z + (0.5 - p.z) * hill(p.x, p.y));
  });
  scene.body = body_of(terrain::surface_of({*scene.lattice.places, dims, {1, 1, 1}, 0}, Base::map));
  scene.camera =
      look({0, 0, 0}, {0.5, 0.8, -0.3}, 3, 90, 60, perspective, perspective ? 0.35 : 1.1);
  scene.vector =
      plain_lines(make_volume(scene.lattice, 3,
                              [](int c, double x, double y, double z) {
                                return static_cast<float>(std::sin(3 * x + 2 * y + 4 * z + c));
                              }),
                  {1, 0.8F, 0.2F});
  scene.vector->length = 0.15;
  scene.stop_transmittance = 0;
  return scene;
}

TEST(Terrain, TheLowerBoundaryLiesHalfACellBelowTheLowestSamples) {
  const Scene scene = over_hills(true);
  const int nx = scene.lattice.dims[0];
  const int ny = scene.lattice.dims[1];
  const Terrain& terrain = *scene.body->terrain;
  ASSERT_EQ(terrain.width(), nx + 2);
  ASSERT_EQ(terrain.height(), ny + 2);
  const auto z = [&](int i, int j, int k) {
    return static_cast<double>(
        (*scene.lattice.places)[static_cast<std::size_t>((k * ny + j) * nx + i)][2]);
  };
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      EXPECT_NEAR(terrain.vertex(i + 1, j + 1).z, 1.5 * z(i, j, 0) - 0.5 * z(i, j, 1), 1e-6);
    }
  }
  EXPECT_NEAR(terrain.vertex(0, 0).x, -1, 1e-6);
  EXPECT_NEAR(terrain.vertex(nx + 1, ny + 1).y, 1, 1e-6);
}

TEST(Terrain, OneColumnHasACell) {
  for (const std::array<int, 3>& dims :
       {std::array{1, 1, 1}, std::array{1, 6, 2}, std::array{6, 1, 1}}) {
    scene::Lattice lattice = even_lattice(dims, {0.3, 0.3, 0.1});
    displace(lattice, [](const glm::dvec3& p) { return p; });
    const auto terrain =
        terrain::surface_of({*lattice.places, dims, {0.3, 0.3, 0.1}, 0}, Base::map);
    const double x = 0.149 * dims[0];
    const double y = 0.149 * dims[1];
    EXPECT_NEAR(met(*terrain, {{x, y, 1}, {0, 0, -1}, 0}).along, 1 + 0.05 * dims[2], 1e-6);
    EXPECT_FALSE(is_met(met(*terrain, {{1.02 * x, y, 1}, {0, 0, -1}, 0})));
    EXPECT_FALSE(is_met(met(*terrain, {{x, 1.02 * y, 1}, {0, 0, -1}, 0})));
  }
}

// Each cell of longitude twenty times as wide as one of latitude.
TEST(Terrain, AGlobeClosesAroundWithoutASeam) {
  constexpr int columns = 18;
  constexpr int rows = 170;
  std::vector<std::array<float, 3>> places;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double latitude = (j - (rows - 1) / 2.0) * pi / 180;
      const double longitude = i * 20 * pi / 180;
      const double r = 0.9;
      places.push_back({static_cast<float>(r * std::cos(latitude) * std::sin(longitude)),
                        static_cast<float>(-r * std::cos(latitude) * std::cos(longitude)),
                        static_cast<float>(r * std::sin(latitude))});
    }
  }
  const auto terrain =
      terrain::surface_of({places, {columns, rows, 1}, {0.3, 0.3, 0.1}, columns}, Base::globe);
  for (int n = 0; n < 360; ++n) {
    const double longitude = n * pi / 180;
    const glm::dvec3 out{std::sin(longitude), -std::cos(longitude), 0.3};
    const Hit hit = met(*terrain, {2.0 * out, -out, 0});
    ASSERT_TRUE(is_met(hit)) << n;
    const double radius = glm::length((2 - hit.along) * out);
    EXPECT_LT(radius, 0.8501);
    EXPECT_GT(radius, 0.85 * std::cos(10 * pi / 180) - 1e-4);
    EXPECT_GT(glm::dot(hit.normal, glm::normalize(out)), 0.97);
  }
}

engine::reference::Picture truth_of(const Scene& scene) {
  ThreadPool pool(2);
  engine::reference::Options options;
  options.tolerance = 1e-9;
  auto picture = engine::reference::render(scene, pool, CancelToken(), options);
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(*picture);
}

// Lines alone are exact in slabs.
TEST(Terrain, LinesOverHillsEqualTheReference) {
  for (const bool perspective : {true, false}) {
    Scene scene = over_hills(perspective);
    const engine::reference::Picture truth = truth_of(scene);
    scene.method = Method::slab;
    for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
      const engine::Rendered rendered = render_with(*table, scene);
      double most = 0;
      for (std::size_t i = 0; i < truth.rgba.size(); ++i) {
        most =
            std::max(most, std::abs(static_cast<double>(rendered.image.rgba[i]) - truth.rgba[i]));
      }
      EXPECT_LT(most, 3e-4) << table->name;
    }
  }
}

// Against the integrator, which tries every triangle; pixels that the terrain covers in part
// differ.
TEST(Terrain, MediumAndLinesEndAtHillsAsForTheIntegrator) {
  Scene scene = over_hills(true, {8, 7, 4});
  const auto cloud = make_volume(scene.lattice, 1, [](int, double x, double y, double) {
    return static_cast<float>(2 + std::sin(5 * x) * std::cos(4 * y));
  });
  scene.scalars = {medium(cloud, {0.3F, 0.6F, 1.0F})};
  const engine::reference::Picture truth = truth_of(scene);
  std::vector<truth::Pixel> pixels;
  for (int y = 5; y < 60; y += 6) {
    for (int x = 3; x < 90; x += 8) pixels.push_back({x, y});
  }
  const auto lights = truth::integrate(scene, pixels, 400);
  const auto view = engine::reference::make_view(scene.camera);
  std::size_t ended = 0;
  std::size_t in_part = 0;
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const double* const at = truth.rgba.data() + 4 * (static_cast<std::size_t>(pixels[n].y) * 90 +
                                                      static_cast<std::size_t>(pixels[n].x));
    const double covered =
        body_surface(*scene.body, view, pixels[n].x + 0.5, pixels[n].y + 0.5).opacity;
    if (covered > 0 && covered < 1) {
      ++in_part;
      continue;
    }
    ended += lights[n].body ? 1 : 0;
    EXPECT_NEAR(at[3], lights[n].alpha, 1e-4) << pixels[n].x << ' ' << pixels[n].y;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(at[c], lights[n].rgb[c], 1e-4);
  }
  EXPECT_GT(ended, 20U);
  EXPECT_LT(in_part, 8U);
}

// A wall from 0 to 0.4 across the picture, lines before it or behind it.
TEST(Terrain, LinesBehindAHillVanishAndThoseBeforeItAreUnchanged) {
  const auto wall =
      map_terrain(41, 201, [](double, double y) { return 0.8 * std::exp(-y * y / 0.005) - 0.4; });
  for (const Method method : {Method::kernel, Method::slab}) {
    const auto draw = [&](bool before, bool behind, bool with_wall) {
      Scene scene;
      scene.lattice = even_lattice({9, 12, 3}, {0.1, 0.15, 0.1});
      scene.camera = look({0, 0, 0}, {0, 1, 0}, 4, 60, 40, false, 0.25);
      scene.vector = plain_lines(
          make_volume(scene.lattice, 3,
                      [=](int c, double x, double y, double z) {
                        if (std::abs(y) < 0.3 || !(y < 0 ? before : behind)) {
                          return std::numeric_limits<float>::quiet_NaN();
                        }
                        return static_cast<float>(c == 1 ? 0 : std::sin(9 * x + 7 * z + 2 * c));
                      }),
          {1, 0.8F, 0.2F});
      scene.vector->length = 0.1;
      scene.vector->opacity = 0.8;
      scene.method = method;
      scene.stop_transmittance = 0;
      if (with_wall) scene.body = body_of(wall);
      return render(scene);
    };
    const engine::Rendered alone = draw(false, false, true);
    EXPECT_GT(largest_difference(draw(false, true, false), draw(false, false, false)), 0.5F);
    EXPECT_EQ(largest_difference(draw(false, true, true), alone), 0);
    const engine::Rendered lines = draw(true, false, false);
    const engine::Rendered over = draw(true, true, true);
    for (std::size_t i = 0; i < over.image.rgba.size(); ++i) {
      const float left = 1 - lines.image.rgba[i / 4 * 4 + 3];
      EXPECT_NEAR(over.image.rgba[i], lines.image.rgba[i] + left * alone.image.rgba[i], 2e-6);
    }
  }
}

TEST(Terrain, BricksBehindHillsAreLeftOut) {
  Scene scene = over_hills(true, {60, 60, 4});
  scene.camera = look({0, 0, 0}, {0, 1, -0.02}, 3, 200, 100, true, 0.2);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    EXPECT_GT(render(scene).work.occluded, 0);
    Scene bare = scene;
    bare.body.reset();
    EXPECT_EQ(render(bare).work.occluded, 0);
  }
}

TEST(Terrain, AnyNumberOfThreadsGivesTheSameBits) {
  for (const Method method : {Method::kernel, Method::slab}) {
    Scene scene = over_hills(true);
    scene.method = method;
    EXPECT_EQ(render(scene, 1).image.rgba, render(scene, 5).image.rgba);
  }
}

}  // namespace
}  // namespace windsplat::test
