// Paths of the camera as JSON, judged by the codec and by camera_path.schema.json.
#include "protocol/camera_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

const std::string camera_a = R"("camera": {"eye": [0, -3, 1], "target": [0, 0, 0]})";
const std::string flat_a =
    R"("camera": {"projection": "orthographic", "eye": [0, -3, 1], "target": [0, 0, 0], )"
    R"("height": 2})";

std::string path_text(const std::string& one, const std::string& two) {
  return R"({"keyframes": [{)" + one + "}, {" + two + "}]}";
}

std::vector<std::string> path_complaints(const std::string& text) {
  return schema_complaints("camera_path.schema.json", "", Json::parse(text));
}

TEST(CameraPathDocument, TimesOrStepsWithCompleteCamerasAreRead) {
  const std::string by_time = path_text("\"time\": 0.5, " + camera_a, "\"time\": 2, " + camera_a);
  const auto path = parse_camera_path(by_time);
  ASSERT_TRUE(path) << path.error().message;
  EXPECT_EQ(path->unit, CameraPath::Unit::seconds);
  ASSERT_EQ(path->keyframes.size(), 2U);
  EXPECT_EQ(path->keyframes[0].at, 0.5);
  EXPECT_EQ(path->keyframes[1].camera.eye, (Vec3{0, -3, 1}));
  EXPECT_EQ(path->keyframes[1].camera.projection, Projection::perspective);
  EXPECT_THAT(path_complaints(by_time), IsEmpty());
  const std::string by_step = path_text("\"step\": 0, " + flat_a, "\"step\": 7, " + flat_a);
  const auto steps = parse_camera_path(by_step);
  ASSERT_TRUE(steps) << steps.error().message;
  EXPECT_EQ(steps->unit, CameraPath::Unit::steps);
  EXPECT_EQ(steps->keyframes[1].camera.height, 2);
  EXPECT_THAT(path_complaints(by_step), IsEmpty());
}

TEST(CameraPathDocument, InvalidOnesAreRefusedAtTheirPlaces) {
  struct Case {
    std::string text;
    std::string pointer;
    bool schema = true;  // whether the schema refuses it too
  };
  const std::string one = "\"time\": 1, " + camera_a;
  for (const Case& each : {
           Case{"[]", ""},
           Case{"{}", "/keyframes"},
           Case{R"({"keyframes": [{)" + one + "}]}", "/keyframes"},
           Case{path_text(one, camera_a), "/keyframes/1/time"},
           Case{path_text(one, "\"step\": 2, " + camera_a), "/keyframes/1/time", false},
           Case{path_text(one, "\"time\": 2, \"step\": 2, " + camera_a), "/keyframes/1/step"},
           Case{path_text(one, one), "/keyframes/1/time", false},
           Case{path_text(one, "\"time\": -1, " + camera_a), "/keyframes/1/time"},
           Case{path_text(one, "\"time\": 2"), "/keyframes/1/camera"},
           Case{path_text(one, R"("time": 2, "camera": {"eye": [1, 1, 1]})"),
                "/keyframes/1/camera/target", false},
           Case{path_text(one, R"("time": 2, "camera": {"eye": [1, 1], "target": [0, 0, 0]})"),
                "/keyframes/1/camera/eye"},
           Case{path_text(one, R"("time": 2, "speed": 1, )" + camera_a), "/keyframes/1/speed"},
           Case{path_text(one, "\"time\": 2, " + flat_a), "/keyframes/1/camera/projection", false},
       }) {
    const auto path = parse_camera_path(each.text);
    ASSERT_FALSE(path) << each.text;
    ASSERT_FALSE(path.error().at.empty()) << path.error().message;
    EXPECT_EQ(path.error().at.front().pointer, each.pointer) << each.text;
    if (each.schema) {
      EXPECT_THAT(path_complaints(each.text), Not(IsEmpty())) << each.text;
    }
  }
  const std::string without_height =
      R"("camera": {"projection": "orthographic", "eye": [0, -3, 1], "target": [0, 0, 0]})";
  const auto flat = parse_camera_path(
      path_text("\"time\": 1, " + without_height, "\"time\": 2, " + without_height));
  ASSERT_FALSE(flat);
  EXPECT_EQ(flat.error().at.front().pointer, "/keyframes/0/camera/height");
}

}  // namespace
}  // namespace windsplat::protocol::testing
