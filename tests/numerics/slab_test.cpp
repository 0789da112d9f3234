// The slab method: partial footprints, order in slab thickness, no popping during rotation, lines
// at their depth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/kernels/frame_data.hpp"
#include "tests/numerics/partial_footprint.hpp"
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

// F at a distance b of the ray from the centre, v of half a chord from its middle.
float partial_of(const engine::kernels::Table& table, double b, double v) {
  const auto r2 = static_cast<float>(b * b);
  const auto at = static_cast<float>(v);
  float before = -1;
  table.partial(1, &r2, &at, &before);
  return before;
}

TEST(PartialFootprint, IsTheIntegralOfTheKernel) {
  for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
    for (const double b : {0.0, 0.1, 0.25, 0.4, 0.479, 0.481, 0.6, 0.8, 1.0, 1.2, 1.3}) {
      const double half_chord = std::sqrt(1.37 * 1.37 - b * b);
      const double whole = partial_footprint(b, 9);
      for (double v = -0.95; v < 1; v += 0.1) {
        EXPECT_NEAR(partial_of(*table, b, v), partial_footprint(b, v * half_chord) / whole, 9e-4)
            << table->name << b << v;
      }
    }
  }
}

TEST(PartialFootprint, RisesFromZeroToAll) {
  for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
    for (double b = 0; b < 1.37; b += 0.01) {
      EXPECT_EQ(partial_of(*table, b, -1), 0) << table->name << b;
      EXPECT_EQ(partial_of(*table, b, 1), 1) << table->name << b;
      float last = 0;
      for (double v = -1; v <= 1; v += 0.01) {
        const float here = partial_of(*table, b, v);
        EXPECT_GT(here, last - 2e-7F) << table->name << b << v;
        last = here;
      }
    }
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

// Slabs below and above the thickness from which partial footprints are coarse.
TEST(Slab, CoarsePartialFootprintsDoNotAddToTheError) {
  for (const bool perspective : {false, true}) {
    Scene scene = blobs(6, 96, 0.4, perspective);
    scene.method = Method::slab;
    scene.slab_thickness = 0.0625;
    const engine::Rendered truth = render(scene);
    const auto error_at = [&](double thickness) {
      scene.slab_thickness = thickness;
      return rms(render(scene).image, truth.image);
    };
    // The order between two fine thicknesses continues to a coarse one.
    const double fine = error_at(0.66);
    const double order = std::log(fine / error_at(0.57)) / std::log(0.66 / 0.57);
    EXPECT_LT(error_at(0.76), 1.03 * fine * std::pow(0.76 / 0.66, order));
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

// Long lines along the view, of which many meet a block within one slab.
TEST(Slab, ManyLongLinesInASlabAreInOrder) {
  for (const bool perspective : {false, true}) {
    Scene scene = blobs(6, 48, 0, perspective);
    scene.scalars.clear();
    const glm::dvec3 along = scene.camera.forward;
    const auto winds = make_volume(scene.lattice, 3, [&](int c, double x, double y, double z) {
      return static_cast<float>(along[c] + 0.3 * std::sin(9 * x + 5 * y + 7 * z + 2 * c));
    });
    scene.vector = plain_lines(winds, {1, 1, 1});
    scene.vector->length = 0.8;
    scene.vector->span = 20;
    scene.vector->opacity = 0.1;
    scene.vector->color_by = scene::LineColor::world_z;
    scene.vector->color = ramp_color(-0.6, 0.6, {1, 0, 0}, {0, 0.5F, 1});
    scene.method = Method::slab;
    scene.slab_thickness = 0.02;
    const engine::Rendered expected = render(scene);
    scene.slab_thickness = 4;
    EXPECT_LT(rms(render(scene).image, expected.image), 2e-6) << perspective;
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
