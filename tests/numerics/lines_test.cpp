// Lines: their profile, length and head, and one line inside its cell of the medium.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

std::shared_ptr<const data::Volume> wind(const scene::Lattice& lattice, float u, float v, float w) {
  return make_volume(lattice, 3,
                     [=](int c, double, double, double) { return c == 0 ? u : (c == 1 ? v : w); });
}

// One line in the middle of 81 x 81 pixels, 20 pixels per world unit, seen from the south.
scene::Scene one_line(float u, float v, float w) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 81, 81, false, 81.0 / 40);
  scene.vector = plain_lines(wind(scene.lattice, u, v, w), {0.2F, 0.5F, 0.8F});
  scene.vector->magnitude_range = {0, 10};
  scene.vector->length = 2;
  scene.vector->r1 = 1.5;
  scene.vector->r2 = 3.5;
  scene.vector->opacity = 0.75;
  return scene;
}

TEST(Line, OpacityRampsFromInnerToOuterRadius) {
  const engine::Image image = render(one_line(10, 0, 0)).image;
  for (int y = 30; y <= 50; ++y) {
    const double distance = std::abs(y - 40);
    const double part = distance <= 1.5 ? 1 : std::max(0.0, (3.5 - distance) / 2);
    EXPECT_NEAR(pixel(image, 40, y)[3], 0.75 * part, 1e-6) << y;
    EXPECT_NEAR(pixel(image, 40, y)[2], 0.75 * part * 0.8, 1e-6) << y;
  }
}

TEST(Line, LengthFollowsTheMagnitudeUpToFullLength) {
  const auto half_length = [](float u) {
    const engine::Image image = render(one_line(u, 0, 0)).image;
    // The rounded end: opacity decreases over about 2.5 pixels beyond the end of the segment.
    double lit = 0;
    for (int x = 40; x < 81; ++x) lit += static_cast<double>(pixel(image, x, 40)[3]) / 0.75;
    return lit - 0.5 - 2.5;
  };
  EXPECT_NEAR(half_length(10), 20, 0.01);  // 2 world units, 40 pixels
  EXPECT_NEAR(half_length(5), 10, 0.01);
  EXPECT_NEAR(half_length(1000), 20, 0.01);
}

TEST(Line, AlongTheViewIsADiscOfTheOuterRadius) {
  for (const bool perspective : {false, true}) {
    scene::Scene scene = one_line(0, 10, 0);
    scene.vector->length = 0.5;
    scene.vector->head_desaturation = 0.5;
    scene.camera.perspective = perspective;
    if (perspective) scene.camera.half_height /= 5;
    const engine::Image image = render(scene).image;
    for (int y = 0; y < 81; ++y) {
      for (int x = 0; x < 81; ++x) {
        const double distance = std::hypot(x - 40, y - 40);
        const double part = std::clamp((3.5 - distance) / 2, 0.0, 1.0);
        ASSERT_NEAR(pixel(image, x, y)[3], 0.75 * part, 1e-5) << x << " " << y;
        // Neither head nor tail: the middle is visible.
        const double grey = 0.5 * 0.5;
        ASSERT_NEAR(pixel(image, x, y)[0], 0.75 * part * (0.2 + grey * 0.6), 0.01) << x << " " << y;
      }
    }
  }
}

TEST(Line, TurnsGrayTowardsItsHead) {
  scene::Scene scene = one_line(10, 0, 0);
  scene.vector->head_desaturation = 0.5;
  const engine::Image image = render(scene).image;
  for (int x = 21; x < 60; ++x) {
    const double q = (x - 40) / 40.0;
    const double grey = 0.5 * (q + 0.5);
    EXPECT_NEAR(pixel(image, x, 40)[0], 0.75 * (0.2 + grey * 0.6), 1e-5) << x;
    EXPECT_NEAR(pixel(image, x, 40)[2], 0.75 * 0.8, 1e-5) << x;
  }
}

