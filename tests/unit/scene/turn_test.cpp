// The camera of a turn: the whole box stays in the picture.
#include "server/scene/defaults/turn.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "server/scene/camera.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

std::unique_ptr<data::Dataset> turned_atmosphere() {
  return dataset_of(std::make_unique<FakeSource>(atmosphere_grid(),
                                                 std::vector<data::FieldInfo>{wind_info()}, 1));
}

// The largest distance of the corners of the box from the middle of the picture, in halves of its
// width or height: the box turned by -angle before the resting camera.
double farthest_corner(const Turn& turn, const CompletedView& completed, double degrees) {
  protocol::View view = completed.view();
  view.camera = turn.camera;
  const auto camera = resolve_camera(view, completed.lattice());
  EXPECT_TRUE(camera);
  const Lattice& lattice = completed.lattice();
  const glm::dvec3 centre(turn.centre[0], turn.centre[1], turn.centre[2]);
  const double a = -degrees * std::numbers::pi / 180;
  double most = 0;
  for (unsigned n = 0; n < 8; ++n) {
    const glm::dvec3 p = glm::dvec3((n & 1U) != 0 ? lattice.box_max.x : lattice.box_min.x,
                                    (n & 2U) != 0 ? lattice.box_max.y : lattice.box_min.y,
                                    (n & 4U) != 0 ? lattice.box_max.z : lattice.box_min.z) -
                         centre;
    const glm::dvec3 turned(p.x * std::cos(a) - p.y * std::sin(a),
                            p.x * std::sin(a) + p.y * std::cos(a), p.z);
    const glm::dvec3 seen = centre + turned - camera->eye;
    const double depth = glm::dot(seen, camera->forward);
    const double half = camera->perspective ? depth * camera->half_height : camera->half_height;
    const double aspect = static_cast<double>(camera->width) / camera->height;
    most = std::max<double>({most, std::abs(glm::dot(seen, camera->right)) / half / aspect,
                             std::abs(glm::dot(seen, camera->up)) / half});
  }
  return most;
}

TEST(Turn, TheDefaultCameraShowsTheWholeBoxFromEveryAngle) {
  for (const auto projection :
       {protocol::Projection::perspective, protocol::Projection::orthographic}) {
    auto dataset = turned_atmosphere();
    protocol::View view;
    view.camera.projection = projection;
    view.geometry.scale = {3, 1, 1};  // much wider from the south than from the east
    const auto completed = complete(view, *dataset);
    ASSERT_TRUE(completed) << completed.error().message;
    const Turn turn = turn_of(view, *completed, 360);
    const Turn resting{completed->view().camera, turn.centre};
    double most = 0;
    double without = 0;
    for (int degrees = 0; degrees <= 360; degrees += 3) {
      most = std::max(most, farthest_corner(turn, *completed, degrees));
      without = std::max(without, farthest_corner(resting, *completed, degrees));
    }
    EXPECT_LE(most, 1);
    EXPECT_GE(most, 0.7) << "and no farther away than that needs";
    EXPECT_GT(without, 1.02) << "the default camera would not";
  }
}

TEST(Turn, ASmallTurnHardlyMovesAwayAndAStatedCameraStays) {
  auto dataset = turned_atmosphere();
  protocol::View view;
  const auto completed = complete(view, *dataset);
  ASSERT_TRUE(completed);
  const auto distance = [](const protocol::CameraView& camera) {
    return std::hypot((*camera.eye)[0] - (*camera.target)[0],
                      (*camera.eye)[1] - (*camera.target)[1],
                      (*camera.eye)[2] - (*camera.target)[2]);
  };
  EXPECT_LT(distance(turn_of(view, *completed, 1).camera),
            1.02 * distance(completed->view().camera));
  view.camera.eye = {0, -2, 1};
  view.camera.target = {0.3, 0, 0};
  const auto stated = complete(view, *dataset);
  ASSERT_TRUE(stated);
  const Turn turn = turn_of(view, *stated, 360);
  EXPECT_EQ(turn.camera, stated->view().camera);
  EXPECT_EQ(turn.centre, (protocol::Vec3{0.3, 0, 0}));
}

}  // namespace
}  // namespace windsplat::scene
