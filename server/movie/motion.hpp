// What each picture of an animation shows: its step, the phase of its lines and its camera. Shared
// by `windsplat animate` and POST /v1/animations.
#pragma once

#include <functional>
#include <optional>

#include "protocol/animation/animation.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/movie/camera_motion.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/defaults/turn.hpp"

namespace windsplat::movie {

// What a picture shows: a step of the dataset, and the part of the way to the next one shown, in
// [0, 1), by which the phase of lines advances.
struct Moment {
  int step = 0;
  double part = 0;
};

// Whether a view has no limits of quality, which may change the size of a picture. Errors: invalid
// at /quality.
Result<void> check_size_is_fixed(const protocol::View& view);

class Motion {
 public:
  // Of `view` as asked for, whose dataset shows `step_count` steps. `info`: what its lines come
  // from. Errors: invalid with the pointer of a value that is not valid or has no effect, as in a
  // posted animation ("/perStep"); those of CameraPath::of() and at(), at /path. A path is
  // looked at only if there are at most `frames_max` pictures, since that takes time for each.
  static Result<Motion> of(protocol::AnimationMotion asked, const protocol::View& view,
                           const data::DatasetInfo& info, int step_count,
                           int frames_max = protocol::motion_frames_max);

  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] double fps() const { return fps_; }
  // Whether pictures a second decide what the pictures show.
  [[nodiscard]] bool is_by_time() const;

  // From where the camera moves; for a turn by `complete`, which gets the first picture's view.
  // `asked`: the view before defaults were filled in. Errors: those of `complete`.
  using Complete = std::function<Result<scene::CompletedView>(const protocol::View&)>;
  [[nodiscard]] Result<scene::Turn> base(protocol::View view, const protocol::View& asked,
                                         const Complete& complete) const;

  [[nodiscard]] Moment moment(int frame) const;
  // The view of a picture, from that of all of them and from where the camera moves. With
  // keeps_step its step stays. Errors: those of CameraPath::at().
  [[nodiscard]] Result<protocol::View> view_of(int frame, protocol::View view,
                                               const scene::Turn& base,
                                               bool keeps_step = false) const;

 private:
  Motion() = default;
  [[nodiscard]] int step_count() const;
  [[nodiscard]] Result<void> choose_steps(int count);
  [[nodiscard]] Result<void> choose_frames();
  [[nodiscard]] Result<void> check_effect(bool lines_move) const;
  [[nodiscard]] Result<protocol::CameraView> camera(int frame, const scene::Turn& base) const;

  protocol::AnimationMotion asked_;  // its steps have a last one
  int frames_ = 1;
  double fps_ = protocol::animation_fps_default;
  std::optional<CameraPath> path_;
};

}  // namespace windsplat::movie
