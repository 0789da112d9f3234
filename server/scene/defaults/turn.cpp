#include "server/scene/defaults/turn.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "server/scene/angles.hpp"
#include "server/scene/camera.hpp"

namespace windsplat::scene {
namespace {

constexpr double step_degrees = 5;  // between the cameras that are framed

glm::dvec3 as_glm(const protocol::Vec3& v) { return {v[0], v[1], v[2]}; }
protocol::Vec3 as_array(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

glm::dvec3 turned_by(const glm::dvec3& v, double degrees) {
  const double a = degrees * radians_per_degree;
  return {v.x * std::cos(a) - v.y * std::sin(a), v.x * std::sin(a) + v.y * std::cos(a), v.z};
}

// By how much the framing of the widest camera of the turn exceeds that of the first.
double widest(const CompletedView& completed, const OrbitFrame& first, const glm::dvec3& centre,
              double degrees) {
  const protocol::View& view = completed.view();
  const bool perspective = view.camera.projection != protocol::Projection::orthographic;
  const auto size_at = [&](double angle) {
    const OrbitFrame frame{turned_by(first.right, angle), turned_by(first.up, angle),
                           turned_by(first.forward, angle)};
    const Framing framing =
        frame_box(completed.lattice(), frame, centre, view.camera.fov_y, view.image);
    return perspective ? framing.distance : framing.height;
  };
  const double end = std::clamp(degrees, -360.0, 360.0);
  const int count = std::max(1, static_cast<int>(std::ceil(std::abs(end) / step_degrees)));
  const double size = size_at(0);
  double most = size;
  for (int n = 1; n <= count; ++n) most = std::max(most, size_at(end * n / count));
  return most / size;
}

}  // namespace

Turn turn_of(const protocol::View& asked, const CompletedView& completed, double degrees) {
  Turn turn{completed.view().camera, completed.view().camera.target.value()};
  if (asked.camera.eye || asked.camera.target) return turn;
  const Lattice& lattice = completed.lattice();
  const glm::dvec3 centre = 0.5 * (lattice.box_min + lattice.box_max);
  const glm::dvec3 eye = as_glm(turn.camera.eye.value());
  const glm::dvec3 target = as_glm(turn.camera.target.value());
  OrbitFrame frame{};
  frame.forward = glm::normalize(target - eye);
  frame.right = glm::normalize(glm::cross(frame.forward, as_glm(turn.camera.up)));
  frame.up = glm::cross(frame.right, frame.forward);
  const double more = widest(completed, frame, centre, degrees);
  const glm::dvec3 moved = centre + more * (target - centre);
  turn.camera.target = as_array(moved);
  turn.camera.eye = as_array(moved + more * (eye - target));
  if (turn.camera.height) turn.camera.height = more * *turn.camera.height;
  turn.centre = as_array(centre);
  return turn;
}

}  // namespace windsplat::scene
