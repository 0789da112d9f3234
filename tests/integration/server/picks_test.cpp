// Picks over REST: what a pixel of a picture shows, compared with the picture and with probes.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;

constexpr int width = 160;
constexpr int height = 120;
constexpr double fast = 15;  // m/s

class Picks : public testing::Test {
 protected:
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  Answer post(const Json& view, const std::string& query, const Headers& headers = json_type) {
    return request(port(), "POST", "/v1/picks" + query, headers, view.dump());
  }
  Json feature(const Json& view, int x, int y) {
    const Answer answer =
        post(view, "?x=" + std::to_string(x + 0.5) + "&y=" + std::to_string(y + 0.5));
    EXPECT_EQ(answer.status, 200) << answer.body;
    return json_of(answer)["feature"];
  }
  // Opacity of each pixel, row by row.
  std::vector<float> opacities(const Json& view) {
    const Answer answer = post_view(port(), view.dump(), {{"Accept", "application/x-npy"}});
    EXPECT_EQ(answer.status, 200) << answer.body;
    std::vector<float> out(std::size_t{width} * height);
    const std::size_t start = answer.body.size() - out.size() * 4 * sizeof(float);
    for (std::size_t n = 0; n < out.size(); ++n) {
      std::memcpy(&out[n], answer.body.data() + start + (4 * n + 3) * sizeof(float), sizeof(float));
    }
    return out;
  }
  Json probe(const Json& index, int step) {
    const std::string at = std::to_string(index["x"].get<int>()) + "," +
                           std::to_string(index["y"].get<int>()) + "," +
                           std::to_string(index["z"].get<int>());
    return json_of(
        get(port(), "/v1/datasets/small/probe?index=" + at + "&step=" + std::to_string(step)));
  }
  static Json view_of_lines() {
    return {{"dataset", "small"},
            {"step", 1},
            {"image", {{"width", width}, {"height", height}}},
            {"ground", {{"show", "off"}}},
            {"annotations", Json::object()},
            {"vector", {{"minMagnitude", fast}, {"magnitudeIntensity", 0}}},
            {"scalars", Json::array()}};
  }

  TestServer server_;
};

void expect_pick_refused(const Answer& answer, int status, const std::string& words) {
  EXPECT_EQ(answer.status, status) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  EXPECT_THAT(answer.body, HasSubstr(words));
}

// Issue 22: of 45 hovers on lit lines of a picture of winds above 15 m/s, 34 read less.
TEST_F(Picks, EveryLitPixelReadsAVectorThatIsDrawn) {
  const Json view = view_of_lines();
  const std::vector<float> lit = opacities(view);
  int read = 0;
  for (int y = 1; y < height; y += 4) {
    for (int x = 1; x < width; x += 4) {
      if (lit[static_cast<std::size_t>(y * width + x)] < 0.2F) continue;
      const Json found = feature(view, x, y);
      ASSERT_TRUE(found.is_object()) << x << ' ' << y;
      EXPECT_EQ(found["layer"], "lines");
      EXPECT_GE(found["value"].get<double>(), fast) << x << ' ' << y;
      if (++read > 60) return;
    }
  }
  EXPECT_GT(read, 20);
}

TEST_F(Picks, TheValueIsThatOfTheSampleAndItsStep) {
  const Json view = view_of_lines();
  const std::vector<float> lit = opacities(view);
  const auto most = std::max_element(lit.begin(), lit.end()) - lit.begin();
  const Json found = feature(view, static_cast<int>(most % width), static_cast<int>(most / width));
  ASSERT_TRUE(found.is_object());
  const Json told = probe(found["position"]["index"], 1);
  const Json& value = told["values"][found["field"].get<std::string>()];
  double square = 0;
  for (const Json& part : value["value"]) square += std::pow(part.get<double>(), 2);
  EXPECT_NEAR(found["value"].get<double>(), std::sqrt(square), 1e-4);
  EXPECT_EQ(found["units"], value["units"]);
  EXPECT_EQ(found["position"], told["position"]);
  EXPECT_GT(found["share"].get<double>(), 0.1);
  EXPECT_LE(found["share"].get<double>(), 1);
  EXPECT_NEAR(found["at"][0].get<double>(), static_cast<double>(most % width), 20);
  EXPECT_NEAR(found["at"][1].get<double>(), static_cast<double>(most / width), 20);
}

// The straight lines through the samples are not drawn, and were reported nonetheless.
TEST_F(Picks, OfTracedLinesOnlyThoseThatAreDrawnAreRead) {
  const Json seeds = {{"seeds", {{"evenly", 12}, {"length", 0.3}}}};
  for (const Json& trace : {seeds, Json::object()}) {
    Json view = view_of_lines();
    view["vector"] = {{"trace", trace}, {"magnitudeIntensity", 0}};
    const std::vector<float> lit = opacities(view);
    int read = 0;
    int none = 0;
    for (int y = 1; y < height; y += 6) {
      for (int x = 1; x < width; x += 6) {
        const float opacity = lit[static_cast<std::size_t>(y * width + x)];
        if (opacity > 0 && opacity < 0.05F) continue;
        const Json found = feature(view, x, y);
        ASSERT_EQ(found.is_object(), opacity > 0) << trace << ' ' << x << ' ' << y;
        ++(opacity > 0 ? read : none);
        if (!found.is_object()) continue;
        EXPECT_EQ(found["layer"], "lines");
        EXPECT_NEAR(found["at"][0].get<double>(), x + 0.5, 2);
        EXPECT_NEAR(found["at"][1].get<double>(), y + 0.5, 2);
      }
    }
    EXPECT_GT(read, 10) << trace;
    EXPECT_GT(none, 10) << trace;
  }
}

