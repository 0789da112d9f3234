// Cells of extreme proportions, up to those that scene::place_lattice accepts with strides of 64.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

constexpr double aspect_max = 64e7;

// Opacities of media with an optical depth near one, by every method.
void expect_opacities(Scene scene, const glm::dvec3& cell, double tolerance = 2e-6) {
  const glm::dvec3 d = scene.camera.forward / cell;
  const double rho = glm::length(d);
  scene.scalars = {medium(make_volume(scene.lattice, 1,
                                      [&](int, double x, double y, double z) {
                                        const double at = x / cell.x + 2 * y / cell.y - z / cell.z;
                                        return static_cast<float>(rho * (0.9 + 0.2 * at));
                                      }),
                          {1.0F, 0.5F, 0.25F})};
  scene.stop_transmittance = 0;
  const auto light = truth::integrate(scene);
  const auto reference = reference_picture(scene);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    const engine::Image image = render(scene).image;
    for (std::size_t i = 0; i < light.size(); ++i) {
      ASSERT_NEAR(reference[4 * i + 3], light[i].alpha, 1e-6);
      ASSERT_NEAR(image.rgba[4 * i + 3], light[i].alpha, tolerance)
          << cell.x << ' ' << cell.y << ' ' << cell.z << " method " << static_cast<int>(method);
    }
  }
}

TEST(Aspect, MediaOfFlatCellsEqualTheTruth) {
  for (const double aspect : {1e3, 1e6, 1e7, aspect_max}) {
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 cell{2.0 / 3, 2.0 / 3, 2.0 / 3};
      cell[axis] /= aspect;
      Scene scene;
      scene.lattice = even_lattice({3, 3, 3}, {cell.x, cell.y, cell.z});
      for (const glm::dvec3& forward : {glm::dvec3{0.3, 1, -0.4}, {0.8, -0.5, 0.6}}) {
        for (const double pixel : {1.0, 0.1}) {
          scene.camera = look({0, 0, 0}, forward, 4, 12, 10, true, 0.25 * pixel);
          expect_opacities(scene, cell);
          scene.camera = look({0, 0, 0}, forward, 4, 12, 10, false, pixel);
          expect_opacities(scene, cell);
        }
      }
    }
  }
}

// Thinner than a pixel in two directions, a medium seen from the side covers no pixel centre. Along
// the third axis it is seen magnified: kernels are placed to 1e-5 pixels.
TEST(Aspect, MediaOfNeedlesEqualTheTruth) {
  for (const double aspect : {1e3, 1e6, 1e7, aspect_max}) {
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 cell{2.0 / 3 / aspect, 2.0 / 3 / aspect, 2.0 / 3 / aspect};
      cell[axis] = 2.0 / 3;
      glm::dvec3 along{0, 0, 0};
      along[axis] = 1;
      Scene scene;
      scene.lattice = even_lattice({3, 3, 3}, {cell.x, cell.y, cell.z});
      for (const bool perspective : {false, true}) {
        scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 4, 12, 10, perspective, 0.25);
        expect_opacities(scene, cell, 1e-3);
        scene.camera = look({0, 0, 0}, along, 4, 12, 10, perspective, 1 / aspect);
        expect_opacities(scene, cell);
      }
    }
  }
}

TEST(Aspect, LinesInCellsOfAnyProportionEqualTheTruth) {
  for (const double aspect : {1e3, 1e7, aspect_max}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool flat : {false, true}) {
        std::array<double, 3> cell{};
        for (int a = 0; a < 3; ++a) cell[a] = 2.0 / 3 / ((a == axis) == flat ? aspect : 1);
        Scene scene;
        scene.lattice = even_lattice({3, 3, 3}, cell);
        scene.vector =
            plain_lines(make_volume(scene.lattice, 3,
                                    [](int c, double, double, double) { return 0.3F + 0.3F * c; }),
                        {1.0F, 0.5F, 0.2F});
        scene.vector->length = 0.5;
        scene.vector->span = 7;
        scene.vector->jitter_center = scene.vector->jitter_stride = 0.5;
        scene.vector->r1 = 1;
        scene.vector->r2 = 2;
        scene.stop_transmittance = 0;
        scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 4, 12, 10, true, 0.25);
        const auto light = truth::integrate(scene);
        EXPECT_LT(truth::largest_error(reference_picture(scene), light), 1e-6);
        scene.method = Method::slab;
        EXPECT_LT(truth::largest_error(render(scene).image.rgba, light), 1e-4);
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::test
