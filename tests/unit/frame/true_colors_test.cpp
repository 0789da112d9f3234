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
#include "server/scene/completed_view.hpp"
#include "server/scene/lines/mark.hpp"
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

std::vector<float> pixels_of(const scene::Scene& scene) {
  ThreadPool pool(1);
  const auto rendered = engine::render(scene, pool, CancelToken());
  EXPECT_TRUE(rendered);
  return rendered->image.rgba;
}

// The same lines, unmarked, with the table (1, t, t^2) for the positions t in the map: pixels are
// the moments of the positions that they mix.
std::vector<float> moments_of(scene::Scene scene) {
  scene.vector->head_desaturation = 0;
  scene.vector->magnitude_intensity = 0;
  scene.depth_cue.strength = 0;
  auto& entries = scene.vector->color.entries;
  for (std::size_t n = 0; n < entries.size(); ++n) {
    const float t = static_cast<float>(n) / static_cast<float>(entries.size() - 1);
    entries[n] = {1, t, t * t};
  }
  return pixels_of(scene);
}

struct Share {
  int plain = 0;  // bright, and of one value: its standard deviation is below 2 % of the map
  int off = 0;    // of these, whose hue is not that of the value
};

// Of a tornado coloured by magnitude. A pixel in which lines of different values overlap has
// a colour between theirs, which need not be one of the map.
Share share_off_the_map(bool true_colors) {
  auto dataset = scene::sample_dataset("tornado", {64, 64, 64});
  protocol::View view;
  view.image.width = 1280;
  view.image.height = 720;
  view.scalars.emplace();
  view.vector.color.by = protocol::ColorBy::magnitude;
  view.vector.color.true_colors = true_colors;
  const auto scene = scene::build_scene(view, *dataset);
  EXPECT_TRUE(scene);
  const auto& entries = scene->vector->color.entries;
  const std::vector<float> colors = pixels_of(*scene);
  const std::vector<float> moments = moments_of(*scene);
  Share out;
  for (std::size_t n = 0; n < colors.size(); n += 4) {
    const Rgb color{colors[n], colors[n + 1], colors[n + 2]};
    if (std::max({color[0], color[1], color[2]}) < 0.2) continue;
    const double mean = moments[n + 1] / moments[n];
    if (moments[n + 2] / moments[n] - mean * mean > 4e-4) continue;
    ++out.plain;
    const auto at =
        static_cast<std::size_t>(std::lround(mean * static_cast<double>(entries.size() - 1)));
    const Rgb told{entries[at][0], entries[at][1], entries[at][2]};
    out.off += distance(hue_of(told), hue_of(color)) > 0.08 ? 1 : 0;
  }
  return out;
}

// Issue 22: 90 % of the bright pixels of the tornado by magnitude were off every hue of viridis.
TEST(TrueColors, PixelsOfOneValueHaveItsColorInTheLegend) {
  const Share faithful = share_off_the_map(true);
  ASSERT_GT(faithful.plain, 10'000);
  EXPECT_LT(faithful.off, 0.01 * faithful.plain);
  const Share whitened = share_off_the_map(false);
  ASSERT_GT(whitened.plain, 10'000);
  EXPECT_GT(whitened.off, 0.5 * whitened.plain) << "otherwise this test proves nothing";
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

// Without white heads the dark tail is all that tells the direction of a line without a shape, also
// of a traced one; other shapes tell it themselves.
TEST(TrueColors, DarkenTheTailsOfPlainLinesUnlessGiven) {
  auto dataset = scene::sample_dataset("tornado", {8, 8, 8});
  const auto tail = [&](const auto& change) {
    protocol::View view;
    view.vector.color.true_colors = true;
    change(view.vector);
    return scene::complete(view, *dataset)->view().vector.mark.tail_darkening.value();
  };
  using protocol::MarkShape;
  EXPECT_EQ(tail([](protocol::VectorView&) {}), 0.85);
  EXPECT_EQ(tail([](protocol::VectorView& lines) { lines.mark.tail_darkening = 0.2; }), 0.2);
  EXPECT_EQ(tail([](protocol::VectorView& lines) { lines.mark.shape = MarkShape::taper; }), 0);
  EXPECT_EQ(tail([](protocol::VectorView& lines) { lines.mark.shape = MarkShape::arrow; }), 0);
  EXPECT_EQ(tail([](protocol::VectorView& lines) { lines.trace.emplace(); }), 0.85);
  EXPECT_EQ(tail([](protocol::VectorView& lines) { lines.color.true_colors = false; }), 0);
}

// The magnitude varies along a line through a seed: one colour is one magnitude all along it.
TEST(TrueColors, DoNotDarkenLinesThroughSeedsUnlessAsked) {
  auto dataset = scene::sample_dataset("tornado", {8, 8, 8});
  protocol::View view;
  view.vector.color.true_colors = true;
  view.vector.trace.emplace().seeds.emplace();
  const auto tail_light = [&] {
    return scene::build_scene(view, *dataset)->vector->mark.tail_light;
  };
  EXPECT_EQ(tail_light(), 1);
  view.vector.mark.tail_darkening = 0.25;
  EXPECT_EQ(tail_light(), 0.75);
  protocol::View preset;
  preset.vector.trace.emplace().seeds.emplace();
  preset.vector.head_desaturation = 0.7;
  const auto completed = scene::complete(preset, *dataset);
  ASSERT_TRUE(completed);
  protocol::VectorView lines = completed->view().vector;
  scene::draw_true_colors(lines);
  EXPECT_EQ(lines.mark.tail_darkening, 0.0);
}

}  // namespace
}  // namespace windsplat::frame
