// Colours of the pixels of lines, compared with those of their map.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "server/data/resident/dataset.hpp"
#include "server/engine/render.hpp"
#include "server/scene/build.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::frame {
namespace {

using Rgb = std::array<double, 3>;

// The colour at full brightness: the greatest channel is 1.
Rgb hue_of(const Rgb& color) {
  const double most = std::max({color[0], color[1], color[2], 1e-30});
  return {color[0] / most, color[1] / most, color[2] / most};
}

double distance(const Rgb& a, const Rgb& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

struct Share {
  int bright = 0;
  int off = 0;  // whose hue is none of the map
};

// Of a tornado coloured by magnitude.
Share share_off_the_map(bool true_colors) {
  auto dataset = scene::sample_dataset("tornado", {32, 32, 32});
  protocol::View view;
  view.image.width = 320;
  view.image.height = 240;
  view.scalars.emplace();
  view.vector.color.by = protocol::ColorBy::magnitude;
  view.vector.color.true_colors = true_colors;
  const auto scene = scene::build_scene(view, *dataset);
  EXPECT_TRUE(scene);
  ThreadPool pool(1);
  const auto rendered = engine::render(*scene, pool, CancelToken());
  EXPECT_TRUE(rendered);
  std::vector<Rgb> hues;
  for (const auto& [red, green, blue] : scene->vector->color.entries) {
    hues.push_back(hue_of({red, green, blue}));
  }
  Share out;
  const auto& rgba = rendered->image.rgba;
  for (std::size_t n = 0; n < rgba.size(); n += 4) {
    const Rgb color{rgba[n], rgba[n + 1], rgba[n + 2]};
    if (std::max({color[0], color[1], color[2]}) < 0.2) continue;
    double nearest = 10;
    for (const Rgb& hue : hues) nearest = std::min(nearest, distance(hue, hue_of(color)));
    ++out.bright;
    out.off += nearest > 0.08 ? 1 : 0;
  }
  return out;
}

// Issue 22: 90 % of the bright pixels of the tornado by magnitude were off every hue of viridis.
TEST(TrueColors, BrightPixelsHaveColorsOfTheMap) {
  const Share faithful = share_off_the_map(true);
  ASSERT_GT(faithful.bright, 500);
  EXPECT_LT(faithful.off, 0.01 * faithful.bright);
  const Share whitened = share_off_the_map(false);
  ASSERT_GT(whitened.bright, 500);
  EXPECT_GT(whitened.off, 0.2 * whitened.bright) << "otherwise this test proves nothing";
}

TEST(TrueColors, LeaveOutWhiteningDimmingAndDepthCue) {
  auto dataset = scene::sample_dataset("tornado", {8, 8, 8});
  protocol::View view;
  const auto before = scene::build_scene(view, *dataset);
  ASSERT_TRUE(before);
  EXPECT_GT(before->vector->head_desaturation, 0);
  EXPECT_GT(before->vector->magnitude_intensity, 0);
  EXPECT_GT(before->depth_cue.strength, 0);
  view.vector.color.true_colors = true;
  const auto after = scene::build_scene(view, *dataset);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->vector->head_desaturation, 0);
  EXPECT_EQ(after->vector->magnitude_intensity, 0);
  EXPECT_EQ(after->depth_cue.strength, 0);
}

}  // namespace
}  // namespace windsplat::frame
