// Forecasts over REST: before any measurement and after a calibration run.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;

class Forecasts : public testing::Test {
 protected:
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  Answer post(const Json& view, const Headers& headers = json_type) {
    return request(port(), "POST", "/v1/forecasts", headers, view.dump());
  }
  // Renders the view once, so that its data are resident.
  void draw(const Json& view) { EXPECT_EQ(post_view(port(), view.dump()).status, 200); }

  static Json view_of(int width, int height) {
    return {{"dataset", "small"}, {"image", {{"width", width}, {"height", height}}}};
  }

  TestServer server_;
};

void expect_refused(const Answer& answer, int status, const std::string& words) {
  EXPECT_EQ(answer.status, status) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  EXPECT_THAT(answer.body, HasSubstr(words));
}

TEST_F(Forecasts, AreACurveOfErrorAgainstTime) {
  Json view = view_of(640, 480);
  view["quality"]["maxError"] = 0.01;
  draw(view);
  const Answer answer = post(view);
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/json");
  const Json told = json_of(answer);
  EXPECT_EQ(told["view"], Json({{"width", 640}, {"height", 480}}));
  ASSERT_GT(told["points"].size(), 5U);
  double last_ms = 0;
  double least = 2;
  bool slabs = false;
  for (const Json& point : told["points"]) {
    const double error = point["error"].get<double>();
    EXPECT_GE(point["ms"].get<double>(), last_ms);
    EXPECT_GT(error, 0);
    EXPECT_LT(point["errorLow"].get<double>(), error);
    EXPECT_GT(point["errorHigh"].get<double>(), error);
    EXPECT_EQ(point["pareto"].get<bool>(), error < least) << point;
    EXPECT_GE(point["width"].get<int>(), 64);
    slabs = slabs || point["method"] == "slab";
    last_ms = point["ms"].get<double>();
    least = std::min(least, error);
  }
  EXPECT_TRUE(slabs);
}

