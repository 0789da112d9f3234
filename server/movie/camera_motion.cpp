#include "server/movie/camera_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <string>
#include <utility>

namespace windsplat::movie {
namespace {

constexpr double radians_per_degree = std::numbers::pi / 180;
constexpr double parallel_sine = 1e-6;  // least sine of the angle between up and view direction

glm::dvec3 to_glm(const protocol::Vec3& v) { return {v[0], v[1], v[2]}; }
protocol::Vec3 from_glm(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

// Eye and target as one point of a spline.
struct Place {
  glm::dvec3 eye, target;
  friend Place operator+(const Place& a, const Place& b) {
    return {a.eye + b.eye, a.target + b.target};
  }
  friend Place operator-(const Place& a, const Place& b) {
    return {a.eye - b.eye, a.target - b.target};
  }
  friend Place operator*(double s, const Place& a) { return {s * a.eye, s * a.target}; }
};

Place place_of(const protocol::CameraKeyframe& keyframe) {
  return {to_glm(*keyframe.camera.eye), to_glm(*keyframe.camera.target)};
}

double distance(const Place& a, const Place& b) {
  return std::hypot(glm::length(b.eye - a.eye), glm::length(b.target - a.target));
}

// The cubic with these values and slopes at the ends of an interval of length h, at u of it.
template <class Value>
Value hermite(const Value& from, const Value& slope_from, const Value& to, const Value& slope_to,
              double h, double u) {
  const double u2 = u * u;
  const double u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * from + (h * (u3 - 2 * u2 + u)) * slope_from +
         (3 * u2 - 2 * u3) * to + (h * (u3 - u2)) * slope_to;
}

// The slope in the middle of three points of a Catmull-Rom spline, by the derivative of the
// parabola through them.
Place slope_of(const Place& before, const Place& here, const Place& after, double a, double b) {
  return (1 / a) * (here - before) - (1 / (a + b)) * (after - before) + (1 / b) * (after - here);
}

// Slopes of a monotone cubic (Fritsch and Butland 1984): weighted harmonic means, and 0 beside an
// interval in which nothing moves.
std::vector<double> monotone_slopes(const std::vector<protocol::CameraKeyframe>& keyframes,
                                    const std::vector<double>& knots) {
  const std::size_t last = knots.size() - 1;
  const auto length = [&](std::size_t i) { return keyframes[i + 1].at - keyframes[i].at; };
  const auto slope = [&](std::size_t i) { return (knots[i + 1] - knots[i]) / length(i); };
  std::vector<double> out(knots.size());
  out.front() = slope(0);
  out.back() = slope(last - 1);
  for (std::size_t i = 1; i < last; ++i) {
    const double before = slope(i - 1);
    const double after = slope(i);
    if (!(before > 0) || !(after > 0)) continue;
    const double w1 = 2 * length(i) + length(i - 1);
    const double w2 = length(i) + 2 * length(i - 1);
    out[i] = (w1 + w2) / (w1 / before + w2 / after);
  }
  return out;
}

// The value at u between two whose logarithms are interpolated.
double between_sizes(double from, double to, double u) {
  return std::exp(std::lerp(std::log(from), std::log(to), u));
}

double half_slope(double fov_y) { return std::tan(0.5 * fov_y * radians_per_degree); }

std::string position_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace

protocol::CameraView turned(const protocol::CameraView& camera, double degrees,
                            const protocol::Vec3& centre) {
  protocol::CameraView out = camera;
  const double angle = std::fmod(degrees, 360.0) * radians_per_degree;
  if (angle == 0) return out;  // whole turns are exact
  const auto turn = [&](const glm::dvec3& v) {
    return glm::dvec3(v.x * std::cos(angle) - v.y * std::sin(angle),
                      v.x * std::sin(angle) + v.y * std::cos(angle), v.z);
  };
  const glm::dvec3 axis = to_glm(centre);
  out.eye = from_glm(axis + turn(to_glm(camera.eye.value()) - axis));
  out.target = from_glm(axis + turn(to_glm(camera.target.value()) - axis));
  out.up = from_glm(turn(to_glm(camera.up)));
  return out;
}

Result<CameraPath> CameraPath::of(protocol::CameraPath path) {
  CameraPath out;
  out.path_ = std::move(path);
  auto& keyframes = out.path_.keyframes;
  constexpr double opposite_cosine = -0.9998;  // 1.1 degrees
  out.knots_.push_back(0);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    keyframes[i].camera.up = from_glm(glm::normalize(to_glm(keyframes[i].camera.up)));
    if (i == 0) continue;
    const glm::dvec3 up = to_glm(keyframes[i].camera.up);
    if (glm::dot(up, to_glm(keyframes[i - 1].camera.up)) < opposite_cosine) {
      return make_error_at(ErrorKind::invalid, "/keyframes/" + std::to_string(i) + "/camera/up",
                           "is opposite to that of the keyframe before: add one between them");
    }
    out.knots_.push_back(out.knots_.back() +
                         std::sqrt(distance(place_of(keyframes[i - 1]), place_of(keyframes[i]))));
  }
  out.speeds_ = monotone_slopes(keyframes, out.knots_);
  return out;
}

Result<protocol::CameraView> CameraPath::at(double position) const {
  const auto& keyframes = path_.keyframes;
  const auto after = std::upper_bound(
      keyframes.begin(), keyframes.end(), position,
      [](double at, const protocol::CameraKeyframe& keyframe) { return at < keyframe.at; });
  if (after == keyframes.begin()) return keyframes.front().camera;
  if (after == keyframes.end()) return keyframes.back().camera;
  const auto i = static_cast<std::size_t>(after - keyframes.begin()) - 1;
  const protocol::CameraView& from = keyframes[i].camera;
  const protocol::CameraView& to = keyframes[i + 1].camera;
  const double h = keyframes[i + 1].at - keyframes[i].at;
  double u = (position - keyframes[i].at) / h;
  const double length = knots_[i + 1] - knots_[i];
  protocol::CameraView out = from;
  if (length > 0) {
    const double knot = hermite(knots_[i], speeds_[i], knots_[i + 1], speeds_[i + 1], h, u);
    u = std::clamp((knot - knots_[i]) / length, 0.0, 1.0);
    const Place one = place_of(keyframes[i]);
    const Place two = place_of(keyframes[i + 1]);
    // At the ends of the path, and beside a keyframe at the same place, the straight line.
    const Place line = (1 / length) * (two - one);
    const double before = i > 0 ? knots_[i] - knots_[i - 1] : 0;
    const double next = i + 2 < knots_.size() ? knots_[i + 2] - knots_[i + 1] : 0;
    const Place slope_one =
        before > 0 ? slope_of(place_of(keyframes[i - 1]), one, two, before, length) : line;
    const Place slope_two =
        next > 0 ? slope_of(one, two, place_of(keyframes[i + 2]), length, next) : line;
    const Place place = hermite(one, slope_one, two, slope_two, length, u);
    out.eye = from_glm(place.eye);
    out.target = from_glm(place.target);
  }
  out.fov_y = 2 * std::atan(between_sizes(half_slope(from.fov_y), half_slope(to.fov_y), u)) /
              radians_per_degree;
  if (from.height && to.height) out.height = between_sizes(*from.height, *to.height, u);
  const glm::dvec3 up = glm::normalize((1 - u) * to_glm(from.up) + u * to_glm(to.up));
  out.up = from_glm(up);
  const glm::dvec3 forward = to_glm(*out.target) - to_glm(*out.eye);
  if (!(glm::length(glm::cross(forward, up)) > parallel_sine * glm::length(forward))) {
    return make_error(ErrorKind::invalid,
                      "the path of the camera at " + position_text(position) +
                          (unit() == protocol::CameraPath::Unit::steps ? " (step)" : " s") +
                          ": the eye is at the target, or looks along its upward direction");
  }
  return out;
}

}  // namespace windsplat::movie
