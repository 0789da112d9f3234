// The reference compared with closed forms: its kernel, its quadrature along one ray, and whole
// pictures.

#include "server/engine/reference/reference.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "server/engine/reference/kernels.hpp"
#include "tests/numerics/naive_renderer.hpp"
#include "tests/numerics/partial_footprint.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

namespace reference = engine::reference;

reference::Picture truth(const scene::Scene& scene, double tolerance = 1e-10,
                         unsigned threads = 1) {
  ThreadPool pool(threads);
  auto picture = reference::render(scene, pool, CancelToken(), {tolerance});
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(*picture);
}

const double* reference_pixel(const reference::Picture& picture, int x, int y) {
  return picture.rgba.data() + 4 * (static_cast<std::size_t>(y) * picture.width + x);
}

std::shared_ptr<const data::Volume> constant_scalar(const scene::Lattice& lattice, double value) {
  return make_volume(lattice, 1,
                     [=](int, double, double, double) { return static_cast<float>(value); });
}

struct Cut {
  double r = 0;      // distance of the ray from the centre of the splat, cells
  double cells = 0;  // per world unit along the ray
};

Cut cut_splat(const scene::Camera& camera, const glm::dvec3& centre, const glm::dvec3& cell, int x,
              int y) {
  const double size = 2 * camera.half_height / camera.height;
  const double right = (x + 0.5 - 0.5 * camera.width) * size;
  const double up = (0.5 * camera.height - (y + 0.5)) * size;
  glm::dvec3 ray = camera.forward;
  glm::dvec3 from = camera.eye;
  (camera.perspective ? ray : from) += right * camera.right + up * camera.up;
  ray = glm::normalize(ray);
  const glm::dvec3 d = ray / cell;
  const glm::dvec3 o = (centre - from) / cell;
  return {glm::length(glm::cross(o, d)) / glm::length(d), glm::length(d)};
}

TEST(Reference, OneSplatIsItsFootprintInAnisotropicCells) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {0.4, 0.7, 0.25});
  const glm::dvec3 cell{0.4, 0.7, 0.25};
  for (const double rho : {1e-30, 0.02, 3.0, 400.0}) {
    scene.scalars = {medium(constant_scalar(scene.lattice, rho), {1.0F, 0.5F, 0.25F})};
    const auto value = static_cast<double>(static_cast<float>(rho));
    for (const bool perspective : {false, true}) {
      scene.camera =
          look({0.1, 0.2, -0.1}, {0.4, 1, -0.6}, 4, 63, 51, perspective, perspective ? 0.3 : 1.2);
      const reference::Picture picture = truth(scene);
      for (int y = 0; y < 51; ++y) {
        for (int x = 0; x < 63; ++x) {
          const Cut cut = cut_splat(scene.camera, {0, 0, 0}, cell, x, y);
          const double tau = value * footprint(cut.r) / (footprint_integral * cut.cells);
          const double alpha = -std::expm1(-tau);
          ASSERT_NEAR(reference_pixel(picture, x, y)[3], alpha, std::min(1e-9, 0.05 * value))
              << x << " " << y;
          ASSERT_NEAR(reference_pixel(picture, x, y)[1], 0.5 * alpha, std::min(1e-9, 0.05 * value));
        }
      }
    }
  }
}

TEST(Reference, SplatsApartAreCompositedByOver) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 2, 1}, {1, 3, 1});  // their centres are 3 apart, and they are
                                                       // 1.37 * 3 wide
  scene.lattice.positions[1] = {-5, 5};
  const auto red = make_volume(scene.lattice, 1,
                               [](int, double, double y, double) { return y < 0 ? 1.0F : 0.0F; });
  const auto blue = make_volume(scene.lattice, 1,
                                [](int, double, double y, double) { return y < 0 ? 0.0F : 2.0F; });
  scene.scalars = {medium(red, {1.0F, 0.0F, 0.5F}), medium(blue, {0.0F, 0.25F, 1.0F})};
  for (const double side : {1.0, -1.0}) {
    scene.camera = look({0, 0, 0}, {0, side, 0}, 20, 21, 21, false, 1);
    const reference::Picture picture = truth(scene);
    for (int x = 0; x < 21; ++x) {
      const double g = footprint(std::abs(x - 10) * 2.0 / 21);
      const double first = -std::expm1(-(side > 0 ? 1 : 2) * g * 3 / footprint_integral);
      const double second = -std::expm1(-(side > 0 ? 2 : 1) * g * 3 / footprint_integral);
      const double red_part = side > 0 ? first : second * (1 - first);
      const double blue_part = side > 0 ? second * (1 - first) : first;
      EXPECT_NEAR(reference_pixel(picture, x, 10)[0], red_part, 1e-9) << x;
      EXPECT_NEAR(reference_pixel(picture, x, 10)[2], 0.5 * red_part + blue_part, 1e-9) << x;
      EXPECT_NEAR(reference_pixel(picture, x, 10)[3], red_part + blue_part, 1e-9) << x;
    }
  }
}

