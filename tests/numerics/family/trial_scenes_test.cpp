// Tried pixels of views in which the order of kernels differs, and the work of trying.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/content.hpp"
#include "server/frame/difference.hpp"
#include "server/frame/drawn_samples.hpp"
#include "server/frame/pixel_trials.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Scene;

// The eye at a place, looking along `forward`.
void look_from(Scene& scene, const glm::dvec3& eye, const glm::dvec3& forward) {
  scene.camera = look(eye + glm::normalize(forward), forward, 1, 110, 90, true, 0.6);
}

Scene with_strides(int lines, int medium) {
  Scene scene = cloudy_scene(24, 100);
  scene.vector->stride = lines;
  scene.scalars[0].stride = medium;
  return scene;
}

// A shell from a radius of 0.8 to 1 around a sphere.
Scene shell_around_body() {
  Scene scene = cloudy_scene(24, 100);
  displace(scene.lattice, [](const glm::dvec3& p) {
    const double radius = 0.9 + 0.1 * p.z;
    const double across = 0.3 * pi * p.y;
    return radius * glm::dvec3(std::cos(across) * std::cos(pi * p.x),
                               std::cos(across) * std::sin(pi * p.x), std::sin(across));
  });
  scene.body.emplace();
  scene.body->radius = 0.78;
  scene.body->color = {0.1F, 0.2F, 0.4F};
  return scene;
}

struct UnusualView {
  std::string name;
  Scene scene;
};
std::vector<UnusualView> unusual_scenes() {
  std::vector<UnusualView> out;
  Scene inside = cloudy_scene(24, 100);
  look_from(inside, {0.13, -0.21, 0.07}, {0.3, 1, -0.2});
  out.push_back({"eye inside", inside});
  out.push_back({"two strides", with_strides(2, 1)});
  for (const auto& [lines, medium] : {std::pair{1, 3}, std::pair{3, 2}}) {
    Scene both = with_strides(lines, medium);
    look_from(both, {0.13, -0.21, 0.07}, {0.3, 1, -0.2});
    out.push_back({"eye inside, two strides", both});
  }
  Scene body = cloudy_scene(24, 100);
  body.body.emplace();
  body.body->radius = 0.6;
  body.body->color = {0.1F, 0.2F, 0.4F};
  out.push_back({"body", body});
  Scene curved = cloudy_scene(24, 100);
  displace(curved.lattice, [](const glm::dvec3& p) {
    return glm::dvec3(p.x + 0.2 * p.y * p.z, p.y, p.z + 0.3 * std::sin(2 * p.x));
  });
  out.push_back({"curved", curved});
  out.push_back({"globe", shell_around_body()});
  return out;
}

struct Errors {
  double kernel, slab;
};

// RMS errors of pictures by the engine, against slabs of an eighth of a cell.
Errors errors_of(Scene scene) {
  scene.method = scene::Method::kernel;
  const engine::Image kernels = render(scene, 2).image;
  scene.method = scene::Method::slab;
  scene.slab_thickness = 1;
  const engine::Image slabs = render(scene, 2).image;
  scene.slab_thickness = 0.125;
  const engine::Image truth = render(scene, 2).image;
  return {frame::difference_of(kernels.rgba, truth.rgba).rmse,
          frame::difference_of(slabs.rgba, truth.rgba).rmse};
}

TEST(PixelTrials, HaveTheErrorsOfPicturesOfUnusualViews) {
  for (auto& [name, scene] : unusual_scenes()) {
    const quality::Trials tried = frame::content_of(scene)->trials.value();
    const auto [kernel, slab] = errors_of(scene);
    EXPECT_GT(kernel, 1e-4) << name;
    EXPECT_LT(std::abs(std::log(tried.kernel / kernel)), std::log(2))
        << name << ' ' << tried.kernel << ' ' << kernel;
    if (slab < 1e-4) continue;
    EXPECT_LT(std::abs(std::log(tried.slab / slab)), std::log(2))
        << name << ' ' << tried.slab << ' ' << slab;
  }
}

// The eye within the outermost cells and just beyond them, looking outward: every sample is behind
// it, and its splats are before it.
TEST(PixelTrials, HaveTheErrorsOfKernelsWhoseSamplesAreBehindTheEye) {
  for (const double beyond : {-0.02, 0.02, 0.06}) {  // the last samples; cells are 1 / 6 wide
    for (const glm::dvec3& forward : {glm::dvec3(0.1, 0.05, 1), glm::dvec3(0.9, 0.2, 1)}) {
      Scene scene = cloudy_scene(12, 100);
      scene.vector.reset();
      const auto dense = [](int, double x, double y, double z) {
        return static_cast<float>(30 + 15 * std::sin(9 * x + z) + 15 * std::cos(8 * y));
      };
      scene.scalars[0].field = make_volume(scene.lattice, 1, dense);
      scene.scalars[0].color = ramp_color(0, 60, {0.9F, 0.2F, 0.1F}, {0.2F, 0.5F, 1.0F});
      look_from(scene, {0.13, -0.21, 1 - 1 / 12.0 + beyond}, forward);
      const auto tried = frame::content_of(scene)->trials;
      ASSERT_TRUE(tried) << beyond;
      const auto [kernel, slab] = errors_of(scene);
      EXPECT_GT(std::max(kernel, slab), 1e-4) << beyond;
      for (const auto& [of, error] : {std::pair{tried->kernel, kernel}, {tried->slab, slab}}) {
        if (error < 1e-4) continue;
        EXPECT_LT(std::abs(std::log(of / error)), std::log(2))
            << beyond << ' ' << forward.x << ' ' << of << ' ' << error;
      }
    }
  }
}

