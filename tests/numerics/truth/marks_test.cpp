// Marks of lines: areas in closed form, mirror symmetry, light and depth of halos, and every method
// compared with the brute-force integral.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "server/engine/kernels/dispatch.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::LineMark;
using scene::LineShape;
using scene::Method;
using scene::Scene;

constexpr std::array<LineShape, 4> shapes{LineShape::line, LineShape::taper, LineShape::arrow,
                                          LineShape::comet};
constexpr std::array<Method, 3> mark_methods{Method::kernel, Method::slab, Method::reference};

LineMark mark(LineShape shape, double halo) {
  LineMark out;
  out.shape = shape;
  out.halo = halo;
  out.tail_light = shape == LineShape::comet ? 0.2 : 1;
  if (shape == LineShape::arrow) {
    out.head_width = 12;
    out.head_length = 15;
  }
  return out;
}

std::shared_ptr<const data::Volume> wind(const scene::Lattice& lattice, float u, float v, float w) {
  return make_volume(lattice, 3,
                     [=](int c, double, double, double) { return c == 0 ? u : (c == 1 ? v : w); });
}

// One line of 40 pixels along x through the middle of 101 x 81 pixels, of half width 2 with a ramp
// of one pixel, whose sampled profile sums to its integral.
Scene one_line(const LineMark& of, float u = 10) {
  Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 101, 81, false, 81.0 / 40);
  scene.vector = plain_lines(wind(scene.lattice, u, 0, 0), {0.2F, 0.5F, 0.8F});
  scene.vector->magnitude_range = {0, 10};
  scene.vector->length = 2;
  scene.vector->r1 = 1.5;
  scene.vector->r2 = 2.5;
  scene.vector->opacity = 0.75;
  scene.vector->mark = of;
  return scene;
}

constexpr double half_width = 2;
constexpr double length_px = 40;
constexpr double tail_x = 30.5;  // pixel coordinate; the head is at 70.5

// The area of a disc with a ramp of one pixel at its edge.
double disc(double radius) {
  const double r1 = radius - 0.5;
  const double r2 = radius + 0.5;
  return pi * (r1 * r1 + r1 * r2 + r2 * r2) / 3;
}

// The sum of the opacity of a column or the picture, over that of the line.
double column_area(const engine::Image& image, int x) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) sum += static_cast<double>(pixel(image, x, y)[3]);
  return sum / 0.75;
}

double area(const engine::Image& image) {
  double sum = 0;
  for (int x = 0; x < image.width; ++x) sum += column_area(image, x);
  return sum;
}

Scene by(Scene scene, Method method) {
  scene.method = method;
  return scene;
}

TEST(Mark, TapersHaveTheirWidthAtEveryColumn) {
  for (const Method method : mark_methods) {
    for (const double halo : {0.0, 1.5}) {
      const engine::Image image = render(by(one_line(mark(LineShape::taper, halo)), method)).image;
      for (int x = 31; x < 70; ++x) {
        const double along = (x + 0.5 - tail_x) / length_px;
        const double half = 2 * half_width * (1 - along);
        EXPECT_NEAR(column_area(image, x), 2 * (half + halo), 1e-4) << x;
      }
    }
  }
}

TEST(Mark, EveryShapeCoversItsArea) {
  const auto covered = [](LineShape shape, double halo) {
    return area(render(one_line(mark(shape, halo))).image);
  };
  // Pixels sample a disc of this size with an error of some hundredths of its area.
  const double line = 2 * half_width * length_px + disc(half_width);
  EXPECT_NEAR(covered(LineShape::line, 0), line, 0.4);
  EXPECT_NEAR(covered(LineShape::comet, 0), line, 0.4);
  const double tapered = 2 * half_width * length_px + disc(2 * half_width) / 2;
  EXPECT_NEAR(covered(LineShape::taper, 0), tapered, 0.4);
  const double shaft = 2 * half_width * (length_px - 15) + disc(half_width) / 2;
  EXPECT_NEAR(covered(LineShape::arrow, 0), shaft + 0.5 * 12 * 15, 0.01 * (shaft + 90));
  EXPECT_NEAR(covered(LineShape::line, 3), 2 * (half_width + 3) * length_px + disc(half_width + 3),
              0.4);
}

