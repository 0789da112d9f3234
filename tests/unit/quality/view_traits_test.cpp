// Scene signature of a view, and the distance of two viewpoints.
#include "server/quality/view_traits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace windsplat::quality {
namespace {

protocol::View completed() {
  protocol::View view;
  view.dataset = "a";
  view.camera.eye = {0, -2, 0};
  view.camera.target = {0, 0, 0};
  view.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
  view.vector.length = 0.5;
  protocol::ScalarView layer;
  layer.field = "cloud";
  layer.extinction = {{0, 0}, {1, 3}, {2, 1}};
  view.scalars = {layer, layer};
  return view;
}

TEST(Viewpoint, IsTheHeightAtTheCenterAndTheDirection) {
  protocol::View view = completed();
  const Viewpoint viewpoint = viewpoint_of(view);
  EXPECT_NEAR(viewpoint.height, 4 * std::tan(view.camera.fov_y * std::acos(-1) / 360), 1e-12);
  EXPECT_EQ(viewpoint.direction, (protocol::Vec3{0, 1, 0}));
  EXPECT_EQ(viewpoint.pixels_high, view.image.height);
  view.camera.projection = protocol::Projection::orthographic;
  view.camera.height = 3;
  EXPECT_EQ(viewpoint_of(view).height, 3);
}

TEST(Viewpoint, WithoutACameraUsesTheOtherExceptForPixels) {
  protocol::View view = completed();
  view.camera.eye = {};
  view.image.height = 111;
  const Viewpoint viewpoint = viewpoint_of(view, {7, {1, 0, 0}, 5, 6});
  EXPECT_EQ(viewpoint.height, 7);
  EXPECT_EQ(viewpoint.direction, (protocol::Vec3{1, 0, 0}));
  EXPECT_EQ(viewpoint.pixels_high, 111);
}

// Cells scale with the size of the volume in the picture.
TEST(Viewpoint, DetailIsScaledFromTheOther) {
  protocol::View view = completed();
  view.image.height = 480;
  Viewpoint known = viewpoint_of(view);
  known.detail = 2;
  view.camera.eye = {0, -4, 0};
  EXPECT_NEAR(viewpoint_of(view, known).detail, 1, 1e-12);
  view.image.height = 960;
  EXPECT_NEAR(viewpoint_of(view, known).detail, 2, 1e-12);
  EXPECT_EQ(viewpoint_of(view).detail, 0) << "unknown";
}

// Each of these changes what is seen and none the scene signature.
TEST(Viewpoint, IdentityIsThatOfTheView) {
  const Viewpoint own = viewpoint_of(completed());
  EXPECT_TRUE(is_same_view(own, viewpoint_of(completed())));
  EXPECT_FALSE(is_same_view({}, {})) << "unknown";
  const std::vector<std::function<void(protocol::View&)>> changes{
      [](auto& view) { view.step = 1; },
      [](auto& view) { view.image.width += 1; },
      [](auto& view) { view.image.height += 1; },
      [](auto& view) { view.vector.motion_time = 0.5; },
      [](auto& view) { view.camera.fov_y += 1; },
      [](auto& view) {
        view.camera.up = {1, 0, 0};
      },
      [](auto& view) {
        (*view.camera.eye)[0] += 0.1;
        (*view.camera.target)[0] += 0.1;
      },
  };
  for (std::size_t n = 0; n < changes.size(); ++n) {
    protocol::View view = completed();
    changes[n](view);
    EXPECT_EQ(signature_of(view).key, signature_of(completed()).key) << n;
    EXPECT_FALSE(is_same_view(viewpoint_of(view), own)) << n;
  }
  protocol::View same = completed();
  same.quality.max_error = 0.01;
  same.method.name = protocol::MethodName::kernel;
  EXPECT_TRUE(is_same_view(viewpoint_of(same), own));
}

TEST(Viewpoint, ContentOfAnotherViewIsNotTaken) {
  protocol::View view = completed();
  Viewpoint known = viewpoint_of(view);
  known.content.emplace();
  EXPECT_TRUE(viewpoint_of(view, known).content);
  view.step = 1;
  EXPECT_FALSE(viewpoint_of(view, known).content);
}

TEST(SceneSignature, DoesNotDependOnCameraAndStep) {
  const std::string key = signature_of(completed()).key;
  protocol::View view = completed();
  view.step = 3;
  view.camera.eye = {5, 5, 5};
  view.image.width = 64;
  view.quality.max_error = 0.01;
  view.vector.motion_time = 0.5;
  view.method.name = protocol::MethodName::kernel;
  EXPECT_EQ(signature_of(view).key, key);
}

TEST(SceneSignature, DependsOnTheContent) {
  const std::string key = signature_of(completed()).key;
  const auto other = [&](auto change) {
    protocol::View view = completed();
    change(view);
    return signature_of(view).key != key;
  };
  EXPECT_TRUE(other([](auto& view) { view.dataset = "b"; }));
  EXPECT_TRUE(other([](auto& view) { view.scalars->clear(); }));
  EXPECT_TRUE(other([](auto& view) { view.vector.r2 = 3; }));
  EXPECT_TRUE(other([](auto& view) { view.method.slab_thickness = 2; }));
}

TEST(SceneSignature, DistinguishesLinesAndMedium) {
  const Kind kind = signature_of(completed()).kind;
  EXPECT_TRUE(kind.lines && kind.medium);
  protocol::View view = completed();
  view.scalars->clear();
  EXPECT_FALSE(signature_of(view).kind.medium);
  view = completed();
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  EXPECT_FALSE(signature_of(view).kind.lines);
}

// An incomplete view may show anything.
TEST(SceneSignature, IncompleteViewHasLinesInAMedium) {
  const Kind kind = signature_of(protocol::View()).kind;
  EXPECT_TRUE(kind.lines && kind.medium);
}

TEST(Distance, IsZeroToItselfAndSymmetric) {
  const Viewpoint a{1, {0, 1, 0}, 640, 480};
  const Viewpoint b{2, {0.6, 0.8, 0}, 1280, 960};
  EXPECT_EQ(distance(a, a), 0);
  EXPECT_EQ(distance(a, b), distance(b, a));
  EXPECT_GT(distance(a, b), 0);
}

TEST(Distance, GrowsWithZoomRotationAndPixels) {
  const Viewpoint from{1, {0, 1, 0}, 640, 480};
  double last = 0;
  for (const double zoom : {1.1, 1.5, 2.0, 4.0}) {
    const double apart = distance(from, {1 / zoom, {0, 1, 0}, 640, 480});
    EXPECT_GT(apart, last);
    EXPECT_NEAR(apart, distance(from, {zoom, {0, 1, 0}, 640, 480}), 1e-12);
    last = apart;
  }
  last = 0;
  for (const double turn : {0.1, 0.5, 1.0, 3.0}) {
    const double apart = distance(from, {1, {std::sin(turn), std::cos(turn), 0}, 640, 480});
    EXPECT_GT(apart, last);
    last = apart;
  }
  EXPECT_GT(distance(from, {1, {0, 1, 0}, 1280, 960}), 0);
}

}  // namespace
}  // namespace windsplat::quality
