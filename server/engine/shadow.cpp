// Kernels as balls against the shadow of the body.
#include "server/engine/shadow.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "server/engine/places.hpp"

namespace windsplat::engine {

namespace {

// Right, down and forward of the eye.
using Point = std::array<double, 3>;

Point from_eye(const kernels::Camera& camera, const float* place) {
  Point point{};
  for (int a = 0; a < 3; ++a) {
    const double at = static_cast<double>(place[a]) - camera.eye[a];
    point[0] += at * camera.world_right[a];
    point[1] += at * camera.world_down[a];
    point[2] += at * camera.world_forward[a];
  }
  return point;
}

// Radius about its position within which a kernel lies.
double kernel_radius(const PassPlan& pass, double line_reach, bool splats) {
  const kernels::LineStyle& line = pass.kernel.line;
  double moved = 0;  // bound on the distance of a line's centre
  double square = 0;
  for (std::size_t a = 0; a < pass.edge_max.size(); ++a) {
    const double edge = pass.edge_max[a];
    moved += static_cast<double>(line.shift[a]) * edge;
    square += edge * edge;
  }
  const double lines = line_reach >= 0 ? line_reach + moved : 0;
  return std::max(lines, splats ? kernels::footprint_radius * std::sqrt(square) : 0) * 1.0001;
}

// The cone with its apex at the eye that touches the sphere, beyond the plane through the limb.
class Cone {
 public:
  Cone(const kernels::Body& body, double distance)
      : body_(body),
        distance_(distance),
        to_limb2_((distance - body.radius) * (distance + body.radius)) {}

  [[nodiscard]] bool holds(const Point& at, double margin) const {
    const double* centre = body_.centre;
    // Times the distance of the eye from the centre, along the axis.
    const double along = at[0] * centre[0] + at[1] * centre[1] + at[2] * centre[2];
    if (along - margin * distance_ < to_limb2_) return false;
    const double length2 = at[0] * at[0] + at[1] * at[1] + at[2] * at[2];
    const double away2 = length2 - along * along / (distance_ * distance_);
    // The half angle of the cone has the sine radius / distance.
    const double within = along / distance_ * body_.radius - margin * distance_;
    return within > 0 && within * within > away2 * to_limb2_;
  }

 private:
  const kernels::Body& body_;
  double distance_;
  double to_limb2_;
};

}  // namespace

bool Shadow::hides(const PassPlan& pass, const kernels::Brick& brick, double line_reach,
                   bool splats) const {
  if (body_.shape != kernels::body_sphere || pass.kernel.places == nullptr) return false;
  // Lines are wider than their segments, and pixels at the limb are not covered entirely.
  const double wide = line_reach >= 0 ? static_cast<double>(pass.kernel.line.outer) : 0.0;
  const double margin = (2.0 + wide) * body_.pixel;
  const double radius = kernel_radius(pass, line_reach, splats);
  const double* centre = body_.centre;
  if (camera_.perspective == 0) {
    const double within = body_.radius - radius - margin;
    return within > 0 && all_places(pass.kernel, brick, [&](const float* place) {
             const Point at = from_eye(camera_, place);
             const double x = at[0] - centre[0];
             const double y = at[1] - centre[1];
             return at[2] - centre[2] > radius && x * x + y * y < within * within;
           });
  }
  const double distance = std::hypot(centre[0], centre[1], centre[2]);
  // No ray enters the body before the near plane.
  const auto edge = static_cast<double>(std::hypot(camera_.half_width_px, camera_.half_height_px));
  const double oblique = std::hypot(1.0, body_.pixel * edge);
  if (distance - body_.radius < static_cast<double>(camera_.near) * oblique) return false;
  const Cone cone(body_, distance);
  return all_places(pass.kernel, brick, [&](const float* place) {
    const Point at = from_eye(camera_, place);
    return cone.holds(at, radius + margin * (std::max(at[2], 0.0) + radius));
  });
}

}  // namespace windsplat::engine
