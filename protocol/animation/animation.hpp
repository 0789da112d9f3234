// What an animation shows: its steps, its length and how its camera moves. Mirrors
// animationRequest in messages.schema.json.
#pragma once

#include <optional>
#include <string_view>

#include "protocol/camera_path.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

inline constexpr int motion_frames_max = 1000000;
inline constexpr int frames_per_step_max = 1000;
inline constexpr double turn_max = 36000;            // degrees
inline constexpr double animation_fps_min = 0.1;     // pictures a second
inline constexpr double animation_fps_max = 240;     // pictures a second
inline constexpr double animation_fps_default = 24;  // pictures a second

// Steps of the dataset: first, first + stride, ... up to last.
struct StepRange {
  int first = 0;
  std::optional<int> last;  // empty: the last one of the dataset
  int stride = 1;
};

// Absent values have the defaults of docs/user/command-line.md, "Movies".
struct AnimationMotion {
  StepRange steps;
  std::optional<int> frames;    // in all; not together with per_step
  std::optional<int> per_step;  // frames for each step
  std::optional<double> fps;    // pictures a second
  std::optional<double> turn;   // degrees about the vertical; not together with a path
  std::optional<CameraPath> path;
};

enum class AnimationFormat {
  mp4,   // H.264, 4:2:0, the index first, so that it plays while it is downloaded
  webm,  // VP9, 4:2:0
  zip,   // a PNG for each picture, frame_000000.png and so on: exact, and needs no other program
};

// The body of POST /v1/animations.
struct AnimationRequest {
  View view;
  AnimationFormat format = AnimationFormat::mp4;
  AnimationMotion motion;
};

// Errors: those of ViewDocument::parse(), with the pointer of each invalid value.
Result<AnimationRequest> parse_animation_request(std::string_view json);

}  // namespace windsplat::protocol
