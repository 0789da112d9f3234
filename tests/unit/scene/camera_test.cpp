// The camera: orientation of the picture, orbits, framing, invalid cameras.
#include "server/scene/camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/presets.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

struct Pixel {
  double x, y, depth;
};

// Pixel coordinates of a world point, top row first, by the documented definition of the camera.
Pixel project(const Camera& camera, const glm::dvec3& point) {
  const glm::dvec3 p = point - camera.eye;
  const double depth = glm::dot(p, camera.forward);
  const double half = camera.perspective ? depth * camera.half_height : camera.half_height;
  return {camera.width / 2.0 + glm::dot(p, camera.right) / half * camera.height / 2.0,
          camera.height / 2.0 - glm::dot(p, camera.up) / half * camera.height / 2.0, depth};
}

Scene default_scene(data::Dataset& dataset, const protocol::View& view = {}) {
  auto scene = build_scene(view, dataset);
  EXPECT_TRUE(scene);
  return std::move(*scene);
}

std::unique_ptr<data::Dataset> atmosphere() {
  return dataset_of(std::make_unique<FakeSource>(atmosphere_grid(),
                                                 std::vector<data::FieldInfo>{wind_info()}, 1));
}

TEST(Camera, DefaultPictureHasEastRightNorthFarAndLowPressureHigh) {
  auto dataset = atmosphere();
  const Scene scene = default_scene(*dataset);
  const auto& at = scene.lattice.positions;
  const glm::dvec3 origin(at[0][1], at[1][1], at[2][1]);
  const Pixel here = project(scene.camera, origin);
  const Pixel east = project(scene.camera, {at[0][2], at[1][1], at[2][1]});
  const Pixel north = project(scene.camera, {at[0][1], at[1][2], at[2][1]});
  const Pixel lower_pressure = project(scene.camera, {at[0][1], at[1][1], at[2][2]});
  EXPECT_GT(east.x, here.x + 10);
  EXPECT_LT(north.y, here.y - 10);
  EXPECT_GT(north.depth, here.depth);
  EXPECT_LT(lower_pressure.y, here.y - 10);
}

TEST(Camera, AxesAreOrthonormalAndRightHanded) {
  auto dataset = atmosphere();
  protocol::View view;
  view.camera.eye = protocol::Vec3{1, -2, 3};
  view.camera.up = {0.3, 0.1, 5};
  const Camera camera = default_scene(*dataset, view).camera;
  EXPECT_NEAR(glm::dot(camera.right, camera.up), 0, 1e-14);
  EXPECT_NEAR(glm::dot(camera.right, camera.forward), 0, 1e-14);
  EXPECT_NEAR(glm::length(camera.up), 1, 1e-14);
  EXPECT_NEAR(glm::length(glm::cross(camera.right, camera.up) + camera.forward), 0, 1e-14);
  EXPECT_GT(camera.up.z, 0);
}

TEST(Camera, HalfHeightFollowsTheProjection) {
  auto dataset = atmosphere();
  protocol::View view;
  view.camera.fov_y = 90;
  EXPECT_NEAR(default_scene(*dataset, view).camera.half_height, 1.0, 1e-12);
  view.camera.projection = protocol::Projection::orthographic;
  view.camera.height = 3.0;
  const Camera camera = default_scene(*dataset, view).camera;
  EXPECT_FALSE(camera.perspective);
  EXPECT_NEAR(camera.half_height, 1.5, 1e-12);
}

TEST(Orbit, AzimuthZeroLooksNorthAndPositiveMovesEast) {
  auto dataset = atmosphere();
  const Lattice lattice = *place_lattice(dataset->info().grid, {});
  protocol::View view;
  orbit(view, lattice, 0, 0, 1);
  EXPECT_NEAR((*view.camera.eye)[0], 0, 1e-9);
  EXPECT_LT((*view.camera.eye)[1], -1);
  EXPECT_NEAR((*view.camera.eye)[2], 0, 1e-9);
  orbit(view, lattice, 90, 0, 1);
  EXPECT_GT((*view.camera.eye)[0], 1);
  EXPECT_NEAR((*view.camera.eye)[1], 0, 1e-9);
  orbit(view, lattice, 0, 30, 1);
  const protocol::Vec3 eye = *view.camera.eye;
  EXPECT_NEAR(std::atan2(eye[2], -eye[1]), 30 * std::numbers::pi / 180, 1e-12);
}