// A line through a splat: I = c_s A + a exp(-tf) (c_v - c_s), tf the part of tau in front of it, by
// the partial integral of the kernel.
TEST(Reference, LineInASplatSeesThePartOfTheSplatInFront) {
  for (const double rho : {0.01, 0.7, 3.0, 60.0}) {
    for (const float slope : {0.0F, 4.0F, -9.0F, 30.0F}) {
      scene::Scene scene;
      scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
      scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 81, 3, false, 3.0 / 40);
      const auto wind = make_volume(scene.lattice, 3, [=](int c, double, double, double) {
        return c == 0 ? 10.0F : (c == 1 ? slope : 0.0F);
      });
      scene.vector = plain_lines(wind, {0.2F, 0.5F, 0.8F});
      scene.vector->magnitude_range = {0, 10};
      scene.vector->length = 3;
      scene.vector->r1 = 2;
      scene.vector->r2 = 3;
      scene.vector->opacity = 0.75;
      scene.scalars = {medium(constant_scalar(scene.lattice, rho), {0.9F, 0.1F, 0.3F})};
      const reference::Picture picture = truth(scene);
      const double per_x = static_cast<double>(slope) / 10;  // depth of the line per width
      const double m = std::hypot(1.0, per_x);
      for (int x = 0; x < 81; ++x) {
        const double world = (x - 40) / 20.0;
        if (std::abs(world) > 1.4 / m) continue;  // its rounded ends
        const double r = std::abs(world) / 2;
        const auto value = static_cast<double>(static_cast<float>(rho));
        const double tau = value * footprint(r) * 2 / footprint_integral;
        const double tf = value * partial_footprint(r, world * per_x / 2) * 2 / footprint_integral;
        const double a = 0.75;
        const double alpha = -std::expm1(-tau) + a * std::exp(-tau);
        ASSERT_NEAR(reference_pixel(picture, x, 1)[3], alpha, 1e-9);
        for (int c = 0; c < 3; ++c) {
          const auto line = static_cast<double>(scene.vector->color.entries[0][c]);
          const auto cloud = static_cast<double>(scene.scalars[0].color.entries[0][c]);
          ASSERT_NEAR(reference_pixel(picture, x, 1)[c],
                      cloud * alpha + a * std::exp(-tf) * (line - cloud), 1e-8)
              << rho << " " << slope << " " << x;
        }
      }
    }
  }
}

TEST(Reference, RaysStartAtTheNearPlane) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {1, 1, 1});
  scene.scalars = {medium(constant_scalar(scene.lattice, 2), {1.0F, 1.0F, 1.0F})};
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 0.5, 1, 1, true, 0.1);
  for (const double near : {1e-3, 0.2, 0.45, 0.51, 0.8, 1.5}) {
    scene.camera.near = near;  // the centre of the splat is 0.5 away, its end 1.87
    const double tau = 2 * (footprint(0) - partial_footprint(0, near - 0.5)) / footprint_integral;
    EXPECT_NEAR(truth(scene).rgba[3], -std::expm1(-tau), 1e-9) << near;
  }
  scene.camera.near = 1.88;
  EXPECT_EQ(truth(scene).rgba[3], 0);
}

TEST(Reference, UniformLatticeAbsorbsWithinTheFootprintsRipple) {
  scene::Scene scene;
  scene.lattice = even_lattice({24, 24, 9}, {1, 1, 1});
  scene.scalars = {medium(constant_scalar(scene.lattice, 0.1), {1.0F, 1.0F, 1.0F})};
  for (const auto& [forward, ripple] :
       {std::pair{glm::dvec3(0, 0, -1), 0.0075}, {glm::dvec3(0.31, 0.17, -1), 0.01}}) {
    scene.camera = look({0, 0, 0}, forward, 100, 24, 24, false, 2);
    const reference::Picture picture = truth(scene);
    const double tau = 0.1 * 9 / std::abs(scene.camera.forward.z);
    double mean = 0;
    for (int i = 0; i < 24 * 24; ++i) {
      const double seen = -std::log1p(-picture.rgba[4 * i + 3]) / tau;
      EXPECT_NEAR(seen, 1, ripple);
      mean += seen / (24 * 24);
    }
    EXPECT_NEAR(mean, 1, 0.002);
  }
}

