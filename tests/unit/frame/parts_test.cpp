// The rows of parts in the report of a frame: what was computed for them, and that nothing was for
// absent ones.
#include "server/frame/report/parts.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "server/data/samples/samples.hpp"
#include "server/frame/frame.hpp"
#include "server/frame/frame_info.hpp"
#include "server/ground/atlas.hpp"
#include "server/scene/difference/difference.hpp"
#include "server/trace/segments.hpp"

namespace windsplat::frame {
namespace {

constexpr int wide = 48, deep = 24, high = 6;
constexpr std::int64_t samples_of_parts = std::int64_t{wide} * deep * high;
constexpr auto vertex_bytes = static_cast<std::int64_t>(trace::Segments::vertex_bytes);
constexpr std::int64_t pixels_of_parts = std::int64_t{160} * 90;

class PartsTest : public testing::Test {
 protected:
  PartsTest() {
    view_.image = {160, 90, "#000000"};
    view_.ground.show = protocol::GroundShow::off;
    view_.method.detail = protocol::Detail::full;
  }

  PartCounts parts_in(const protocol::View& view, Format format = Format::png) {
    return parts_of_dataset(view, dataset_, format);
  }
  PartCounts parts_of_dataset(const protocol::View& view, data::Dataset& dataset, Format format) {
    Encoding encoding;
    encoding.format = format;
    auto drawn = produce(view, dataset, encoding, pool_, CancelToken(), workspace_);
    EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
    if (!drawn) return {};
    info_ = frame_info(*drawn, drawn->view);
    return drawn->parts;
  }
  static const PartCount& of(const PartCounts& parts, ScenePart part) {
    return parts.at(static_cast<std::size_t>(part));
  }
  void add_surface(double isovalue) {
    protocol::SurfaceView surface;
    surface.field = "cloud";
    surface.isovalue = isovalue;
    view_.surfaces.push_back(surface);
  }
  [[nodiscard]] std::int64_t resident_bytes() const {
    return static_cast<std::int64_t>(dataset_.resident_bytes());
  }