TEST(Orbit, StraightDownHasNorthUpAndAValidCamera) {
  auto dataset = atmosphere();
  const Lattice lattice = *place_lattice(dataset->info().grid, {});
  protocol::View view;
  orbit(view, lattice, 0, 90, 1);
  const Scene scene = default_scene(*dataset, view);
  const Pixel centre = project(scene.camera, {0, 0, 0});
  EXPECT_LT(project(scene.camera, {0, 0.1, 0}).y, centre.y - 1);
  EXPECT_GT(project(scene.camera, {0.1, 0, 0}).x, centre.x + 1);
  orbit(view, lattice, 20, 40, 1);
  EXPECT_EQ(view.camera.up, (protocol::Vec3{0, 0, 1}));
}

TEST(Orbit, ZoomOneFramesTheWholeBoxTightlyInEitherProjection) {
  auto dataset = sample_dataset("climate", {16, 8, 4});
  for (const auto projection :
       {protocol::Projection::perspective, protocol::Projection::orthographic}) {
    for (const std::array<int, 2> size : {std::array<int, 2>{1280, 720}, {300, 900}, {1, 1}}) {
      for (const double fov : {0.01, 35.0, 120.0}) {
        protocol::View view;
        view.camera.projection = projection;
        view.camera.fov_y = fov;
        view.image.width = size[0];
        view.image.height = size[1];
        const Lattice lattice = *place_lattice(dataset->info().grid, {});
        orbit(view, lattice, 40, 25, 1);
        const Camera camera = *resolve_camera(view, lattice);
        double widest = 0;
        for (int n = 0; n < 8; ++n) {
          const glm::dvec3 corner((n & 1) != 0 ? lattice.box_max.x : lattice.box_min.x,
                                  (n & 2) != 0 ? lattice.box_max.y : lattice.box_min.y,
                                  (n & 4) != 0 ? lattice.box_max.z : lattice.box_min.z);
          const Pixel p = project(camera, corner);
          EXPECT_GT(p.depth, camera.near);
          widest =
              std::max({widest, std::abs(2 * p.x / size[0] - 1), std::abs(2 * p.y / size[1] - 1)});
        }
        EXPECT_LT(widest, 1.0);
        if (fov < 100) {
          EXPECT_GT(widest, 0.9);
        }
      }
    }
  }
}

// The box fills the picture in one direction, but for the margin, with equal room on opposite
// sides in both.
TEST(Camera, DefaultShowsTheWholeBoxInTheMiddleInEitherProjection) {
  for (const std::array<int, 3> dims : {std::array<int, 3>{64, 32, 4}, {8, 8, 8}, {4, 4, 32}}) {
    auto dataset = sample_dataset("climate", dims);
    const Lattice lattice = *place_lattice(dataset->info().grid, {});
    for (const auto projection :
         {protocol::Projection::perspective, protocol::Projection::orthographic}) {
      for (const std::array<int, 2> size : {std::array<int, 2>{1280, 720}, {300, 900}}) {
        protocol::View view;
        view.camera.projection = projection;
        view.image.width = size[0];
        view.image.height = size[1];
        complete_camera(view, lattice);
        const Camera camera = *resolve_camera(view, lattice);
        std::array<double, 2> low{1, 1};
        std::array<double, 2> high{-1, -1};
        for (int n = 0; n < 8; ++n) {
          const Pixel p = project(camera, {(n & 1) != 0 ? lattice.box_max.x : lattice.box_min.x,
                                           (n & 2) != 0 ? lattice.box_max.y : lattice.box_min.y,
                                           (n & 4) != 0 ? lattice.box_max.z : lattice.box_min.z});
          const std::array<double, 2> at{2 * p.x / size[0] - 1, 2 * p.y / size[1] - 1};
          for (std::size_t a = 0; a < 2; ++a) {
            low[a] = std::min(low[a], at[a]);
            high[a] = std::max(high[a], at[a]);
          }
        }
        EXPECT_NEAR(low[0], -high[0], 1e-6);
        EXPECT_NEAR(low[1], -high[1], 1e-6);
        EXPECT_NEAR(std::max(high[0], high[1]), 1 / 1.04, 1e-6);
      }
    }
  }
}

