// The slab method: partial footprints, order in slab thickness, no popping during rotation, lines
// at their depth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/engine/kernels/frame_data.hpp"
#include "server/engine/partial.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Compositing;
using scene::Method;
using scene::Scene;

double rms(const engine::Image& a, const engine::Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    const double d = static_cast<double>(a.rgba[i]) - static_cast<double>(b.rgba[i]);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.rgba.size()));
}

// Two coloured blobs in a box of 20 x 18 x 14 samples; optical depth grows with `density`.
Scene blobs(double density, int size, double azimuth, bool perspective) {
  Scene scene;
  scene.lattice = even_lattice({20, 18, 14}, {0.07, 0.08, 0.09});
  const glm::dvec3 forward{std::sin(azimuth) * 0.8, std::cos(azimuth) * 0.8, -0.6};
  scene.camera = look({0, 0, 0}, forward, 3.0, size, size, perspective, perspective ? 0.3 : 0.9);
  const auto blob = [](double x, double y, double z) {
    return std::exp(-6 * (x * x + y * y + z * z));
  };
  for (const double side : {-1.0, 1.0}) {
    const auto field = make_volume(scene.lattice, 1, [&](int, double x, double y, double z) {
      return static_cast<float>(blob(x - 0.25 * side, y + 0.2 * side, z));
    });
    scene.scalars.push_back(medium(field, side < 0 ? std::array<float, 3>{1, 0.3F, 0.1F}
                                                   : std::array<float, 3>{0.1F, 0.4F, 1}));
    scene.scalars.back().extinction = {{0.05, 0}, {1, density}};
  }
  scene.stop_transmittance = 0;
  return scene;
}

TEST(PartialFootprint, RisesMonotonicallyFromZeroToAll) {
  const auto& table = engine::partial_footprints();
  constexpr int columns = engine::kernels::partial_columns - 1;
  constexpr auto one = static_cast<std::int32_t>(engine::kernels::partial_one);
  ASSERT_EQ(table.size(), static_cast<std::size_t>(engine::kernels::partial_rows) * columns);
  const auto here = [&](int r, int c) { return table[r * columns + c] & 0xffff; };
  const auto next = [&](int r, int c) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(table[r * columns + c]) >> 16U);
  };
  for (int r = 0; r < engine::kernels::partial_rows; ++r) {
    EXPECT_EQ(here(r, 0), 0);
    EXPECT_EQ(next(r, columns - 1), one);
    EXPECT_NEAR(here(r, columns / 2), 0.5 * one, 1);
    for (int c = 0; c < columns; ++c) EXPECT_GE(next(r, c), here(r, c));
    for (int c = 1; c < columns; ++c) EXPECT_EQ(next(r, c - 1), here(r, c));
  }
}

TEST(Slab, OneSplatAbsorbsLikeItsKernel) {
  for (const bool perspective : {false, true}) {
    Scene scene = blobs(3, 48, 0.4, perspective);
    scene.lattice = even_lattice({1, 1, 1}, {0.5, 0.3, 0.7});
    scene.scalars.resize(1);
    scene.scalars[0] =
        medium(make_volume(scene.lattice, 1, [](int, double, double, double) { return 3.0F; }),
               {0.2F, 0.5F, 1.0F});
    const engine::Rendered whole = render(scene);
    scene.method = Method::slab;
    for (const double thickness : {4.0, 1.0, 0.21}) {
      scene.slab_thickness = thickness;
      EXPECT_LT(rms(render(scene).image, whole.image), 1e-6) << thickness << perspective;
    }
  }
}

TEST(Slab, HalvingTheThicknessQuartersTheError) {
  for (const bool perspective : {false, true}) {
    Scene scene = blobs(6, 96, 0.4, perspective);
    scene.method = Method::slab;
    scene.slab_thickness = 0.0625;
    const engine::Rendered truth = render(scene);
    double last = 0;
    for (const double thickness : {2.0, 1.0, 0.5}) {
      scene.slab_thickness = thickness;
      const double error = rms(render(scene).image, truth.image);
      if (last > 0) {
        EXPECT_NEAR(std::log2(last / error), 2.0, 0.3);
      }
      last = error;
    }
  }
}

// Any stride beyond the samples of an axis leaves one cell along it, as wide as the box.
TEST(Slab, StridesBeyondTheBoxHaveSlabsOfItsSize) {
  for (const bool perspective : {false, true}) {
    Scene scene = blobs(4, 48, 0.4, perspective);
    scene.method = Method::slab;
    const auto picture = [&scene](int stride) {
      for (scene::ScalarLayer& scalar : scene.scalars) scalar.stride = stride;
      return render(scene).image.rgba;
    };
    EXPECT_EQ(picture(64), picture(20));
    EXPECT_NE(picture(64), picture(10));
  }
}

// Lines are in exact order for any slabs: when a brick spans hundreds of slabs, and when one slab
// contains all lines.
TEST(Slab, LinesDoNotDependOnTheThickness) {
  for (const bool perspective : {false, true}) {
    Scene scene = blobs(6, 64, 0.4, perspective);
    scene.scalars.clear();
    const auto winds = make_volume(scene.lattice, 3, [](int c, double x, double y, double z) {
      return static_cast<float>(std::sin(5 * x + 3 * y + 2 * c) + std::cos(7 * z - 2 * x + c));
    });
    scene.vector = plain_lines(winds, {1, 1, 1});
    scene.vector->length = 0.4;
    scene.vector->opacity = 0.6;
    scene.vector->color_by = scene::LineColor::world_z;
    scene.vector->color = ramp_color(0, 1, {1, 0, 0}, {0, 0.5F, 1});
    scene.method = Method::slab;
    scene.slab_thickness = 0.5;
    const engine::Rendered expected = render(scene);
    EXPECT_GT(rms(expected.image, engine::Image{64, 64, std::vector<float>(4UL * 64 * 64)}), 0.1);
    for (const double thickness : {0.1, 0.004}) {
      scene.slab_thickness = thickness;
      EXPECT_LT(rms(render(scene).image, expected.image), 1e-6) << thickness << perspective;
    }
  }
}

TEST(Slab, RotationByAMicroradianBarelyChangesAMedium) {
  for (const bool perspective : {false, true}) {
    for (int step = 0; step < 4; ++step) {
      const double azimuth = (2 * step + (perspective ? 1 : 0)) * 3.14159265358979 / 8;
      Scene scene = blobs(20, 256, azimuth, perspective);
      scene.method = Method::slab;
      const engine::Rendered before = render(scene, 2);
      scene.camera = blobs(20, 256, azimuth + 1e-6, perspective).camera;
      EXPECT_LE(rms(render(scene, 2).image, before.image), 1e-5) << azimuth;
    }
  }
}

}  // namespace
}  // namespace windsplat::test
