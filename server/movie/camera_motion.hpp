// How the camera moves during an animation: a turn about the vertical, or a path through keyframes.
#pragma once

#include <vector>

#include "protocol/camera_path.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::movie {

// Eye, target and upward direction turned about the vertical axis (world z) through `centre`: a
// positive angle moves the eye eastward, as in orbits. Needs eye and target. With frame n of N at
// n / N of an angle of 360 degrees a movie repeats without a jump. scene::turn_of() chooses camera
// and centre.
protocol::CameraView turned(const protocol::CameraView& camera, double degrees,
                            const protocol::Vec3& centre);

// A smooth path (docs/user/command-line.md, "Paths of the camera"). Eye and target follow a
// centripetal Catmull-Rom spline (Yuksel, Schaefer and Keyser 2011, On the parameterization of
// Catmull-Rom curves) with common knots, which it passes at the times of the keyframes by a
// monotone cubic of time (Fritsch and Butland 1984), so that its velocity is continuous. The
// logarithms of the height of the picture, or of tan(fovY / 2), and the upward directions change
// linearly between keyframes.
class CameraPath {
 public:
  // Errors: invalid for opposite upward directions of neighbours.
  static Result<CameraPath> of(protocol::CameraPath path);

  // The camera at that second or step; before the first and after the last keyframe that of it.
  // Errors: invalid where the eye meets the target, or looks along its upward direction.
  [[nodiscard]] Result<protocol::CameraView> at(double position) const;

  [[nodiscard]] protocol::CameraPath::Unit unit() const { return path_.unit; }
  [[nodiscard]] double first() const { return path_.keyframes.front().at; }
  [[nodiscard]] double last() const { return path_.keyframes.back().at; }

 private:
  protocol::CameraPath path_;
  std::vector<double> knots_;   // of the spline, one for each keyframe
  std::vector<double> speeds_;  // of the knot, at each keyframe
};

}  // namespace windsplat::movie