// Lines alone, whose order is unambiguous, and a medium of one colour, whose optical depths add in
// any order, equal the naive renderer.
TEST(Reference, EqualsTheNaiveRendererWhereThatIsExact) {
  scene::Scene scene;
  scene.lattice = make_lattice({{{0.1, 0.12, 0.09, 0.1, 0.3}, {0.1, 0.1, 0.12, 0.1}, {0.2, 0.15}}});
  const auto wave = [](int c, double x, double y, double z) {
    return static_cast<float>(std::sin(5 * x + c) + std::cos(4 * y - c) * std::sin(3 * z + 1));
  };
  const auto cloud = make_volume(scene.lattice, 1, wave);
  for (const int stride : {1, 2}) {
    for (const bool perspective : {false, true}) {
      scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 2, 60, 50, perspective, 0.3);
      scene.vector.reset();
      scene.scalars = {medium(cloud, {0.5F, 0.6F, 0.9F}), medium(cloud, {0.5F, 0.6F, 0.9F})};
      scene.scalars[1].stride = stride;
      const auto mixed = naive::render<double>(scene);
      const reference::Picture picture = truth(scene);
      for (std::size_t i = 0; i < mixed.rgba.size(); ++i) {
        ASSERT_NEAR(picture.rgba[i], mixed.rgba[i], 1e-9);
      }
      scene.scalars.clear();
      scene.vector = plain_lines(make_volume(scene.lattice, 3, wave), {0.9F, 0.5F, 0.1F});
      scene.vector->length = 0.08;
      scene.vector->stride = stride;
      scene.vector->head_desaturation = 0.5;
      scene.vector->jitter_center = 0.5;
      scene.vector->jitter_stride = 0.3;
      scene.vector->r1 = 0.2;
      scene.vector->r2 = 0.4;
      const auto drawn = naive::render<double>(scene);
      const reference::Picture lines = truth(scene);
      double brightest = 0;
      double alpha = 0;
      for (std::size_t i = 0; i < drawn.rgba.size(); ++i) {
        // Where lines of neighbouring cells cross, only opacity is independent of their order.
        if (i % 4 == 3) alpha = std::max(alpha, std::abs(lines.rgba[i] - drawn.rgba[i]));
        brightest = std::max(brightest, drawn.rgba[i]);
      }
      EXPECT_LT(alpha, 1e-12);
      EXPECT_GT(brightest, 0.1);
    }
  }
}

