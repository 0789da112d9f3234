// Streamlets of a scene: what they follow, where they are kept, and what is refused.
#include "server/scene/traced/streamlets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::View;

View traced(double length = 0.2) {
  View view;
  view.vector.trace = protocol::TraceView{};
  view.vector.length = length;
  view.scalars = std::vector<protocol::ScalarView>{};
  return view;
}

TEST(StreamletScene, IsAbsentByDefault) {
  auto dataset = sample_dataset("tornado", {12, 12, 12});
  EXPECT_EQ(built(View{}, *dataset).vector->streamlets, nullptr);
}

TEST(StreamletScene, SegmentsAreKeptForEveryCamera) {
  auto dataset = sample_dataset("tornado", {16, 16, 16});
  View view = traced();
  view.vector.stride = 1;
  const auto first = built(view, *dataset).vector->streamlets;
  ASSERT_NE(first, nullptr);
  EXPECT_GT(first->tally.lines, 100);
  EXPECT_GT(first->tally.segments, first->tally.lines);  // the flow turns
  view.camera.fov_y = 20;
  view.image.width = 300;
  view.vector.opacity = 0.3;
  EXPECT_EQ(built(view, *dataset).vector->streamlets, first);
  view.vector.stride = 2;
  const auto fewer = built(view, *dataset).vector->streamlets;
  EXPECT_NE(fewer, first);
  EXPECT_LT(fewer->tally.lines, first->tally.lines);
}

// Every number on which segments depend makes others.
TEST(StreamletScene, WhatDeterminesThemIsPartOfTheirKey) {
  auto dataset = sample_dataset("tornado", {12, 12, 12});
  const auto first = built(traced(), *dataset).vector->streamlets;
  const auto differs = [&](const auto& change) {
    View view = traced();
    change(view);
    return built(view, *dataset).vector->streamlets != first;
  };
  EXPECT_FALSE(differs([](View&) {}));
  EXPECT_TRUE(differs([](View& v) { v.vector.length = 0.21; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.scale = {1, 1, 2}; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.trace->segments = 4; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.trace->step_error = 1e-4; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.jitter.seed = 9; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.jitter.center = 0.1; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.min_magnitude = 1; }));
  EXPECT_TRUE(differs([](View& v) { v.vector.color.by = protocol::ColorBy::direction; }));
  EXPECT_TRUE(differs([](View& v) { v.geometry.scale = {1, 1, 2}; }));
}

// Arc lengths are those of the straight lines: at most the length, and shorter in proportion.
TEST(StreamletScene, LengthsAreThoseOfTheLines) {
  auto dataset = sample_dataset("tornado", {16, 16, 16});
  const Scene scene = built(traced(), *dataset);
  const trace::Segments& segments = *scene.vector->streamlets;
  double length = 0;
  for (std::size_t v = 0; v + 1 < segments.vertices(); ++v) {
    if (segments.magnitudes[v] < scene.vector->min_magnitude) {
      length = 0;
      continue;
    }
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      square += std::pow(static_cast<double>(segments.places[v + 1][c] - segments.places[v][c]), 2);
    }
    length += std::sqrt(square);
    const double part =
        static_cast<double>(segments.magnitudes[v]) / scene.vector->magnitude_range[1];
    ASSERT_LE(length, 0.2 * std::min(1.0, part) * 1.001);
  }
}

TEST(StreamletScene, FollowTheShellOfAGlobe) {
  auto dataset = sample_dataset("climate", {24, 16, 6});
  View view = traced(0.3);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  const Scene scene = built(view, *dataset);
  const trace::Segments& segments = *scene.vector->streamlets;
  EXPECT_GT(segments.tally.lines, 0);
  for (std::size_t v = 0; v < segments.vertices(); ++v) {
    if (segments.magnitudes[v] < 0) continue;
    const auto& p = segments.places[v];
    const double radius = std::hypot(p[0], p[1], p[2]);
    // Chords between columns 15 degrees apart lie below the sphere.
    EXPECT_LE(radius, 1.0001);
    EXPECT_GE(radius, scene.lattice.inner_radius * 0.97);
  }
}

TEST(StreamletScene, IsRefusedOnSlicesAndPlanes) {
  auto dataset = sample_dataset("tornado", {12, 12, 12});
  View slice = traced();
  slice.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 4};
  View plane = traced();
  plane.geometry.plane = protocol::PlaneView{{0, 0, 0}, {0, 1, 1}};
  for (const View& view : {slice, plane}) {
    const auto refused = complete(view, *dataset);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
    ASSERT_FALSE(refused.error().at.empty());
    EXPECT_EQ(refused.error().at[0].pointer, "/vector/trace");
  }
}

TEST(StreamletScene, HasEveryMarkButArrowHeads) {
  auto dataset = sample_dataset("tornado", {12, 12, 12});
  using protocol::MarkShape;
  View view = traced();
  view.vector.mark.halo = 1;
  for (const MarkShape shape : {MarkShape::taper, MarkShape::comet, MarkShape::line}) {
    view.vector.mark.shape = shape;
    EXPECT_TRUE(complete(view, *dataset));
  }
  view.vector.mark.shape = MarkShape::arrow;
  const auto refused = complete(view, *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  ASSERT_FALSE(refused.error().at.empty());
  EXPECT_EQ(refused.error().at[0].pointer, "/vector/mark/shape");
  view.vector.trace.reset();
  EXPECT_TRUE(complete(view, *dataset));
}

TEST(StreamletScene, BeyondTheMemoryLimitIsRefusedWithTheRemedy) {
  auto source = data::open_sample("tornado", {64, 64, 64});
  data::Dataset dataset(std::move(*source), "tornado", std::uint64_t{40} << 20U);
  View view = traced();
  view.vector.trace->segments = 64;
  view.vector.stride = 1;
  const auto completed = complete(view, dataset);
  ASSERT_TRUE(completed) << completed.error().message;
  const auto refused = build_scene(*completed, dataset);
  ASSERT_FALSE(refused);
  ASSERT_FALSE(refused.error().at.empty());
  EXPECT_EQ(refused.error().at[0].pointer, "/vector/trace");
  EXPECT_THAT(refused.error().message, testing::HasSubstr("/vector/stride"));
  view.vector.stride = 4;
  EXPECT_NE(built(view, dataset).vector->streamlets, nullptr);
}

}  // namespace
}  // namespace windsplat::scene