// The forecast setting is the one with which POST /v1/frames draws the view.
TEST_F(Forecasts, ChosenPointIsTheRenderedSetting) {
  Json view = view_of(320, 240);
  draw(view);
  EXPECT_TRUE(json_of(post(view))["chosen"].is_null());
  for (const double budget_ms : {1.0, 2.0, 5.0, 10'000.0}) {
    view["quality"]["budgetMs"] = budget_ms;
    const Json told = json_of(post(view));
    ASSERT_TRUE(told["chosen"].is_number()) << told;
    const Json& chosen = told["points"][told["chosen"].get<std::size_t>()];
    const Answer drawn = post_view(port(), view.dump());
    const Json info = Json::parse(drawn.header("windsplat-frame"));
    for (const char* key : {"method", "width", "height", "slabThickness"}) {
      EXPECT_EQ(info[key], chosen[key]) << key << " at " << budget_ms;
    }
  }
}

// What a view shows determines both: neither is that of a typical view.
TEST_F(Forecasts, AreTheErrorsThatPicturesReport) {
  Json view = view_of(320, 240);
  draw(view);
  for (const char* const method : {"kernel", "slab"}) {
    view["method"]["name"] = method;
    for (const double opacity : {0.05, 1.0}) {
      view["vector"]["opacity"] = opacity;
      const Json points = json_of(post(view))["points"];
      const auto own = std::find_if(points.begin(), points.end(), [&](const Json& point) {
        return point["method"] == method && point["width"] == 320 && point["coarser"] == 0 &&
               (point["slabThickness"].is_null() || point["slabThickness"] == 1);
      });
      ASSERT_NE(own, points.end()) << points;
      const double forecast = (*own)["error"].get<double>();
      const Answer drawn = post_view(port(), view.dump());
      const Json error = Json::parse(drawn.header("windsplat-frame"))["error"];
      EXPECT_EQ(error["kind"], "estimated");
      EXPECT_NEAR(error["value"].get<double>(), forecast, 1e-6 * forecast)
          << method << ' ' << opacity;
    }
  }
}

// The data of the view and those of the coarser setting do not fit into memory together.
TEST(LimitedPicture, MakesRoomForTheDataOfItsSetting) {
  constexpr std::uint64_t samples = 64 * 64 * 64;
  constexpr std::uint64_t full = samples * 4 * sizeof(float);  // a vector and a scalar
  const TestServer server({}, {}, full + samples / 4);  // an eighth of the samples: samples * 2
  ASSERT_TRUE(server.store().add("tornado:64"));
  const Json view{{"dataset", "tornado:64"},
                  {"step", 1},
                  {"image", {{"width", 320}, {"height", 180}}},
                  {"quality", {{"budgetMs", 1}}}};
  const Answer drawn = post_view(server.port(), view.dump());
  ASSERT_EQ(drawn.status, 200) << drawn.body.substr(0, 300);
  const Json info = Json::parse(drawn.header("windsplat-frame"), nullptr, false);
  EXPECT_THAT(info["work"]["variant"].get<std::string>(), HasSubstr("level=1,1,1")) << info;
}

// Opaque lines have larger errors than those of a typical view. The first step determines the
// defaults of the view; the second one is not resident.
TEST_F(Forecasts, DecideForDataThatAreNotYetResidentAsForThoseThatAre) {
  for (const double most : {0.005, 0.007, 0.009}) {
    Json view = view_of(640, 480);
    view["scalars"] = Json::array();
    view["vector"]["opacity"] = 1;
    view["quality"]["maxError"] = most;
    Json other = view_of(320, 240);
    std::vector<Json> drawn;
    for (const int last_drawn : {0, 1}) {
      const TestServer fresh;
      for (int step = 0; step <= last_drawn; ++step) {
        other["step"] = step;
        EXPECT_EQ(post_view(fresh.port(), other.dump()).status, 200);
      }
      view["step"] = 1;
      const Answer answer = post_view(fresh.port(), view.dump());
      drawn.push_back(Json::parse(answer.header("windsplat-frame")));
    }
    for (const char* key : {"method", "width", "height"}) {
      EXPECT_EQ(drawn[0][key], drawn[1][key]) << key << " at " << most;
    }
  }
}

TEST_F(Forecasts, LargerBudgetNeverChoosesALargerError) {
  Json view = view_of(640, 480);
  draw(view);
  double last = 2;
  std::size_t different = 0;
  for (const double budget_ms : {1.0, 3.0, 10.0, 30.0, 100.0, 10'000.0}) {
    view["quality"]["budgetMs"] = budget_ms;
    const Json told = json_of(post(view));
    const double error = told["points"][told["chosen"].get<std::size_t>()]["error"].get<double>();
    EXPECT_LE(error, last) << budget_ms;
    different += error < last ? 1U : 0U;
    last = error;
  }
  EXPECT_GT(different, 1U) << "otherwise this test proves nothing";
}

TEST_F(Forecasts, AreEmptyBeforeLoadingAndLoadNothing) {
  const Json view = view_of(320, 240);
  const Answer early = post(view);
  expect_refused(early, 409, "POST /v1/frames");
  EXPECT_FALSE(early.header("retry-after").empty());
  EXPECT_EQ(server_.loads(), 0U);
  draw(view);
  const auto loads = server_.loads();
  EXPECT_GT(loads, 0U);
  EXPECT_EQ(post(view).status, 200);
  EXPECT_EQ(server_.loads(), loads);
}

// A session at rest starts a calibration run of its view: afterwards errors are measured, and times
// are milliseconds of this machine.
TEST_F(Forecasts, AreMeasuredAfterASession) {
  const Json view = view_of(320, 240);
  draw(view);
  const auto share_measured = [&](const char* key, const Json& yes) {
    const Json told = json_of(post(view));
    double count = 0;
    for (const Json& point : told["points"]) count += point[key] == yes ? 1 : 0;
    return count / static_cast<double>(told["points"].size());
  };
  EXPECT_EQ(share_measured("kind", "measured"), 0);
  EXPECT_EQ(share_measured("timed", true), 0);
  StreamClient viewer(port());
  ASSERT_TRUE(viewer.say(R"({"type":"open","id":1,"dataset":"small"})"));
  Json patch{{"type", "patch"}, {"rev", 1}, {"t", 0}, {"patch", view}};
  patch["patch"].erase("dataset");
  patch["patch"]["quality"]["budgetMs"] = 33;
  ASSERT_TRUE(viewer.next_text("opened"));
  ASSERT_TRUE(viewer.say(patch.dump()));
  for (std::uint32_t seq = 1;; ++seq) {
    const auto frame = viewer.next_frame(500);
    if (share_measured("kind", "measured") == 1) break;
    if (frame) viewer.say(Json{{"type", "ack"}, {"seq", seq}, {"decodeMs", 1}}.dump());
    ASSERT_LT(seq, 200U) << "no calibration run";
    if (!frame) --seq;
  }
  EXPECT_EQ(share_measured("timed", true), 1);
  // From another viewpoint the scene signature is the same.
  Json elsewhere = view;
  elsewhere["camera"] = {{"eye", {0, 0.1, 4}}, {"target", {0, 0, 0}}, {"up", {0, 1, 0}}};
  const Json told = json_of(post(elsewhere));
  for (const Json& point : told["points"]) {
    EXPECT_EQ(point["kind"], "estimated");
    EXPECT_EQ(point["timed"], true);
  }
}

TEST_F(Forecasts, ViewWithoutForecastIsRefused) {
  Json reference = view_of(320, 240);
  reference["method"]["name"] = "reference";
  const Answer refused = post(reference);
  expect_refused(refused, 422, "single setting");
  EXPECT_EQ(json_of(refused)["errors"][0]["pointer"], "/method/name");
  Json nowhere = view_of(320, 240);
  nowhere["dataset"] = "none";
  expect_refused(post(nowhere), 404, "none");
  expect_refused(post(Json::object()), 422, "/dataset");
  Json late = view_of(320, 240);
  late["step"] = small_steps;
  expect_refused(post(late), 422, "/step");
  expect_refused(post({{"dataset", "small"}, {"colour", 1}}), 422, "/colour");
  expect_refused(post(view_of(320, 240), {{"Content-Type", "text/plain"}}), 415, "json");
  expect_refused(request(port(), "POST", "/v1/forecasts", json_type, "{"), 400, "");
  expect_refused(
      request(port(), "POST", "/v1/forecasts", json_type, "{" + std::string(70'000, ' ') + "}"),
      413, "");
  const Answer list = get(port(), "/v1/forecasts");
  expect_refused(list, 405, "POST");
  EXPECT_EQ(list.header("allow"), "POST, OPTIONS");
}

}  // namespace
}  // namespace server_test