TEST(Line, IsClippedToItsKernelBox) {
  scene::Scene scene = one_line(10, 0, 0);
  scene.vector->span = 0.5;  // a box of one world unit: +-10 pixels
  const engine::Image image = render(scene).image;
  EXPECT_NEAR(pixel(image, 50, 40)[3], 0.75, 1e-5);
  EXPECT_EQ(pixel(image, 55, 40)[3], 0.0F);
  scene.vector->span = 100;
  scene.vector->overlap = false;  // one stride: +-20 pixels, as long as the line
  EXPECT_NEAR(pixel(render(scene).image, 59, 40)[3], 0.75, 1e-5);
}

TEST(Line, DimsByMagnitudeAndDistance) {
  scene::Scene scene = one_line(5, 0, 0);
  scene.vector->magnitude_range = {0, 10};
  scene.vector->magnitude_intensity = 0.6;
  scene.depth_cue = {0.4, 4, 8};  // the line is 5 units away
  const engine::Image image = render(scene).image;
  const double dim = (1 - 0.6 * 0.5) * (1 - 0.4 * 0.25);
  EXPECT_NEAR(pixel(image, 40, 40)[2], 0.75 * 0.8 * dim, 1e-6);
  EXPECT_NEAR(pixel(image, 40, 40)[3], 0.75, 1e-6);
}

// Ranges of depth far below the rounding of the distance from the eye.
TEST(Line, DimsWithDepthInAVolumeThatIsThinAlongTheView) {
  scene::Scene scene = one_line(5, 0, 0);
  scene.depth_cue = {0.4, 5 - 1e-9, 5 + 3e-9};  // the line is 5 units away
  EXPECT_NEAR(pixel(render(scene).image, 40, 40)[2], 0.75 * 0.8 * (1 - 0.4 * 0.25), 1e-6);
  scene.depth_cue.strength = 0;
  scene.vector->color = ramp_color(5 - 1e-9, 5 + 3e-9, {0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F});
  scene.vector->color_by = scene::LineColor::screen_z;
  EXPECT_NEAR(pixel(render(scene).image, 40, 40)[0], 0.75 * 0.25, 1e-5);
}

TEST(Line, ColorFollowsTheConfiguredSource) {
  scene::Scene scene = one_line(6, 0, 8);
  scene.vector->color = ramp_color(0, 10, {0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F});
  const auto brightness = [&](scene::LineColor by, double low, double high) {
    scene.vector->color_by = by;
    scene.vector->color.range = {low, high};
    return static_cast<double>(pixel(render(scene).image, 40, 40)[0]) / 0.75;
  };
  EXPECT_NEAR(brightness(scene::LineColor::magnitude, 0, 20), 0.5, 1e-5);
  EXPECT_NEAR(brightness(scene::LineColor::world_z, -1, 3), 0.25, 1e-5);
  EXPECT_NEAR(brightness(scene::LineColor::screen_z, 0, 10), 0.5, 1e-5);
}

// The line is at full magnitude, 2 world units long, and rises by 0.8 of that; it is half way up a
// box from -1 to 1.
TEST(Line, ColorByRiseWeighsTheHeightItGainsAgainstItsHeight) {
  for (const bool slice : {false, true}) {
    scene::Scene scene = one_line(6, 0, 8);
    if (slice) scene.slice = scene::Slice{2, 0};
    scene.vector->color = ramp_color(-2, 4, {0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F});
    scene.vector->color_by = scene::LineColor::rise;
    const auto position = [&](double weight) {
      scene.vector->rise_weight = weight;
      return static_cast<double>(pixel(render(scene).image, 40, 40)[0]) / 0.75;
    };
    EXPECT_NEAR(position(1), (1.6 + 2) / 6, 1e-5);
    EXPECT_NEAR(position(0), 0.5, 1e-5) << "half way up the box, half way along the map";
    EXPECT_NEAR(position(0.25), 0.75 * 0.5 + 0.25 * 3.6 / 6, 1e-5);
    scene.vector->magnitude_range = {0, 20};
    EXPECT_NEAR(position(1), (0.8 + 2) / 6, 1e-5) << "half as long";
  }
}

