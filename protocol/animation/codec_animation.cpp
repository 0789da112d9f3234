// The request of an animation: JSON -> typed values.
#include <array>
#include <string>

#include "protocol/animation/animation.hpp"
#include "protocol/codec_json.hpp"
#include "protocol/view/codec_camera.hpp"

namespace windsplat::protocol {
namespace {

constexpr std::array<Name<AnimationFormat>, 3> movie_format_names{{
    {AnimationFormat::mp4, "mp4"},
    {AnimationFormat::webm, "webm"},
    {AnimationFormat::zip, "zip"},
}};

// The reader of views reads whole documents, whose pointers begin at the view.
View read_view_below(const Json& json, const std::string& pointer, Faults& faults) {
  Faults of_view;
  View view = read_view(json, of_view);
  if (of_view.empty()) return view;
  const Error error = of_view.error();
  for (const FieldError& each : error.at)
    faults.add(pointer + each.pointer, each.detail, error.kind);
  return view;
}

StepRange read_steps(const Json& json, const std::string& pointer, Faults& faults) {
  StepRange steps;
  ObjectReader reader(json, pointer, faults);
  reader.integer("first", steps.first, {0, limits::step_max});
  reader.integer("last", steps.last, {0, limits::step_max});
  reader.integer("stride", steps.stride, {1, limits::step_max});
  reader.finish();
  if (steps.last && *steps.last < steps.first) {
    faults.add(reader.at("last"), "must not be before the first step");
  }
  return steps;
}

AnimationMotion read_motion(ObjectReader& reader) {
  AnimationMotion motion;
  if (const Json* steps = reader.child("steps")) {
    motion.steps = read_steps(*steps, reader.at("steps"), reader.faults());
  }
  reader.integer("frames", motion.frames, {1, motion_frames_max});
  reader.integer("perStep", motion.per_step, {1, frames_per_step_max});
  reader.number("fps", motion.fps, {animation_fps_min, animation_fps_max});
  reader.number("turn", motion.turn, {-turn_max, turn_max});
  if (const Json* path = reader.child("path", Presence::optional, Null::is_default)) {
    motion.path = read_camera_path(*path, reader.at("path"), reader.faults());
  }
  if (motion.frames && motion.per_step) {
    reader.faults().add(reader.at("perStep"), "excludes frames: state one of them");
  }
  if (motion.turn && motion.path) {
    reader.faults().add(reader.at("path"), "excludes turn: the camera has one motion");
  }
  return motion;
}

}  // namespace

Result<AnimationRequest> parse_animation_request(std::string_view json) {
  const auto tree = parse_json(json);
  if (!tree) return tree.error();
  Faults faults;
  AnimationRequest out;
  ObjectReader reader(*tree, "", faults);
  if (const Json* view = reader.child("view", Presence::required)) {
    out.view = read_view_below(*view, reader.at("view"), faults);
  }
  reader.choice("format", out.format, movie_format_names);
  out.motion = read_motion(reader);
  reader.finish();
  if (!faults.empty()) return faults.error();
  return out;
}

}  // namespace windsplat::protocol