// An arrow along an oblique direction covers the same area.
TEST(Mark, AreasDoNotDependOnTheDirection) {
  for (const LineShape shape : shapes) {
    Scene scene = one_line(mark(shape, 1));
    const double straight = area(render(scene).image);
    scene.vector->field = wind(scene.lattice, 8, 0, 6);
    EXPECT_NEAR(area(render(scene).image), straight, 0.01 * straight) << static_cast<int>(shape);
  }
}

TEST(Mark, ReversedVectorsMirrorThePicture) {
  for (const Method method : mark_methods) {
    for (const LineShape shape : shapes) {
      const engine::Image ahead = render(by(one_line(mark(shape, 2)), method)).image;
      const engine::Image back = render(by(one_line(mark(shape, 2), -10), method)).image;
      for (int y = 0; y < ahead.height; ++y) {
        for (int x = 0; x < ahead.width; ++x) {
          for (int c = 0; c < 4; ++c) {
            ASSERT_NEAR(pixel(ahead, x, y)[c], pixel(back, 100 - x, y)[c], 2e-5) << x << ' ' << y;
          }
        }
      }
    }
  }
}

TEST(Mark, BecomesADiscContinuouslyWhereALineIsSeenEndOn) {
  for (const LineShape shape : shapes) {
    Scene scene = one_line(mark(shape, 0));
    scene.vector->mark.tail_light = 1;
    scene.vector->field = wind(scene.lattice, 0, 10, 0);
    const double seen_end_on = area(render(scene).image);
    EXPECT_NEAR(seen_end_on, disc(half_width), 0.4) << static_cast<int>(shape);
    // Nearly end-on it is nearly the same: a hundredth of a pixel long.
    scene.vector->field = wind(scene.lattice, 0.0025F, 10, 0);
    EXPECT_NEAR(area(render(scene).image), seen_end_on, 0.1) << static_cast<int>(shape);
  }
}

TEST(Mark, TailsAreDarkAndKeepTheHue) {
  for (const Method method : mark_methods) {
    const engine::Image image = render(by(one_line(mark(LineShape::comet, 0)), method)).image;
    for (int x = 45; x < 70; ++x) {
      const float* at = pixel(image, x, 40);
      const double along = (x + 0.5 - tail_x) / length_px;
      const double light = 0.2 + 0.8 * along;
      EXPECT_NEAR(at[0], at[3] * 0.2 * light, 1e-5) << x;
      EXPECT_NEAR(at[2], at[3] * 0.8 * light, 1e-5) << x;
    }
  }
}

// A line along x before another along z, which lies `apart` behind it.
Scene crossing(double halo, double apart) {
  Scene scene;
  scene.lattice = even_lattice({1, 2, 1}, {2, apart, 2});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 101, 81, false, 81.0 / 40);
  const auto cross = make_volume(scene.lattice, 3, [](int c, double, double y, double) {
    return c == (y < 0 ? 0 : 2) ? 10.0F : 0.0F;
  });
  scene.vector = plain_lines(cross, {1.0F, 1.0F, 1.0F});
  scene.vector->magnitude_range = {0, 10};
  scene.vector->length = 2;
  scene.vector->r1 = 1.5;
  scene.vector->r2 = 2.5;
  scene.vector->opacity = 0.75;
  scene.vector->mark.halo = halo;
  return scene;
}

TEST(Mark, HalosDarkenOnlyWhatLiesBehind) {
  for (const Method method : mark_methods) {
    for (const double apart : {0.5, 1e-3}) {
      const engine::Image image = render(by(crossing(4, apart), method)).image;
      // The middle of the far line, beside the near one, within the halo of that.
      const float* beside = pixel(image, 50, 45);
      EXPECT_NEAR(beside[0], 0.25 * 0.75, 1e-5);
      EXPECT_NEAR(beside[3], 1 - 0.25 * 0.25, 1e-5);
      // The near line beside the far one: as if that had no halo.
      const float* near = pixel(image, 55, 40);
      EXPECT_NEAR(near[0], 0.75, 1e-5);
      EXPECT_NEAR(near[3], 1 - 0.25 * 0.25, 1e-5);
      // Beyond both halos, and where only that of the far line is.
      EXPECT_EQ(pixel(image, 65, 60)[3], 0.0F);
      EXPECT_EQ(pixel(image, 54, 60)[0], 0.0F);
      EXPECT_NEAR(pixel(image, 54, 60)[3], 0.75, 1e-5);
      // Where a line is, its halo adds nothing.
      EXPECT_NEAR(pixel(image, 50, 60)[3], 0.75, 1e-5);
    }
  }
}