TEST(Line, ColorByRiseIsSymmetricAndClampedAtTheEndsOfTheMap) {
  const auto position = [](float w) {
    scene::Scene scene = one_line(10, 0, w);
    scene.vector->color = ramp_color(-0.02, 0.02, {0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F});
    scene.vector->color_by = scene::LineColor::rise;
    scene.vector->rise_weight = 1;
    return static_cast<double>(pixel(render(scene).image, 40, 40)[0]) / 0.75;
  };
  EXPECT_NEAR(position(0), 0.5, 1e-5);
  // A rise of 1 in 200 over 2 world units is a quarter of the range.
  EXPECT_NEAR(position(0.05F), 0.75, 1e-4);
  EXPECT_NEAR(position(-0.05F), 0.25, 1e-4);
  EXPECT_NEAR(position(5), 1, 1e-5);
  EXPECT_NEAR(position(-5), 0, 1e-5);
}

TEST(Line, DirectionIsCorrectForHugeAndTinyMagnitudes) {
  const auto at = [](float m) {
    scene::Scene scene = one_line(m * 0.6F, 0, m * 0.8F);
    scene.vector->magnitude_range = {0, static_cast<double>(m)};
    scene.vector->min_magnitude = 0;
    return render(scene).image.rgba;
  };
  const auto one = at(1.0F);
  for (const float m : {1e-30F, 1e30F}) {
    const auto other = at(m);
    for (std::size_t i = 0; i < one.size(); ++i) ASSERT_NEAR(one[i], other[i], 2e-4) << m;
  }
}

// A line inside its own cell: I = c_s A + a exp(-tf) (c_v - c_s), A = -expm1(-tau) + a exp(-tau),
// tf = tau x, where x is the position of the line in its cell.
TEST(Line, InsideItsMediumCellHasTheClosedForm) {
  for (const double rho : {0.01, 0.7, 3.0, 60.0}) {
    for (const float slope : {0.0F, 4.0F, -9.0F}) {
      scene::Scene scene = one_line(10, slope, 0);
      scene.vector->length = 3;
      scene.vector->r1 = 2;
      scene.vector->r2 = 3;
      const auto field = make_volume(
          scene.lattice, 1, [=](int, double, double, double) { return static_cast<float>(rho); });
      scene.scalars.push_back(medium(field, {0.9F, 0.1F, 0.3F}));
      const engine::Image image = render(scene).image;
      const double m = std::hypot(10.0, static_cast<double>(slope));
      const double extent_x = 3 * 10 / m;
      const double extent_y = 3 * static_cast<double>(slope) / m;
      for (int x = 40 - 15; x <= 40 + 15; ++x) {
        const double world = (x - 40) / 20.0;
        const double q = world / extent_x;
        const double r = std::abs(world) / 2;  // cells are two wide
        const double s = 0.48;
        const double t = 1.37;
        const double g = r < s ? 1 - r * r / (s * t) : (t - r) * (t - r) / (t * (t - s));
        const double tau = rho * g * 2 / footprint_integral;
        const double place = std::clamp(0.5 + q * extent_y / 2, 0.0, 1.0);
        const double a = 0.75;
        const double alpha = -std::expm1(-tau) + a * std::exp(-tau);
        ASSERT_NEAR(pixel(image, x, 40)[3], alpha, 1e-5);
        const double medium_rgb[3] = {0.9, 0.1, 0.3};
        const double line_rgb[3] = {0.2, 0.5, 0.8};
        for (int c = 0; c < 3; ++c) {
          const double expected =
              medium_rgb[c] * alpha + a * std::exp(-tau * place) * (line_rgb[c] - medium_rgb[c]);
          ASSERT_NEAR(pixel(image, x, 40)[c], expected, 1e-4) << rho << " " << slope << " " << x;
        }
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::test