// Some thousand samples, evenly over the lattice.
std::vector<frame::RayThrough> some_samples_of(const Scene& scene) {
  const frame::DrawnSamples samples(scene);
  std::vector<frame::RayThrough> out;
  const std::int64_t step = std::max<std::int64_t>(1, samples.count() / 4096);
  for (std::int64_t n = step / 2; n < samples.count(); n += step) {
    const auto& dims = scene.lattice.dims;
    const auto at = static_cast<int>(n);
    out.push_back({{at % dims[0], at / dims[0] % dims[1], at / dims[0] / dims[1]},
                   static_cast<double>(step)});
  }
  return out;
}

void expect_bounded_work(const Scene& scene, const std::string& name) {
  const frame::PixelTrials tried = frame::pixel_trials(scene, some_samples_of(scene));
  EXPECT_LE(tried.places, frame::trial_places_most) << name;
  EXPECT_GT(tried.work, 0) << name;
  EXPECT_LE(tried.work, frame::trial_work_most + frame::place_work_most) << name;
}

// Kernels of long lines reach over hundreds of cells.
TEST(PixelTrials, TakeBoundedWorkForManyFaintLines) {
  constexpr int side = 160;
  constexpr double cell = 2.0 / side;
  Scene scene;
  scene.lattice = even_lattice({side, side, side}, {cell, cell, cell});
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 4, 1280, 720, true, 0.4);
  const auto wave = [](int c, double x, double y, double z) {
    return static_cast<float>(1 + std::sin(5 * x + c) + std::cos(4 * y - c) * std::sin(3 * z + 1));
  };
  scene.vector = plain_lines(make_volume(scene.lattice, 3, wave), {0.9F, 0.5F, 0.1F});
  scene.vector->opacity = 0.003;
  for (const double length : {0.02, 0.5}) {
    scene.vector->length = length;
    expect_bounded_work(scene, "faint lines");
  }
}

// A pixel is several cells wide and shows what its middle shows.
TEST(PixelTrials, HaveTheErrorsOfPicturesOfFewPixels) {
  ThreadPool pool(2);
  for (const auto& size : {std::pair{1, 1}, std::pair{2, 2}, std::pair{5, 3}}) {
    const int wide = size.first;
    const int high = size.second;
    Scene scene = cloudy_scene(24, 100);
    scene.vector.reset();  // lines are no thinner than a pixel and would cover the cloud
    scene.camera = look({0, 0, 0}, {0.3, 1, -0.2}, 3, wide, high, true, 0.6);
    const auto truth = engine::reference::render(scene, pool, {}, {1e-6}).value();
    const auto tried = frame::content_of(scene)->trials;
    ASSERT_TRUE(tried) << wide;
    const auto check = [&](double told) {
      const double error = frame::difference_of(render(scene, 2).image.rgba, truth.rgba).rmse;
      EXPECT_GT(error, 1e-5) << wide;
      EXPECT_LT(std::abs(std::log(told / error)), std::log(1.5)) << wide << ' ' << told / error;
    };
    check(tried->kernel);
    scene.method = scene::Method::slab;
    check(tried->slab);
  }
}

TEST(PixelTrials, TellNoErrorOfPicturesOfNothing) {
  Scene scene = cloudy_scene(12, 100);
  look_from(scene, {0, 0, 3}, {0, 0.1, 1});
  const auto tried = frame::content_of(scene)->trials;
  ASSERT_TRUE(tried);
  EXPECT_EQ(tried->kernel, 0);
  EXPECT_EQ(tried->slab, 0);
}

// It is not known what the samples of a curved lattice reach.
TEST(PixelTrials, DoNotTellErrorsWhereNoSampleIsSeenOfACurvedLattice) {
  Scene scene = cloudy_scene(12, 100);
  displace(scene.lattice, [](const glm::dvec3& p) { return p; });
  EXPECT_FALSE(frame::pixel_trials(scene, {}).trials);
}

TEST(PixelTrials, AreNotTriedOnceCancelled) {
  const Scene scene = cloudy_scene(24, 100);
  EXPECT_GT(frame::pixel_trials(scene, some_samples_of(scene)).places, 0);
  const CancelToken cancelled;
  cancelled.cancel();
  const frame::PixelTrials none = frame::pixel_trials(scene, some_samples_of(scene), cancelled);
  EXPECT_EQ(none.places, 0);
  EXPECT_FALSE(none.trials);
  EXPECT_FALSE(frame::content_of(scene, cancelled));
}

}  // namespace
}  // namespace windsplat::test