// A rotated lattice seen by an eye rotated with it.
TEST(Reference, RotatedPositionsAndEyeGiveTheSamePicture) {
  scene::Scene scene = cloudy_scene(4, 24);
  scene.lattice = even_lattice({4, 3, 1}, {0.3, 0.4, 0.5});
  const auto wave = [](int c, double x, double y, double) {
    return static_cast<float>(1 + std::sin(5 * x + c) * std::cos(4 * y - c));
  };
  scene.vector->field = make_volume(scene.lattice, 3, wave);
  scene.vector->span = 1.5;
  scene.vector->jitter_stride = 0.3;
  scene.scalars[0].field = make_volume(scene.lattice, 1, wave);
  for (const bool perspective : {false, true}) {
    scene.lattice.places.reset();
    scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 3, 24, 24, perspective, perspective ? 0.3 : 0.8);
    const reference::Picture straight = truth(scene);
    const auto turn = [](const glm::dvec3& v) {
      return glm::dvec3(0.8 * v.x - 0.6 * v.y, 0.6 * v.x + 0.8 * v.y, v.z);
    };
    std::vector<std::array<float, 3>> places;
    for (const double y : scene.lattice.positions[1]) {
      for (const double x : scene.lattice.positions[0]) {
        const glm::dvec3 p = turn({x, y, scene.lattice.positions[2][0]});
        places.push_back(
            {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
      }
    }
    scene.lattice.places =
        std::make_shared<const std::vector<std::array<float, 3>>>(std::move(places));
    scene.camera.eye = turn(scene.camera.eye);
    scene.camera.right = turn(scene.camera.right);
    scene.camera.up = turn(scene.camera.up);
    scene.camera.forward = turn(scene.camera.forward);
    const reference::Picture turned = truth(scene);
    for (std::size_t i = 0; i < straight.rgba.size(); ++i) {
      ASSERT_NEAR(straight.rgba[i], turned.rgba[i], 1e-5);  // positions are floats
    }
    EXPECT_GT(straight.rgba[4 * (12 * 24 + 12) + 3], 0.3);
  }
}

TEST(Reference, SliceRendersTheMediumOfItsLayerOnly) {
  scene::Scene scene = cloudy_scene(5, 24);
  scene.vector.reset();
  scene.slice = scene::Slice{2, 3};
  const reference::Picture slice = truth(scene);
  scene.slice.reset();
  auto masked = std::make_shared<data::Volume>(*scene.scalars[0].field);
  for (std::size_t i = 0; i < masked->values.size(); ++i) {
    if (i / 25 != 3) masked->values[i] = std::numeric_limits<float>::quiet_NaN();
  }
  scene.scalars[0].field = masked;
  const reference::Picture rest = truth(scene);
  double brightest = 0;
  for (std::size_t i = 0; i < slice.rgba.size(); ++i) {
    ASSERT_NEAR(slice.rgba[i], rest.rgba[i], 1e-12);
    brightest = std::max(brightest, slice.rgba[i]);
  }
  EXPECT_GT(brightest, 0.1);
}

TEST(Reference, SliceDropsTheNormalComponentAndKeepsTheRest) {
  scene::Scene scene;
  scene.lattice = even_lattice({2, 2, 3}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 10, 10, false, 2);
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [](int c, double, double, double) {
                                           return c == 0 ? 6.0F : (c == 2 ? 8.0F : 0);
                                         }),
                             {1.0F, 1.0F, 1.0F});
  scene.vector->magnitude_range = {0, 10};
  scene.vector->length = 0.5;
  scene.slice = scene::Slice{2, 1};
  const auto kernels = reference::list_kernels(scene, reference::make_view(scene.camera));
  ASSERT_EQ(kernels.ribbons.size(), 4U);
  for (const reference::Ribbon& line : kernels.ribbons) {
    EXPECT_NEAR(line.b[0] - line.a[0], 0.3, 1e-12);
    EXPECT_NEAR(line.b[1] - line.a[1], 0, 1e-12);
  }
}

TEST(Reference, AnyThreadCountGivesTheSameBits) {
  const scene::Scene scene = cloudy_scene(8, 33);
  const reference::Picture one = truth(scene, 1e-10, 1);
  const reference::Picture three = truth(scene, 1e-10, 3);
  EXPECT_EQ(one.rgba, three.rgba);
  EXPECT_EQ(one.pieces, three.pieces);
  EXPECT_EQ(one.evaluations, three.evaluations);
  EXPECT_GT(one.evaluations, one.pieces);
}

TEST(Reference, ReportsProgressAndStopsWhenCancelled) {
  const scene::Scene scene = cloudy_scene(6, 20);
  ThreadPool pool(2);
  const CancelToken cancel;
  std::atomic<int> rows{0};
  ASSERT_TRUE(reference::render(scene, pool, cancel, {}, [&](int) { ++rows; }));
  EXPECT_EQ(rows, 20);
  const auto cut = reference::render(scene, pool, cancel, {}, [&](int done) {
    if (done == 5) cancel.cancel();
  });
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().kind, ErrorKind::cancelled);
}

TEST(Reference, ErrorFallsWithItsTolerance) {
  const scene::Scene scene = cloudy_scene(10, 24);
  const reference::Picture exact = truth(scene, 1e-14);
  double before = 1;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const reference::Picture picture = truth(scene, tolerance);
    double worst = 0;
    for (std::size_t i = 0; i < exact.rgba.size(); ++i) {
      worst = std::max(worst, std::abs(picture.rgba[i] - exact.rgba[i]));
    }
    RecordProperty("error_at_" + std::to_string(tolerance), std::to_string(worst * 1e12));
    EXPECT_LE(worst, tolerance);
    EXPECT_LE(worst, before);
    before = worst;
  }
}

}  // namespace
}  // namespace windsplat::test