  data::Dataset dataset_{data::open_sample("climate", {wide, deep, high}).value(), "climate",
                         std::uint64_t{1} << 30U};
  ThreadPool pool_{1};
  Workspace workspace_;
  protocol::View view_;
  protocol::FrameInfo info_;
};

// The dataset counts meshes, traced lines, sunlight, parts and differences of fields like fields:
// it holds only those drawn.
TEST_F(PartsTest, NothingIsComputedNorHeldForAbsentParts) {
  const std::size_t lines_of_the_earth = ground::atlas_bytes();
  for (const PartCount& part : parts_in(view_)) {
    EXPECT_FALSE(part.shown);
    EXPECT_EQ(part.count, 0);
    EXPECT_EQ(part.bytes, 0);
  }
  EXPECT_EQ(resident_bytes(), info_.bytes);
  EXPECT_EQ(dataset_.levels(), 0U);
  EXPECT_EQ(workspace_.space.ground_bytes(), 0U);
  EXPECT_EQ(ground::atlas_bytes(), lines_of_the_earth);
  EXPECT_FALSE(workspace_.figure);
  ASSERT_EQ(info_.parts.size(), parts_count);
  for (const protocol::PartReport& part : info_.parts) EXPECT_FALSE(part.shown) << part.part;
}

TEST_F(PartsTest, WhatIsHeldForPartsIsReported) {
  parts_in(view_);
  const std::int64_t before = resident_bytes();
  view_.light.emplace();
  add_surface(0.3);
  add_surface(0.5);
  const PartCounts parts = parts_in(view_);
  EXPECT_EQ(of(parts, ScenePart::light).count, samples_of_parts);
  EXPECT_EQ(of(parts, ScenePart::light).bytes, 2 * samples_of_parts);
  EXPECT_GT(of(parts, ScenePart::surfaces).count, 0);
  std::int64_t held = 0;
  for (const ScenePart part : {ScenePart::surfaces, ScenePart::light}) {
    EXPECT_TRUE(of(parts, part).shown);
    held += of(parts, part).bytes;
  }
  // The dataset counts what arrays hold beside their values too.
  EXPECT_GE(resident_bytes() - before, held);
  EXPECT_LE(resident_bytes() - before, held + held / 10);
}

// The dataset counts the most that such lines may take.
TEST_F(PartsTest, StreamletsCountTheirPieces) {
  parts_in(view_);
  const std::int64_t before = resident_bytes();
  view_.vector.trace.emplace();
  const PartCounts parts = parts_in(view_);
  EXPECT_FALSE(of(parts, ScenePart::seeds).shown);
  const PartCount lines = of(parts, ScenePart::streamlets);
  EXPECT_TRUE(lines.shown);
  ASSERT_TRUE(info_.streamlets);
  EXPECT_EQ(lines.count, info_.streamlets->segments);
  EXPECT_GE(lines.bytes, (lines.count + info_.streamlets->lines) * vertex_bytes);
  EXPECT_LE(lines.bytes, resident_bytes() - before);
}

TEST_F(PartsTest, SurfacesWithOneMeshHoldItOnceAndDrawItEach) {
  add_surface(0.3);
  const PartCount one = of(parts_in(view_), ScenePart::surfaces);
  add_surface(0.3);
  const PartCount two = of(parts_in(view_), ScenePart::surfaces);
  EXPECT_EQ(two.count, 2 * one.count);
  EXPECT_EQ(two.bytes, one.bytes);
}

TEST_F(PartsTest, LinesThroughSeedsHaveARowOfTheirOwn) {
  view_.vector.trace.emplace();
  view_.vector.trace->seeds.emplace();
  view_.vector.trace->seeds->evenly = 20;
  const PartCounts parts = parts_in(view_);
  EXPECT_FALSE(of(parts, ScenePart::streamlets).shown);
  EXPECT_TRUE(of(parts, ScenePart::seeds).shown);
  ASSERT_TRUE(info_.streamlets);
  EXPECT_EQ(of(parts, ScenePart::seeds).count, info_.streamlets->segments);
  // A vertex at both ends of each piece, shared by neighbours.
  EXPECT_GE(of(parts, ScenePart::seeds).bytes,
            (info_.streamlets->segments + info_.streamlets->lines) * vertex_bytes);
}

TEST_F(PartsTest, AGroundIsSearchedForInEveryPixel) {
  view_.ground.show = protocol::GroundShow::on;
  const PartCounts parts = parts_in(view_);
  EXPECT_EQ(of(parts, ScenePart::ground).count, pixels_of_parts);
  EXPECT_GT(ground::atlas_bytes(), 0U);
  EXPECT_EQ(of(parts, ScenePart::ground).bytes,
            static_cast<std::int64_t>(workspace_.space.ground_bytes() + ground::atlas_bytes()));
  // Kept for the next picture that has one; one that has none does not count it.
  view_.ground.show = protocol::GroundShow::off;
  EXPECT_EQ(of(parts_in(view_), ScenePart::ground).bytes, 0);
}

// Level ground has its own light, of a place below each column.
TEST_F(PartsTest, LitGroundHasFactorsBesideThoseOfTheSamples) {
  view_.ground.show = protocol::GroundShow::on;
  view_.light.emplace();
  const PartCount light = of(parts_in(view_), ScenePart::light);
  EXPECT_EQ(light.count, samples_of_parts + std::int64_t{wide} * deep);
  EXPECT_EQ(light.bytes, 2 * light.count);
}

TEST_F(PartsTest, AnnotationsHaveItemsUnlessThePictureIsOfNumbers) {
  view_.annotations.box = true;
  view_.annotations.legend = true;
  const PartCounts parts = parts_in(view_);
  EXPECT_TRUE(of(parts, ScenePart::annotations).shown);
  EXPECT_GE(of(parts, ScenePart::annotations).count, 12);  // edges of the box
  EXPECT_EQ(of(parts, ScenePart::annotations).bytes, 2 * 4 * pixels_of_parts);
  EXPECT_FALSE(of(parts_in(view_, Format::npy), ScenePart::annotations).shown);
}

TEST_F(PartsTest, ARegionCountsTheSamplesOutsideOfIt) {
  parts_in(view_);
  const std::int64_t all = info_.samples;
  const std::int64_t before = resident_bytes();
  view_.region.x = {-30, 30};
  const PartCount region = of(parts_in(view_), ScenePart::region);
  EXPECT_TRUE(region.shown);
  EXPECT_EQ(region.count, all - info_.samples);
  EXPECT_GT(region.count, samples_of_parts / 2);
  EXPECT_EQ(region.bytes, info_.bytes);
  EXPECT_EQ(resident_bytes() - before, region.bytes);
}

TEST_F(PartsTest, AFilterLeavesOutNoSamplesAndHoldsWhatItMasked) {
  parts_in(view_);
  const std::int64_t before = resident_bytes();
  view_.region.where.push_back({"cloud", {0.1, 1}, protocol::FilterOf::all});
  const PartCount region = of(parts_in(view_), ScenePart::region);
  EXPECT_TRUE(region.shown);
  EXPECT_EQ(region.count, 0);
  EXPECT_EQ(resident_bytes() - before, region.bytes);
}

TEST_F(PartsTest, ADifferenceCountsTheValuesSubtracted) {
  view_.scalars.emplace();
  view_.difference.emplace();
  view_.difference->step = 0;
  view_.step = 1;
  data::Dataset minus = scene::with_difference(view_, dataset_, nullptr).value();
  const PartCount difference =
      of(parts_of_dataset(view_, minus, Format::png), ScenePart::difference);
  EXPECT_TRUE(difference.shown);
  EXPECT_EQ(difference.count, 3 * samples_of_parts);
  EXPECT_EQ(difference.bytes, 3 * 4 * samples_of_parts);
  EXPECT_EQ(difference.bytes, info_.bytes);
}

}  // namespace
}  // namespace windsplat::frame
