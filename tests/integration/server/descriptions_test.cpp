// How often views are described for the estimates and choices of pictures over HTTP.
#include <gmock/gmock.h>

#include <string>

#include "server/frame/content.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using windsplat::frame::descriptions;

class Described : public testing::Test {
 protected:
  // The number of descriptions that a request makes.
  std::uint64_t made_by(const Json& view, const char* path = "/v1/frames") {
    const std::uint64_t before = descriptions();
    const Answer answer = request(server_.port(), "POST", path, json_type, view.dump());
    EXPECT_EQ(answer.status, 200) << answer.body.substr(0, 300);
    report_ = Json::parse(answer.header("windsplat-frame"), nullptr, false);
    return descriptions() - before;
  }
  static Json view_at(int step) {
    return {{"dataset", "small"}, {"step", step}, {"image", {{"width", 320}, {"height", 240}}}};
  }

  TestServer server_;
  Json report_;
};

TEST_F(Described, OnceForAllPicturesOfAView) {
  Json view = view_at(0);
  EXPECT_EQ(made_by(view), 1U);
  const Json first = report_["error"];
  EXPECT_EQ(made_by(view), 0U);
  EXPECT_EQ(report_["error"], first);
  view["quality"]["maxError"] = 0.01;
  EXPECT_EQ(made_by(view), 0U);
  EXPECT_EQ(made_by(view, "/v1/forecasts"), 0U);
}

TEST_F(Described, OnceForPicturesWithALimit) {
  Json view = view_at(0);
  view["quality"]["maxError"] = 0.01;
  EXPECT_EQ(made_by(view), 1U);
  const Json first = report_;
  EXPECT_EQ(made_by(view), 0U);
  for (const char* key : {"method", "width", "height", "error"}) {
    EXPECT_EQ(report_[key], first[key]) << key;
  }
  EXPECT_EQ(made_by(view, "/v1/forecasts"), 0U);
}

// Only the very same view is known.
TEST_F(Described, AgainForAnotherStepSizeOrCamera) {
  Json view = view_at(0);
  view["quality"]["maxError"] = 0.01;
  EXPECT_EQ(made_by(view), 1U);
  Json wider = view;
  wider["image"]["width"] = 330;
  EXPECT_EQ(made_by(wider), 1U);
  Json later = view;
  later["step"] = 1;
  EXPECT_EQ(made_by(later), 1U);
  for (const double aside : {0.0, 0.5}) {
    Json panned = view;
    panned["camera"] = {{"eye", {aside, -4, 0}}, {"target", {aside, 0, 0}}, {"up", {0, 0, 1}}};
    EXPECT_EQ(made_by(panned), 1U) << aside;
  }
  EXPECT_EQ(made_by(view), 0U) << "the others have not replaced it";
}

// Before any description, one is expected to take longer than this budget.
TEST_F(Described, NotWithinASmallBudget) {
  Json view = view_at(0);
  view["quality"]["budgetMs"] = 20;
  EXPECT_EQ(made_by(view), 0U);
  EXPECT_EQ(report_["error"]["kind"], "estimated");
  EXPECT_EQ(made_by(view), 0U);
  view["quality"]["budgetMs"] = 10'000;
  EXPECT_EQ(made_by(view), 1U);
  view["quality"]["budgetMs"] = 20;
  EXPECT_EQ(made_by(view), 0U) << "known since";
}

TEST_F(Described, IsAStageOfTheMetrics) {
  made_by(view_at(0));
  made_by(view_at(0));
  const std::string text = get(server_.port(), "/metrics").body;
  EXPECT_THAT(text, testing::HasSubstr("windsplat_stage_seconds_count{stage=\"describe\"} 1\n"));
}

}  // namespace
}  // namespace server_test