// The outline of a box that is x wide and seen from elevation e is y sin e + z cos e high.
TEST(Camera, DefaultElevationGivesTheOutlineTheShapeOfThePicture) {
  Lattice lattice;
  protocol::ImageView image;
  image.width = 1600;
  image.height = 900;
  const auto elevation = [&](double x, double y, double z) {
    lattice.box_max = 0.5 * glm::dvec3(x, y, z);
    lattice.box_min = -lattice.box_max;
    return front_elevation(lattice, image);
  };
  const double e = elevation(2, 1.5, 0.1);
  EXPECT_GT(e, default_elevation);
  EXPECT_LT(e, steepest_elevation);
  const double radians = e * std::acos(-1.0) / 180;
  EXPECT_NEAR(1.5 * std::sin(radians) + 0.1 * std::cos(radians), 2 * 0.5625, 1e-9);
  EXPECT_EQ(elevation(2, 1, 0.1), steepest_elevation);  // too flat to fill the picture
  EXPECT_EQ(elevation(1, 1, 1), default_elevation);     // fills more than the picture
  lattice.inner_radius = 0.5;
  EXPECT_EQ(elevation(2, 1, 0.1), default_elevation);  // a globe
}

TEST(Orbit, ZoomTwoRendersTheCenterTwiceAsLarge) {
  auto dataset = atmosphere();
  const Lattice lattice = *place_lattice(dataset->info().grid, {});
  for (const auto projection :
       {protocol::Projection::perspective, protocol::Projection::orthographic}) {
    std::array<double, 2> offset{};
    for (int n = 0; n < 2; ++n) {
      protocol::View view;
      view.camera.projection = projection;
      orbit(view, lattice, 0, 0, 1 + n);
      const Camera camera = *resolve_camera(view, lattice);
      offset[static_cast<std::size_t>(n)] = project(camera, {1e-4, 0, 0}).x - 640.0;
    }
    EXPECT_NEAR(offset[1] / offset[0], 2.0, 1e-6);
  }
}

std::string pointer_of(const Result<CompletedView>& result) {
  if (result) return "accepted";
  if (result.error().kind != ErrorKind::invalid || result.error().at.empty()) return "other error";
  return result.error().at[0].pointer;
}

TEST(Camera, InvalidCamerasAreRefusedByName) {
  auto dataset = atmosphere();
  protocol::View view;
  view.camera.eye = protocol::Vec3{0, 0, 4};
  EXPECT_EQ(pointer_of(complete(view, *dataset)), "/camera/up");
  view.camera.up = {0, 0, -1e3};
  EXPECT_EQ(pointer_of(complete(view, *dataset)), "/camera/up");
  view.camera.up = {0, 0, 0};
  EXPECT_EQ(pointer_of(complete(view, *dataset)), "/camera/up");
  view.camera.up = {0, 1, 0};
  EXPECT_EQ(pointer_of(complete(view, *dataset)), "accepted");
  view.camera.target = view.camera.eye;
  EXPECT_EQ(pointer_of(complete(view, *dataset)), "/camera/eye");
}

// ---- default cameras of slices and planes ----

struct Shown {
  std::string name;
  protocol::GeometryView geometry;
  glm::dvec3 forward;  // expected
  std::vector<glm::dvec3> corners;
};

// The box reaches to 1, 0.75 and 0.15.
std::vector<Shown> shown_sections() {
  using protocol::GridAxis;
  std::vector<Shown> out;
  const auto slice = [&](GridAxis axis, double index, const glm::dvec3& forward) {
    out.push_back({"slice " + std::to_string(out.size()), {}, forward, {}});
    out.back().geometry.slice = protocol::SliceView{axis, index};
  };
  const auto corners = [&](const glm::dvec3& a, const glm::dvec3& b) {
    for (const double x : {a.x, b.x}) {
      for (const double y : {a.y, b.y}) {
        for (const double z : {a.z, b.z}) out.back().corners.emplace_back(x, y, z);
      }
    }
  };
  slice(GridAxis::x, 0, {-1, 0, 0});
  corners({-0.75, -0.75, -0.15}, {-0.75, 0.75, 0.15});
  slice(GridAxis::y, 2, {0, 1, 0});
  corners({-1, 0.5, -0.15}, {1, 0.5, 0.15});
  slice(GridAxis::y, 0.5, {0, 1, 0});
  corners({-1, -0.25, -0.15}, {1, -0.25, 0.15});
  for (const bool turned : {false, true}) {
    out.push_back({"plane", {}, glm::normalize(glm::dvec3(1, 1, 0)), {}});
    const double sign = turned ? -2 : 1;
    out.back().geometry.plane = protocol::PlaneView{{0.1, 0.1, 0}, {sign, sign, 0}};
    for (const double z : {-0.15, 0.15}) {
      out.back().corners.emplace_back(-0.55, 0.75, z);
      out.back().corners.emplace_back(0.95, -0.75, z);
    }
  }
  slice(GridAxis::z, 0, {0, 0, -1});
  return out;
}

