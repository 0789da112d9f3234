// Turns and paths of the camera.
#include "server/movie/camera_motion.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "protocol/camera_path.hpp"

namespace windsplat::movie::testing {
namespace {

using protocol::CameraView;
using protocol::Vec3;

CameraView camera_at(const Vec3& eye, const Vec3& target = {0, 0, 0}) {
  CameraView camera;
  camera.projection = protocol::Projection::perspective;
  camera.eye = eye;
  camera.target = target;
  return camera;
}

protocol::CameraPath path_of(std::vector<protocol::CameraKeyframe> keyframes) {
  return {protocol::CameraPath::Unit::seconds, std::move(keyframes)};
}

void expect_near(const Vec3& got, const Vec3& wanted, double tolerance, const std::string& where) {
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(got[a], wanted[a], tolerance) << where;
}

double apart(const Vec3& a, const Vec3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// From the south by 90 degrees the eye comes to the east; heights and distances stay.
TEST(CameraTurn, MovesTheEyeEastwardAboutTheVerticalThroughTheCentre) {
  CameraView camera = camera_at({1, -3, 2}, {1, 1, 0.5});
  camera.up = {0, 0.6, 0.8};
  const CameraView quarter = turned(camera, 90, *camera.target);
  expect_near(*quarter.eye, {5, 1, 2}, 1e-12, "eye");
  expect_near(*quarter.target, {1, 1, 0.5}, 0, "target");
  expect_near(quarter.up, {-0.6, 0, 0.8}, 1e-12, "up");
  expect_near(*turned(camera, 180, {0, 1, 7}).target, {-1, 1, 0.5}, 1e-12, "another centre");
  for (const double degrees : {10.0, 123.0, -200.0}) {
    const CameraView there = turned(camera, degrees, {3, 2, 1});
    EXPECT_NEAR(apart(*there.eye, *there.target), apart(*camera.eye, *camera.target), 1e-12);
    expect_near(*turned(there, -degrees, {3, 2, 1}).eye, *camera.eye, 1e-12, "and back");
  }
  EXPECT_EQ(turned(camera, 720, {0, 0, 0}), camera) << "whole turns are exact";
}

TEST(CameraPath, PassesItsKeyframesAndHoldsItsEnds) {
  const std::vector<protocol::CameraKeyframe> keyframes{{1, camera_at({0, -3, 1})},
                                                        {2, camera_at({3, 0, 1}, {0, 1, 0})},
                                                        {2.5, camera_at({0, 5, 2})},
                                                        {7, camera_at({-4, 0, 0.5}, {1, 0, 0})}};
  const auto path = CameraPath::of(path_of(keyframes));
  ASSERT_TRUE(path) << path.error().message;
  for (const auto& keyframe : keyframes) {
    const auto there = path->at(keyframe.at);
    ASSERT_TRUE(there);
    expect_near(*there->eye, *keyframe.camera.eye, 1e-12, std::to_string(keyframe.at));
    expect_near(*there->target, *keyframe.camera.target, 1e-12, std::to_string(keyframe.at));
  }
  EXPECT_EQ(path->at(0)->eye, keyframes.front().camera.eye);
  EXPECT_EQ(path->at(100)->eye, keyframes.back().camera.eye);
}

// Positions and velocities have no jump, although the keyframes lie at uneven times and distances.
TEST(CameraPath, TheVelocityIsContinuous) {
  const auto path = CameraPath::of(path_of({{0, camera_at({0, -3, 1})},
                                            {1, camera_at({0.2, -3, 1.1})},
                                            {1.5, camera_at({6, 2, 2}, {1, 0, 0})},
                                            {6, camera_at({6.5, 2, 1}, {1, 1, 0})}}));
  ASSERT_TRUE(path);
  constexpr double h = 1e-5;
  for (const double at : {1.0, 1.5}) {
    const Vec3 here = *path->at(at)->eye;
    const Vec3 before = *path->at(at - h)->eye;
    const Vec3 after = *path->at(at + h)->eye;
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR((here[a] - before[a]) / h, (after[a] - here[a]) / h, 2e-3) << at;
    }
  }
}

// Yuksel, Schaefer and Keyser 2011: of all parameters only the centripetal one has neither cusps
// nor loops within a segment. Uniform ones overshoot next to a short segment.
TEST(CameraPath, AShortSegmentBesideALongOneHasNoLoop) {
  const auto path = CameraPath::of(path_of({{0, camera_at({0, 0, 5})},
                                            {1, camera_at({10, 0, 5})},
                                            {2, camera_at({10, 0.1, 5})},
                                            {3, camera_at({0, 0.1, 5})}}));
  ASSERT_TRUE(path);
  double last = -1;
  for (int n = 0; n <= 100; ++n) {
    const Vec3 eye = *path->at(1 + 0.01 * n)->eye;
    EXPECT_GT(eye[1], last) << n;
    EXPECT_LT(eye[0], 10.3) << n;
    last = eye[1];
  }
}

// Two keyframes: a straight line at constant speed.
TEST(CameraPath, TwoKeyframesAreJoinedByALine) {
  const auto path =
      CameraPath::of(path_of({{2, camera_at({0, -4, 1})}, {6, camera_at({8, -2, 3}, {1, 1, 0})}}));
  ASSERT_TRUE(path);
  for (const double u : {0.25, 0.5, 0.9}) {
    const auto there = path->at(2 + 4 * u);
    expect_near(*there->eye, {8 * u, -4 + 2 * u, 1 + 2 * u}, 1e-12, "eye");
    expect_near(*there->target, {u, u, 0}, 1e-12, "target");
  }
}

// A keyframe that is repeated is a rest: the eye stops and does not leave.
TEST(CameraPath, EqualKeyframesAreARest) {
  const Vec3 place{3, 0, 1};
  const auto path = CameraPath::of(path_of({{0, camera_at({0, -3, 1})},
                                            {1, camera_at(place)},
                                            {2, camera_at(place)},
                                            {3, camera_at({0, 3, 1})}}));
  ASSERT_TRUE(path);
  for (const double at : {1.0, 1.3, 1.9, 2.0}) EXPECT_EQ(path->at(at)->eye, place) << at;
  constexpr double h = 1e-4;
  EXPECT_LT(apart(*path->at(1 - h)->eye, place) / h, 0.01) << "it comes to rest";
  EXPECT_LT(apart(*path->at(2 + h)->eye, place) / h, 0.01);
}

// In equal times the picture grows by equal factors.
TEST(CameraPath, SizesChangeByEqualFactors) {
  CameraView near = camera_at({0, -3, 1});
  CameraView far = near;
  near.fov_y = 10;
  far.fov_y = 60;
  for (CameraView* camera : {&near, &far}) camera->projection = protocol::Projection::orthographic;
  near.height = 0.5;
  far.height = 8;
  const auto path = CameraPath::of(path_of({{0, near}, {4, far}}));
  ASSERT_TRUE(path);
  const auto slope = [&](double at) { return std::tan(path->at(at)->fov_y * std::acos(-1) / 360); };
  for (const double at : {0.0, 1.0, 3.0}) {
    EXPECT_NEAR(*path->at(at + 1)->height / *path->at(at)->height, 2, 1e-12);
    EXPECT_NEAR(slope(at + 1) / slope(at), std::pow(slope(4) / slope(0), 0.25), 1e-12);
  }
}

TEST(CameraPath, UpwardDirectionsTurnAndOppositeOnesAreRefused) {
  CameraView one = camera_at({0, -3, 0});
  CameraView two = one;
  two.up = {5, 0, 0};
  const auto path = CameraPath::of(path_of({{0, one}, {1, two}}));
  ASSERT_TRUE(path);
  expect_near(path->at(0.5)->up, {std::sqrt(0.5), 0, std::sqrt(0.5)}, 1e-12, "up");
  two.up = {0, 0, -1};
  const auto opposite = CameraPath::of(path_of({{0, one}, {1, two}}));
  ASSERT_FALSE(opposite);
  EXPECT_EQ(opposite.error().at.at(0).pointer, "/keyframes/1/camera/up");
}

TEST(CameraPath, PlacesWithoutAViewDirectionAreRefused) {
  const auto path =
      CameraPath::of(path_of({{0, camera_at({0, -1, 0})}, {2, camera_at({0, 1, 0})}}));
  ASSERT_TRUE(path);
  EXPECT_TRUE(path->at(0.9));
  EXPECT_FALSE(path->at(1)) << "the eye is at the target";
}

}  // namespace
}  // namespace windsplat::movie::testing
