// The work report, cancellation, and empty or small scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Eight by eight by four visible samples; the wind grows with x, the cloud with y.
scene::Scene counted_scene() {
  scene::Scene scene;
  scene.lattice = even_lattice({8, 8, 4}, {0.2, 0.2, 0.2});
  scene.camera = look({0, 0, 0}, {0.2, 1, -0.3}, 5, 70, 50, true, 0.4);
  const auto wind = make_volume(scene.lattice, 3, [](int c, double x, double, double) {
    return c == 0 ? static_cast<float>(std::lround((x + 0.7) / 0.2)) : 0.0F;
  });
  const auto cloud = make_volume(scene.lattice, 1, [](int, double, double y, double) {
    const auto j = std::lround((y + 0.7) / 0.2);
    return j == 7 ? nan : static_cast<float>(j);
  });
  scene.vector = plain_lines(wind, {1.0F, 1.0F, 1.0F});
  scene.vector->min_magnitude = 2.5;
  scene.vector->magnitude_range = {0, 8};
  scene.scalars.push_back(medium(cloud, {1.0F, 1.0F, 1.0F}));
  return scene;
}

TEST(Work, CountsWorkOmittedByTolerance) {
  const scene::Scene scene = counted_scene();
  const engine::WorkReport work = render(scene).work;
  EXPECT_EQ(work.samples, 8 * 8 * 4);
  EXPECT_EQ(work.culled, 0);
  EXPECT_EQ(work.skipped_vector, 3 * 8 * 4);  // magnitudes 0, 1, 2
  EXPECT_EQ(work.skipped_scalar, 2 * 8 * 4);  // extinction 0 and the masked row
  EXPECT_EQ(work.skipped_both, 3 * 2 * 4);
  EXPECT_GT(work.pixel_updates, 0);
  EXPECT_GT(work.exponentials, 0);
}

TEST(Work, OpticalDepthToleranceCoversAllViewDirections) {
  scene::Scene scene = counted_scene();
  scene.vector.reset();
  // rho h / C with h = 0.2: below 3.5 for rho = 0, 1, 2, 3.
  scene.scalars[0].min_optical_depth = 3.5 * 0.2 / 1.4476982547;
  const engine::WorkReport work = render(scene).work;
  EXPECT_EQ(work.skipped_scalar, 5 * 8 * 4);
  EXPECT_EQ(work.skipped_both, 5 * 8 * 4);
  EXPECT_EQ(work.skipped_vector, 0);
}

TEST(Work, SamplesOutsideThePictureAreCulled) {
  scene::Scene scene = counted_scene();
  scene.camera = look({0, 0, 0}, {0, -1, 0}, -5, 70, 50, true, 0.4);  // looks away from the volume
  const engine::Rendered away = render(scene);
  EXPECT_EQ(away.work.culled, 8 * 8 * 4);
  EXPECT_EQ(away.work.pixel_updates, 0);
  EXPECT_EQ(away.work.tiles, 0);
}

TEST(Work, WithoutAMediumThereIsNoExponential) {
  scene::Scene scene = counted_scene();
  scene.scalars.clear();
  const engine::WorkReport work = render(scene).work;
  EXPECT_EQ(work.exponentials, 0);
  EXPECT_GT(work.pixel_updates, 0);
  EXPECT_EQ(work.skipped_both, work.skipped_vector);
}

TEST(Work, EmptySceneTouchesNoPixel) {
  scene::Scene scene = counted_scene();
  scene.scalars.clear();
  scene.vector.reset();
  const engine::Rendered nothing = render(scene);
  EXPECT_EQ(nothing.work.pixel_updates, 0);
  EXPECT_EQ(nothing.work.tiles, 0);
  EXPECT_EQ(nothing.image.rgba, std::vector<float>(4UL * 70 * 50, 0.0F));
}

TEST(Work, OpaqueTilesTerminateEarlyAndLookTheSame) {
  scene::Scene scene;
  scene.lattice = even_lattice({24, 60, 24}, {0.08, 0.03, 0.08});
  const auto fog = make_volume(scene.lattice, 1, [](int, double, double, double) { return 60.0F; });
  scene.scalars.push_back(medium(fog, {0.7F, 0.8F, 0.9F}));
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 4, 128, 128, false, 0.5);
  const engine::Rendered stopped = render(scene);
  scene.stop_transmittance = 0;
  const engine::Rendered full = render(scene);
  EXPECT_GT(stopped.work.tiles_stopped, 0);
  EXPECT_GT(stopped.work.occluded, 0);
  EXPECT_LT(stopped.work.pixel_updates, full.work.pixel_updates);
  for (std::size_t i = 0; i < full.image.rgba.size(); ++i) {
    ASSERT_NEAR(stopped.image.rgba[i], full.image.rgba[i], 1.6e-4);
  }
}