TEST(Camera, DefaultFacesTheSliceOrPlaneWithTheUsualMargin) {
  auto dataset = atmosphere();
  const Lattice lattice = *place_lattice(dataset->info().grid, {});
  ASSERT_NEAR(lattice.box_max.y, 0.75, 1e-12);
  ASSERT_NEAR(lattice.box_max.z, 0.15, 1e-12);
  for (Shown shown : shown_sections()) {
    if (shown.corners.empty()) {
      for (const double x : {-1, 1}) {
        for (const double y : {-0.75, 0.75}) {
          shown.corners.emplace_back(x, y, lattice.positions[2][0]);
        }
      }
    }
    for (const auto projection :
         {protocol::Projection::perspective, protocol::Projection::orthographic}) {
      protocol::View view;
      view.geometry = shown.geometry;
      view.camera.projection = projection;
      const auto full = complete(view, *dataset);
      ASSERT_TRUE(full) << shown.name;
      const Camera& camera = full->camera();
      EXPECT_NEAR(glm::length(camera.forward - shown.forward), 0, 1e-9) << shown.name;
      const glm::dvec3 up = shown.forward.z == 0 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
      EXPECT_NEAR(glm::length(camera.up - up), 0, 1e-9) << shown.name;
      double widest = 0;
      for (const glm::dvec3& corner : shown.corners) {
        const Pixel at = project(camera, corner);
        widest = std::max({widest, std::abs(at.x / 640 - 1), std::abs(at.y / 360 - 1)});
      }
      EXPECT_NEAR(widest, 1 / 1.04, 1e-6) << shown.name;
      auto preset = full->view();
      preset.camera.eye = protocol::Vec3{3, 3, 3};
      preset.camera.up = {0, 1, 1};
      ASSERT_TRUE(apply_preset(preset, lattice, "default"));
      EXPECT_EQ(preset.camera, full->view().camera) << shown.name;
    }
  }
}

// Ground and ticks lie on the floor of the box, or at its other sides, not in the slice.
TEST(Camera, DefaultShowsPointsBeforeAndBehindAFacedSliceAtItsPlaces) {
  auto dataset = atmosphere();
  const Lattice lattice = *place_lattice(dataset->info().grid, {});
  for (const Shown& shown : shown_sections()) {
    protocol::View view;
    view.geometry = shown.geometry;
    const auto full = complete(view, *dataset);
    ASSERT_TRUE(full) << shown.name;
    EXPECT_EQ(full->view().camera.projection, protocol::Projection::orthographic) << shown.name;
    const glm::dvec3 depth = lattice.box_max.z * shown.forward;
    for (const glm::dvec3& corner : {lattice.box_min, lattice.box_max}) {
      const Pixel at = project(full->camera(), corner);
      for (const glm::dvec3& other : {corner - depth, corner + depth}) {
        const Pixel beyond = project(full->camera(), other);
        EXPECT_NEAR(at.x, beyond.x, 1e-6) << shown.name;
        EXPECT_NEAR(at.y, beyond.y, 1e-6) << shown.name;
      }
    }
  }
}

TEST(Camera, AnotherViewIsInPerspectiveUnlessItStatesAProjection) {
  auto dataset = atmosphere();
  const auto projection_of = [&](const protocol::View& view) {
    return complete(view, *dataset).value().view().camera.projection.value();
  };
  using protocol::Projection;
  EXPECT_EQ(projection_of({}), Projection::perspective);
  protocol::View slice;
  slice.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 1};
  protocol::View aside = slice;
  aside.camera.eye = protocol::Vec3{0.3, -2, 1};
  EXPECT_EQ(projection_of(aside), Projection::perspective);
  protocol::View globe = slice;
  globe.geometry.mapping = protocol::GeometryMapping::sphere;
  EXPECT_EQ(projection_of(globe), Projection::perspective);
  slice.camera.projection = Projection::perspective;
  EXPECT_EQ(projection_of(slice), Projection::perspective);
  protocol::View whole;
  whole.camera.projection = Projection::orthographic;
  EXPECT_EQ(projection_of(whole), Projection::orthographic);
}

