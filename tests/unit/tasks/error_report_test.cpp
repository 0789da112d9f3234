// Where the values of a frame's error report come from.
#include "server/tasks/error_report.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "server/frame/frame_info.hpp"

namespace windsplat::tasks {
namespace {

class ErrorReport : public ::testing::Test {
 protected:
  ErrorReport() {
    drawn.view.method.name = protocol::MethodName::kernel;
    drawn.view.image = {640, 480};
    drawn.width = 640;
    drawn.height = 480;
    drawn.work.skipped_bound = 0.4;
  }
  protocol::FrameInfo reported() {
    protocol::FrameInfo info = frame::frame_info(drawn, drawn.view);
    const quality::Setting setting = quality::settings[quality::own_setting(drawn.view)];
    report_error(drawn, observed_in(drawn, setting), setting, {}, tables, info);
    return info;
  }

  frame::Frame drawn;
  quality::Tables tables;
};

TEST_F(ErrorReport, MeasuredChangeIsReportedAlsoIfThereIsAnEstimate) {
  drawn.skipped_change = 0.02;
  drawn.content.emplace().skipped_change = 0.03;
  const auto info = reported();
  EXPECT_EQ(info.skipped_change, 0.02);
  EXPECT_EQ(info.skipped_change_kind, "measured");
}

TEST_F(ErrorReport, EstimatedChangeIsNotAboveItsBound) {
  for (const auto& [estimate, expected] : {std::pair{0.3, 0.3}, std::pair{0.7, 0.4}}) {
    drawn.content.emplace().skipped_change = estimate;
    const auto info = reported();
    EXPECT_EQ(info.skipped_change, expected);
    EXPECT_EQ(info.skipped_change_kind, "estimated");
  }
}

TEST_F(ErrorReport, ChangeIsUnknownWithoutDescriptionOrWhereTooFewPixelsWereTried) {
  EXPECT_FALSE(reported().skipped_change);
  drawn.content.emplace();
  const auto info = reported();
  EXPECT_FALSE(info.skipped_change);
  EXPECT_EQ(info.skipped_change_kind, "none");
}

TEST_F(ErrorReport, ChangeOfAViewDescribedBeforeIsEstimated) {
  drawn.content.emplace().skipped_change = 0.1;
  drawn.describe_us = 1;
  EXPECT_EQ(reported().skipped_change, 0.1);
  drawn.content.reset();
  drawn.describe_us = 0;
  const auto info = reported();
  EXPECT_EQ(info.skipped_change, 0.1);
  EXPECT_EQ(info.skipped_change_kind, "estimated");
}

TEST_F(ErrorReport, ErrorAskedIsTheViewsMaxErrorButNotOfAReference) {
  drawn.error = 0.01;
  EXPECT_FALSE(reported().error_asked);
  drawn.view.quality.max_error = 0.02;
  EXPECT_EQ(reported().error_asked, 0.02);
  EXPECT_EQ(reported().error_kind, "measured");
  drawn.view.method.name = protocol::MethodName::reference;
  const auto info = reported();
  EXPECT_FALSE(info.error_asked || info.error_value || info.skipped_change);
}

protocol::DetailReport drawn_from(int level, int wanted) {
  protocol::DetailReport out;
  out.wanted.halvings.fill(wanted);
  out.drawn.halvings.fill(level);
  return out;
}

TEST_F(ErrorReport, ACoarserLevelThanWouldSufficeAddsItsErrorInSquares) {
  drawn.content.emplace();
  const double method = *reported().error_value;
  drawn.content->detail = quality::DetailError{3 * method, 2, {2, 2, 2}};
  drawn.data_drawn = drawn_from(2, 0);
  const auto info = reported();
  EXPECT_DOUBLE_EQ(*info.error_value, std::sqrt(10.0) * method);
  EXPECT_EQ(info.error_kind, "estimated");
  EXPECT_DOUBLE_EQ(*info.detail->error, 3 * method);
  drawn.data_drawn = drawn_from(0, 0);
  EXPECT_EQ(reported().error_value, method);
  EXPECT_FALSE(reported().detail->error);
}

TEST_F(ErrorReport, WithoutThatOfItsLevelTheErrorOfACoarserOneIsUnknown) {
  drawn.content.emplace();
  drawn.data_drawn = drawn_from(1, 0);
  const auto info = reported();
  EXPECT_FALSE(info.error_value);
  EXPECT_EQ(info.error_kind, "none");
}

TEST_F(ErrorReport, AFrameOfAnotherLevelHasTheErrorOfTheDescribedOneGrown) {
  drawn.content.emplace().detail = quality::DetailError{0.02, 2, {1, 1, 1}};
  drawn.data_drawn = drawn_from(1, 0);
  drawn.describe_us = 1;
  EXPECT_EQ(reported().detail->error, 0.02);
  drawn.content.reset();
  drawn.describe_us = 0;
  drawn.data_drawn = drawn_from(3, 0);
  EXPECT_DOUBLE_EQ(*reported().detail->error, 0.08);
}

}  // namespace
}  // namespace windsplat::tasks