TEST(Cancel, BeforeAndDuringAFrame) {
  // Enough work that a thread that wakes up late still cancels before the end.
  scene::Scene scene;
  scene.lattice = even_lattice({80, 80, 80}, {0.024, 0.024, 0.024});
  const auto wind = make_volume(scene.lattice, 3, [](int, double, double, double) { return 1.0F; });
  scene.vector = plain_lines(wind, {1.0F, 0.5F, 0.2F});
  scene.vector->length = 0.1;
  const auto fog = make_volume(scene.lattice, 1, [](int, double, double, double) { return 0.01F; });
  scene.scalars.push_back(medium(fog, {1.0F, 1.0F, 1.0F}));
  scene.camera = look({0, 0, 0}, {0.5, 1, -0.3}, 3, 1200, 1200, true, 0.35);
  ThreadPool pool(2);
  const CancelToken before;
  before.cancel();
  const auto refused = engine::render(scene, pool, before);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::cancelled);

  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  ASSERT_TRUE(engine::render(scene, pool, CancelToken()));
  const std::chrono::duration<double> whole = Clock::now() - start;

  const CancelToken during;
  std::thread canceller([&] {
    std::this_thread::sleep_for(0.2 * whole);
    during.cancel();
  });
  const auto begin = Clock::now();
  const auto cut_short = engine::render(scene, pool, during);
  const auto part = Clock::now() - begin;
  canceller.join();
  ASSERT_FALSE(cut_short);
  EXPECT_EQ(cut_short.error().kind, ErrorKind::cancelled);
  EXPECT_LT(part / whole, 0.75) << "cancelled at a fifth of its time, yet rendering continued";
}

bool all_finite(const engine::Image& image) {
  for (const float v : image.rgba) {
    if (!std::isfinite(v)) return false;
  }
  return true;
}

scene::Scene both(const scene::Lattice& lattice, float wind, float rho) {
  scene::Scene scene;
  scene.lattice = lattice;
  const auto w = make_volume(lattice, 3, [=](int, double, double, double) { return wind; });
  const auto s = make_volume(lattice, 1, [=](int, double, double, double) { return rho; });
  scene.vector = plain_lines(w, {1.0F, 0.5F, 0.2F});
  scene.vector->jitter_center = 0.5;
  scene.vector->head_desaturation = 0.5;
  scene.vector->length = 0.3;
  scene.scalars.push_back(medium(s, {0.2F, 0.5F, 1.0F}));
  return scene;
}

// Tiles are delivered once, at even pixels, with the bits of the image; blank tiles are omitted.
TEST(Tiles, AreDeliveredOnceAndFormTheImage) {
  for (const auto& [width, height] : {std::pair{1, 1}, {67, 65}, {300, 201}}) {
    for (const auto method : {scene::Method::kernel, scene::Method::slab}) {
      scene::Scene scene = both(even_lattice({9, 9, 9}, {0.1, 0.1, 0.1}), 0.7F, 2.0F);
      scene.method = method;
      scene.camera = look({0.3, 0, 0.2}, {0.3, 1, -0.4}, 3, width, height, true, 0.5);
      const engine::Image whole = render(scene, 2).image;
      std::vector<float> pieces(whole.rgba.size());
      std::vector<int> times(pieces.size() / 4);
      ThreadPool pool(2);
      engine::RenderSpace space;
      const auto work = engine::render(
          scene, pool, CancelToken(), space, [&, width = width](const engine::TilePixels& tile) {
            EXPECT_TRUE(tile.x % 2 == 0 && tile.y % 2 == 0);
            for (int row = 0; row < tile.height; ++row) {
              const std::size_t at = static_cast<std::size_t>(tile.y + row) * width + tile.x;
              std::copy_n(tile.rgba + row * tile.stride, 4 * tile.width, &pieces[4 * at]);
              for (int column = 0; column < tile.width; ++column) ++times[at + column];
            }
          });
      ASSERT_TRUE(work);
      EXPECT_EQ(pieces, whole.rgba);
      EXPECT_EQ(*std::max_element(times.begin(), times.end()), 1);
      EXPECT_GT(work->tiles, 0);
      scene.camera = look({90, 0, 0}, {0.3, 1, -0.4}, 3, width, height, true, 0.5);
      const auto nothing = engine::render(scene, pool, CancelToken(), space,
                                          [](const engine::TilePixels&) { ADD_FAILURE(); });
      ASSERT_TRUE(nothing);
    }
  }
}