TEST(Camera, DefaultFacesDataOfOneSampleAlongOneAxis) {
  const auto forward = [](const std::array<int, 3>& dims, protocol::GeometryView geometry) {
    auto dataset = sample_dataset("climate", dims);
    protocol::View view;
    view.geometry = std::move(geometry);
    const Lattice lattice = *place_lattice(dataset->info().grid, view.geometry);
    complete_camera(view, lattice);
    const Camera camera = *resolve_camera(view, lattice);
    return std::array{camera.forward, camera.up};
  };
  const auto [down, north] = forward({16, 8, 1}, {});
  EXPECT_NEAR(glm::length(down - glm::dvec3(0, 0, -1)), 0, 1e-12);
  EXPECT_NEAR(glm::length(north - glm::dvec3(0, 1, 0)), 0, 1e-12);
  const auto [west, up] = forward({1, 8, 16}, {});
  EXPECT_NEAR(glm::length(west - glm::dvec3(-1, 0, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(up - glm::dvec3(0, 0, 1)), 0, 1e-12);
  const auto [along, still_up] = forward({16, 1, 8}, {});
  EXPECT_NEAR(glm::length(along - glm::dvec3(0, 1, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(still_up - glm::dvec3(0, 0, 1)), 0, 1e-12);
  protocol::GeometryView terrain;
  terrain.height_field = "orography";
  EXPECT_GT(forward({16, 8, 1}, terrain)[0].y, 0.5);
  EXPECT_GT(forward({16, 1, 1}, {})[0].y, 0.5);  // a row faces no side
}

TEST(Camera, ADirectionUpAlongTheNormalOfASliceIsReplaced) {
  auto dataset = atmosphere();
  for (const auto axis : {protocol::GridAxis::x, protocol::GridAxis::y, protocol::GridAxis::z}) {
    for (const double sign : {-1.0, 1.0}) {
      protocol::View view;
      view.geometry.slice = protocol::SliceView{axis, 1};
      const auto a = static_cast<int>(axis);
      view.camera.up = {0, 0, 0};
      view.camera.up.at(static_cast<std::size_t>(a)) = sign;
      const auto full = complete(view, *dataset);
      ASSERT_TRUE(full) << a << ' ' << full.error().message;
      EXPECT_NEAR(std::abs(full->camera().forward[a]), 1, 1e-9);
      EXPECT_NEAR(full->camera().up[a == 2 ? 1 : 2], 1, 1e-9) << a;
    }
  }
}

TEST(Camera, StatedPartsAreKeptWithASlice) {
  auto dataset = atmosphere();
  const auto camera_of = [&](const protocol::View& view) {
    return complete(view, *dataset).value().view().camera;
  };
  for (int stated = 0; stated < 2; ++stated) {
    protocol::View view;
    (stated == 0 ? view.camera.eye : view.camera.target) = protocol::Vec3{0.3, -2, 1};
    const auto whole = camera_of(view);
    view.geometry.slice = protocol::SliceView{protocol::GridAxis::x, 1};
    EXPECT_EQ(camera_of(view), whole);
  }
  protocol::View view;
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 1};
  view.camera.up = {1, 0, 0.5};
  view.camera.height = 0.7;
  EXPECT_EQ(camera_of(view).up, view.camera.up);
  EXPECT_EQ(camera_of(view).height, view.camera.height);
  EXPECT_NEAR(complete(view, *dataset)->camera().up.x, 1, 1e-9);
}

// It has no normal.
TEST(Camera, DefaultShowsTheWholeGlobeWithASlice) {
  auto dataset = atmosphere();
  protocol::View view;
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  const auto whole = complete(view, *dataset)->view().camera;
  for (const auto axis : {protocol::GridAxis::x, protocol::GridAxis::y, protocol::GridAxis::z}) {
    view.geometry.slice = protocol::SliceView{axis, 1};
    EXPECT_EQ(complete(view, *dataset)->view().camera, whole);
  }
}

TEST(DepthCue, EndsAtTheNearestAndFarthestCornersOfTheBox) {
  auto dataset = atmosphere();
  protocol::View view;
  view.camera.eye = protocol::Vec3{0, -5, 0};
  view.depth_cue.strength = 0.4;
  Scene scene = default_scene(*dataset, view);
  // Looking along y at a box that reaches from -0.75 to 0.75.
  EXPECT_NEAR(scene.depth_cue.near, 4.25, 1e-12);
  EXPECT_NEAR(scene.depth_cue.far, 5.75, 1e-12);
  EXPECT_EQ(scene.depth_cue.strength, 0.4);
  view.depth_cue.near = 0.5;
  view.depth_cue.far = 2.0;
  scene = default_scene(*dataset, view);
  EXPECT_NEAR(scene.depth_cue.near, 5.0, 1e-12);
  EXPECT_NEAR(scene.depth_cue.far, 7.25, 1e-12);
}

}  // namespace
}  // namespace windsplat::scene
