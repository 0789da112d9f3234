// Where the values of a frame's error report come from.
#include "server/tasks/error_report.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace windsplat::tasks