// Also where the page cannot compute positions: on the globe and in a slice between two levels.
TEST_F(Picks, MediaArePickedInEveryGeometry) {
  for (const Json& geometry : {Json::object(), Json{{"mapping", "sphere"}},
                               Json{{"slice", {{"axis", "z"}, {"index", 1.5}}}}}) {
    Json view = view_of_lines();
    view.erase("scalars");
    view["vector"] = {{"field", nullptr}};
    view["geometry"] = geometry;
    view["ground"] = {{"show", "off"}};
    const std::vector<float> lit = opacities(view);
    const auto most = std::max_element(lit.begin(), lit.end()) - lit.begin();
    ASSERT_GT(lit[static_cast<std::size_t>(most)], 0.02) << geometry;
    const Json found =
        feature(view, static_cast<int>(most % width), static_cast<int>(most / width));
    ASSERT_TRUE(found.is_object()) << geometry;
    EXPECT_EQ(found["layer"], "medium");
    if (geometry.contains("slice")) {
      const int z = found["position"]["index"]["z"];
      EXPECT_TRUE(z == 1 || z == 2) << z;
      continue;
    }
    const Json told = probe(found["position"]["index"], 1);
    EXPECT_EQ(found["value"], told["values"][found["field"].get<std::string>()]["value"]);
  }
}

// Lines below an opaque section were reported as all that is seen, and the section never.
TEST_F(Picks, WhatAnOpaqueSectionHidesIsNotRead) {
  Json section = view_of_lines();
  section["surfaces"] = {{{"field", "cloud"}, {"isovalue", 0.3}, {"opacity", 0}},
                         {{"field", "cloud"}, {"slice", {{"axis", "z"}, {"index", 2}}}}};
  section["vector"] = {{"field", nullptr}};
  Json both = section;
  both["vector"] = {{"r1", 6}, {"r2", 8}, {"opacity", 1}};
  const std::vector<float> covered = opacities(section);
  int lines = 0;
  int sections = 0;
  for (int y = 2; y < height; y += 5) {
    for (int x = 2; x < width; x += 5) {
      if (covered[static_cast<std::size_t>(y * width + x)] < 1) continue;
      const Json plain = feature(section, x, y);
      ASSERT_TRUE(plain.is_object()) << x << ' ' << y;
      EXPECT_EQ(plain["layer"], "surface");
      EXPECT_EQ(plain["surface"], 1);
      EXPECT_EQ(plain["field"], "cloud");
      EXPECT_EQ(plain["share"], 1);
      EXPECT_EQ(plain["position"]["index"]["z"], 2);
      EXPECT_NEAR(plain["at"][0].get<double>(), x + 0.5, 1e-9);
      const Json found = feature(both, x, y);
      ASSERT_TRUE(found.is_object()) << x << ' ' << y;
      if (found["layer"] == "surface") {
        EXPECT_EQ(found["value"], plain["value"]);
        ++sections;
        continue;
      }
      EXPECT_EQ(found["layer"], "lines");
      EXPECT_LE(found["depth"].get<double>(), plain["depth"].get<double>()) << x << ' ' << y;
      ++lines;
    }
  }
  EXPECT_GT(lines, 5);
  EXPECT_GT(sections, 10);
}

TEST_F(Picks, AnIsosurfaceReadsItsOwnValueOrThatOfItsColours) {
  Json view = view_of_lines();
  view["vector"] = {{"field", nullptr}};
  view["surfaces"] = {{{"field", "cloud"}, {"isovalue", 0.3}}};
  const std::vector<float> lit = opacities(view);
  const auto most = std::max_element(lit.begin(), lit.end()) - lit.begin();
  ASSERT_EQ(lit[static_cast<std::size_t>(most)], 1);
  const auto x = static_cast<int>(most % width);
  const auto y = static_cast<int>(most / width);
  Json found = feature(view, x, y);
  ASSERT_TRUE(found.is_object());
  EXPECT_EQ(found["layer"], "surface");
  EXPECT_EQ(found["value"], 0.3);
  view["surfaces"][0]["color"] = {{"field", "cloud"}};
  found = feature(view, x, y);
  EXPECT_NEAR(found["value"].get<double>(), 0.3, 1e-4);
}

TEST_F(Picks, AnEmptyPixelHasNoFeature) {
  Json view = view_of_lines();
  view["vector"]["minMagnitude"] = 1e6;
  EXPECT_TRUE(feature(view, width / 2, height / 2).is_null());
}

TEST_F(Picks, RefusalsNameTheirReason) {
  const Json view = view_of_lines();
  expect_pick_refused(post(view, "?x=1"), 400, "'x' and 'y' are required");
  expect_pick_refused(post(view, "?x=1&y=1&z=1"), 400, "'z'");
  expect_pick_refused(post(view, "?x=160&y=1"), 422, "below 160 and 120");
  expect_pick_refused(post(view, "?x=-1&y=1"), 422, "'x'");
  expect_pick_refused(post(view, "?x=1&y=1", {{"Content-Type", "text/plain"}}), 415, "");
  expect_pick_refused(request(port(), "POST", "/v1/picks?x=1&y=1", json_type, "{"), 400, "");
  expect_pick_refused(post(Json::object(), "?x=1&y=1"), 422, "/dataset");
  Json other = view;
  other["dataset"] = "none";
  expect_pick_refused(post(other, "?x=1&y=1"), 404, "none");
  other = view;
  other["scalars"] = Json::array({Json{{"field", "none"}}});
  expect_pick_refused(post(other, "?x=1&y=1"), 422, "/scalars/0/field");
}

}  // namespace
}  // namespace server_test
