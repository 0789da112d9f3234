#include "server/movie/motion.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

namespace windsplat::movie {
namespace {

constexpr int frames_of_a_turn = 120;  // of one step, without a number of frames

bool draws_lines(const protocol::View& view, const data::DatasetInfo& info) {
  using Kind = protocol::FieldChoice::Kind;
  const Kind kind = view.vector.field.kind;
  if (kind != Kind::dataset_default) return kind == Kind::named;
  return info.first(data::FieldKind::vector) != nullptr;
}

Error at_path(const Error& error) { return make_error_at(error.kind, "/path", error.message); }

}  // namespace

Result<void> check_size_is_fixed(const protocol::View& view) {
  if (!view.quality.budget_ms && !view.quality.max_error) return {};
  return make_error_at(ErrorKind::invalid, "/quality",
                       "limits on time or error may change the size of a picture, and those of a "
                       "movie have one size: set budgetMs and maxError to null");
}

Result<Motion> Motion::of(protocol::AnimationMotion asked, const protocol::View& view,
                          const data::DatasetInfo& info, int step_count, int frames_max) {
  Motion out;
  out.asked_ = std::move(asked);
  if (auto steps = out.choose_steps(step_count); !steps) return steps.error();
  out.fps_ = out.asked_.fps.value_or(out.fps_);
  if (out.asked_.path) {
    auto path = CameraPath::of(*out.asked_.path);
    if (!path) return at_path(path.error());
    out.path_ = std::move(*path);
  }
  if (auto frames = out.choose_frames(); !frames) return frames.error();
  const bool lines_move =
      view.vector.motion == protocol::MotionMode::phase && draws_lines(view, info);
  if (auto valid = out.check_effect(lines_move); !valid) return valid.error();
  const int looked_at = out.path_ && out.frames_ <= frames_max ? out.frames_ : 0;
  for (int n = 0; n < looked_at; ++n) {  // before an hour of drawing
    if (const auto camera = out.camera(n, {}); !camera) return at_path(camera.error());
  }
  return out;
}

int Motion::step_count() const {
  return (*asked_.steps.last - asked_.steps.first) / asked_.steps.stride + 1;
}

Result<void> Motion::choose_steps(int count) {
  protocol::StepRange& steps = asked_.steps;
  const int last = count - 1;
  if (!steps.last) steps.last = last;
  if (steps.first <= last && *steps.last <= last) return {};
  return make_error_at(ErrorKind::invalid, "/steps",
                       "the last step that can be shown is " + std::to_string(last));
}

bool Motion::is_by_time() const {
  return path_ && path_->unit() == protocol::CameraPath::Unit::seconds;
}

// Those asked for, or those of the path, or of the steps.
Result<void> Motion::choose_frames() {
  double count = static_cast<double>(step_count()) * asked_.per_step.value_or(1);
  if (asked_.frames) {
    count = *asked_.frames;
  } else if (!asked_.per_step && is_by_time()) {
    constexpr double rounding = 1e-9;
    count = std::floor(path_->last() * fps_ + rounding) + 1;
  } else if (!asked_.per_step && asked_.turn && step_count() == 1) {
    count = frames_of_a_turn;
  }
  if (count > protocol::motion_frames_max) {
    return make_error_at(
        ErrorKind::invalid, "/frames",
        "an animation has at most " + std::to_string(protocol::motion_frames_max) + " pictures");
  }
  frames_ = static_cast<int>(count);
  return {};
}

Result<void> Motion::check_effect(bool lines_move) const {
  if (asked_.turn || path_ || lines_move || frames_ <= step_count()) return {};
  const bool many = asked_.frames.has_value();
  return make_error_at(
      ErrorKind::invalid, many ? "/frames" : "/perStep",
      std::string(many ? "more pictures than steps would repeat them" : "has no effect") +
          " unless the view has lines and /vector/motion/mode=phase, or the "
          "camera moves by a turn or a path");
}

Result<scene::Turn> Motion::base(protocol::View view, const protocol::View& asked,
                                 const Complete& complete) const {
  if (!asked_.turn) return scene::Turn{view.camera, {}};
  view.step = asked_.steps.first;
  const auto completed = complete(view);
  if (!completed) return completed.error();
  return scene::turn_of(asked, *completed, *asked_.turn);
}

Moment Motion::moment(int frame) const {
  const std::int64_t at = static_cast<std::int64_t>(frame) * step_count();
  const std::int64_t index = at / frames_;
  return {asked_.steps.first + static_cast<int>(index) * asked_.steps.stride,
          static_cast<double>(at % frames_) / frames_};
}

Result<protocol::CameraView> Motion::camera(int frame, const scene::Turn& base) const {
  if (asked_.turn) return turned(base.camera, *asked_.turn * frame / frames_, base.centre);
  if (!path_) return base.camera;
  if (is_by_time()) return path_->at(frame / fps_);
  const Moment now = moment(frame);
  return path_->at(now.step + asked_.steps.stride * now.part);
}

Result<protocol::View> Motion::view_of(int frame, protocol::View view, const scene::Turn& base,
                                       bool keeps_step) const {
  const auto seen = camera(frame, base);
  if (!seen) return seen.error();
  const Moment now = moment(frame);
  view.camera = *seen;
  if (!keeps_step) view.step = now.step;
  view.vector.motion_time += asked_.steps.stride * now.part;
  return view;
}

}  // namespace windsplat::movie