TEST(Extremes, ThinLatticesOnePixelAndMaskedFields) {
  for (const auto& dims : {std::array<int, 3>{1, 1, 1}, {9, 1, 1}, {1, 9, 7}, {9, 8, 1}}) {
    scene::Scene scene = both(even_lattice(dims, {0.2, 0.2, 0.2}), 0.7F, 2.0F);
    for (const bool perspective : {false, true}) {
      scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 3, 1, 1, perspective, 0.3);
      EXPECT_TRUE(all_finite(render(scene).image));
      EXPECT_GT(pixel(render(scene).image, 0, 0)[3], 0.01F);
    }
  }
  scene::Scene masked = both(even_lattice({5, 5, 5}, {0.2, 0.2, 0.2}), nan, nan);
  masked.camera = look({0, 0, 0}, {0, 1, 0}, 3, 33, 33, true, 0.3);
  const engine::Rendered nothing = render(masked);
  EXPECT_EQ(nothing.work.pixel_updates, 0);
  EXPECT_EQ(nothing.work.skipped_both, 125);
  scene::Scene zero = both(even_lattice({5, 5, 5}, {0.2, 0.2, 0.2}), 0.0F, 0.0F);
  zero.camera = masked.camera;
  EXPECT_EQ(render(zero).work.skipped_both, 125);
}

TEST(Extremes, FieldsOfViewAndSpacings) {
  constexpr double half_degree = 3.14159265358979323846 / 360;
  for (const double fov : {1e-3, 1.0, 90.0, 179.0}) {
    scene::Scene scene = both(even_lattice({12, 12, 5}, {0.15, 0.15, 0.1}), 0.7F, 2.0F);
    const double tangent = std::tan(fov * half_degree);
    scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 1 / tangent, 64, 48, true, tangent);
    const engine::Image image = render(scene).image;
    EXPECT_TRUE(all_finite(image)) << fov;
    EXPECT_GT(pixel(image, 32, 24)[3], 0.1F) << fov;
  }
  for (const auto& spacing : {std::array<double, 3>{1e-6, 1, 1}, {1, 1e-6, 1}, {0.2, 0.2, 2e-7}}) {
    scene::Scene scene = both(even_lattice({5, 5, 5}, spacing), 0.7F, 2.0F);
    for (const bool perspective : {false, true}) {
      for (const double distance : {5.0, 0.0}) {
        scene.camera = look({0.01, 0.02, 0.03}, {0.3, 1, -0.4}, distance, 64, 48, perspective, 1);
        const engine::Rendered rendered = render(scene);
        EXPECT_TRUE(all_finite(rendered.image)) << spacing[0] << " " << distance;
      }
    }
  }
}

TEST(Extremes, EyeInsideTheVolumeHasBoundedWork) {
  scene::Scene scene = both(even_lattice({64, 64, 64}, {0.03, 0.03, 0.03}), 0.7F, 5.0F);
  scene.stop_transmittance = 0;
  scene.camera = look({0.013, 0.004, 0.009}, {0.3, 1, -0.4}, 0, 160, 120, true, 1);
  const engine::Rendered rendered = render(scene);
  EXPECT_TRUE(all_finite(rendered.image));
  EXPECT_GT(pixel(rendered.image, 80, 60)[3], 0.8F);
  // The few kernels around the eye may cover the screen; a kernel beside it must not.
  EXPECT_LT(rendered.work.pixel_updates, 100L * 160 * 120 + 64L * 64 * 64 * 150);
}

TEST(Extremes, StrideThatDoesNotDivideAnAxisOmitsNothing) {
  scene::Scene scene = both(even_lattice({30, 30, 3}, {0.06, 0.06, 0.06}), 0.7F, 2.0F);
  scene.vector->stride = scene.scalars[0].stride = 9;
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 3, 40, 30, true, 0.3);
  const engine::Rendered rendered = render(scene);
  EXPECT_EQ(rendered.work.samples, 4 * 4 * 1);  // strides of 9, 9, 9 and 3 samples; along z all 3
  EXPECT_TRUE(all_finite(rendered.image));
}

}  // namespace
}  // namespace windsplat::test
