// Vectors and ranges of magnitudes of any size, by every instruction set.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>

#include "server/engine/kernels/dispatch.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

// From the smallest denormal float to the largest float.
constexpr std::array<float, 12> sizes{1e-45F, 1e-41F, 1.1e-38F, 1.2e-38F, 1e-30F, 1e-15F,
                                      1.0F,   1e15F,  1e30F,    8.5e37F,  9e37F,  3.4e38F};

// Lines of a few directions and lengths whose largest component is of this size.
Scene lines_of_size(float size) {
  Scene scene;
  scene.lattice = even_lattice({3, 2, 3}, {0.5, 0.5, 0.5});
  const auto field = make_volume(scene.lattice, 3, [=](int c, double x, double y, double z) {
    if (c == 0) return size;
    return static_cast<float>(static_cast<double>(size) * (c == 1 ? x - y : z));
  });
  scene.vector = plain_lines(field, {1.0F, 0.6F, 0.3F});
  scene.vector->length = 0.4;
  scene.vector->magnitude_intensity = 0.6;
  scene.vector->r1 = 1;
  scene.vector->r2 = 2;
  scene.camera = look({0, 0, 0}, {0.2, 1, -0.3}, 3, 20, 16, true, 0.3);
  scene.stop_transmittance = 0;
  return scene;
}

// Largest error of every target and of the reference. Positions of lines are rounded to 1e-5
// pixels.
void expect_truth(Scene scene, const std::string& what) {
  const auto light = truth::integrate(scene);
  EXPECT_LT(truth::largest_error(reference_picture(scene), light), 1e-6) << what;
  scene.method = Method::slab;
  for (const auto* table : engine::kernels::usable_tables()) {
    EXPECT_LT(truth::largest_error(render_with(*table, scene).image.rgba, light), 1e-4)
        << what << ' ' << table->name;
  }
}

TEST(Magnitudes, LinesOfAnySizeAreDrawnInAnyRange) {
  for (const float size : sizes) {
    for (const float full : sizes) {
      Scene scene = lines_of_size(size);
      scene.vector->magnitude_range = {0, static_cast<double>(full)};
      std::ostringstream what;
      what << size << " of " << full;
      expect_truth(scene, what.str());
    }
  }
}

TEST(Magnitudes, ColorsByMagnitudesOfAnySizeSpanTheTable) {
  for (const float size : sizes) {
    Scene scene = lines_of_size(size);
    scene.vector->magnitude_range = {0.2 * static_cast<double>(size), static_cast<double>(size)};
    scene.vector->color_by = scene::LineColor::magnitude;
    scene.vector->color = ramp_color(0, 1, {0.9F, 0.1F, 0.2F}, {0.1F, 1.0F, 0.4F});
    scene.vector->color.range = {0.9 * static_cast<double>(size), 1.3 * static_cast<double>(size)};
    expect_truth(scene, std::to_string(size));
  }
}

// Vectors of every size side by side: each is drawn as it is alone.
TEST(Magnitudes, SizesMayDifferFromSampleToSample) {
  for (const double full : {1e-30, 1.0, 1e30}) {
    Scene scene = lines_of_size(1);
    int n = 0;
    scene.vector->field = make_volume(scene.lattice, 3, [&](int c, double, double, double) {
      const float size = sizes[static_cast<std::size_t>(n++ / 3) % sizes.size()];
      return c == 0 ? size : 0.5F * size;
    });
    scene.vector->magnitude_range = {0, full};
    expect_truth(scene, std::to_string(full));
  }
}

TEST(Magnitudes, ToleranceSelectsLinesOfAnySize) {
  for (const float size : sizes) {
    if (size < 1e-44F) continue;  // halves of the smallest float are not floats
    Scene scene = lines_of_size(size);
    scene.vector->field = make_volume(scene.lattice, 3, [=](int c, double x, double, double) {
      return c == 0 ? (x > 0.1 ? size : 0.5F * size) : 0.0F;
    });
    scene.vector->magnitude_range = {0, static_cast<double>(size)};
    scene.vector->min_magnitude = 0.7 * static_cast<double>(size);
    expect_truth(scene, std::to_string(size));
    for (const auto* table : engine::kernels::usable_tables()) {
      const engine::WorkReport work = render_with(*table, scene).work;
      EXPECT_EQ(work.skipped_vector, 12) << size << ' ' << table->name;
      EXPECT_GT(work.skipped_bound, 0) << size << ' ' << table->name;
    }
  }
}

TEST(Magnitudes, FactorsOfAnySizeKeepDirections) {
  for (const double factor : {1e-300, 1e-40, 1e-20, 1e20, 1e40, 1e300}) {
    Scene scene = lines_of_size(1);
    scene.vector->scale = {factor, -factor, 0.5 * factor};
    std::ostringstream what;
    what << factor;
    expect_truth(scene, what.str());
    scene.vector->scale = {1, 0.5, factor};
    if (factor < 1) expect_truth(scene, what.str());
  }
}

}  // namespace
}  // namespace windsplat::test
