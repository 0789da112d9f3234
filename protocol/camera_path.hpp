// A path of the camera through keyframes, as written by the user. Mirrors camera_path.schema.json.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

inline constexpr std::size_t keyframes_min = 2;
inline constexpr std::size_t keyframes_max = 200;
inline constexpr double keyframe_at_max = 1e6;  // seconds or steps

struct CameraKeyframe {
  double at = 0;
  // Complete: eye, target and projection are set, and height if the projection is orthographic.
  CameraView camera;
};

struct CameraPath {
  enum class Unit { seconds, steps };
  Unit unit = Unit::seconds;              // of CameraKeyframe::at
  std::vector<CameraKeyframe> keyframes;  // `at` increases; all have the same projection
};

// Errors: those of ViewDocument::parse(), with the pointer of each invalid value.
Result<CameraPath> parse_camera_path(std::string_view json);

}  // namespace windsplat::protocol