// With `or`, halos hide no other line, whatever their depth.
TEST(Mark, HalosOfLinesCombinedByOrHideNoLine) {
  for (const Method method : mark_methods) {
    Scene scene = by(crossing(4, 0.5), method);
    scene.vector->combine_or = true;
    const engine::Image image = render(scene).image;
    EXPECT_NEAR(pixel(image, 50, 45)[0], 0.75, 1e-5);
    EXPECT_NEAR(pixel(image, 55, 40)[0], 0.75, 1e-5);
    EXPECT_NEAR(pixel(image, 55, 40)[3], 0.75, 1e-5);
  }
}

TEST(Mark, PicturesDoNotDependOnThreadsOrInstructions) {
  for (const LineShape shape : shapes) {
    Scene scene = cloudy_scene(8, 150);
    scene.vector->mark = mark(shape, 1);
    scene.vector->moving = shape == LineShape::arrow;
    for (const Method method : {Method::kernel, Method::slab}) {
      scene.method = method;
      const engine::Rendered one = render(scene);
      EXPECT_EQ(one.image.rgba, render(scene, 3).image.rgba);
      const auto portable = render_with(engine::kernels::portable_table(), scene);
      EXPECT_LT(largest_difference(one, portable), 2e-4F) << static_cast<int>(shape);
    }
  }
}

// Wider and longer than the random lines, so that pictures of ten pixels show every part of a mark.
Scene marked_scene(std::uint32_t seed) {
  Scene scene = random_scene(seed, false);
  if (!scene.vector) return scene;
  LineMark& to = scene.vector->mark;
  to.shape = shapes.at(seed % 4);
  to.halo = 0.3 * static_cast<double>(seed % 3);
  to.tail_light = seed % 2 == 0 ? 1 : 0.3;
  if (to.shape == LineShape::arrow) {
    to.head_width = 3;
    to.head_length = 2.5;
  }
  return scene;
}

class MarksJudged : public testing::TestWithParam<std::uint32_t> {};

TEST_P(MarksJudged, ReferenceEqualsTheTruth) {
  const Scene scene = marked_scene(GetParam());
  EXPECT_LT(truth::largest_error(reference_picture(scene), truth::integrate(scene)), 1e-5);
}

TEST_P(MarksJudged, SlabsOfLinesEqualTheTruth) {
  Scene scene = marked_scene(GetParam());
  if (!scene.vector) return;
  scene.scalars.clear();
  scene.stop_transmittance = 0;
  scene.method = Method::slab;
  // Positions of lines are rounded to 1e-5 pixels; see Judged.
  EXPECT_LT(truth::largest_error(render(scene).image.rgba, truth::integrate(scene)), 3e-4);
}

INSTANTIATE_TEST_SUITE_P(Seeds, MarksJudged, testing::Range(1U, 25U));

// Thinner slabs converge to the reference as they do without marks: by second order.
TEST(Mark, SlabsConvergeToTheReference) {
  for (const LineShape shape : shapes) {
    Scene scene = cloudy_scene(6, 48);
    scene.vector->mark = mark(shape, 1);
    scene.vector->mark.head_width /= 3;
    scene.vector->mark.head_length /= 3;
    scene.stop_transmittance = 0;
    scene.method = Method::slab;
    const auto exact = reference_picture(scene);
    const auto error = [&](double thickness) {
      scene.slab_thickness = thickness;
      const auto rgba = render(scene).image.rgba;
      double sum = 0;
      for (std::size_t i = 0; i < rgba.size(); ++i) {
        sum += std::pow(static_cast<double>(rgba[i]) - exact[i], 2);
      }
      return std::sqrt(sum / static_cast<double>(rgba.size()));
    };
    const double coarse = error(1);
    const double fine = error(0.25);
    EXPECT_LT(fine, 0.35 * coarse) << static_cast<int>(shape);
    EXPECT_LT(fine, 2e-3) << static_cast<int>(shape);
  }
}

}  // namespace
}  // namespace windsplat::test
