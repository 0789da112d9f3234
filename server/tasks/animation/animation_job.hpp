// Draws an animation: each picture is loaded by the job's thread, drawn by the renderer between
// other work, and added to a file without a name.
#pragma once

#include <memory>
#include <string>

#include "protocol/animation/animation.hpp"
#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/movie/motion.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/jobs.hpp"

namespace windsplat::tasks {

struct AnimationWork {
  protocol::View view;
  protocol::AnimationFormat format = protocol::AnimationFormat::mp4;
  movie::Motion motion;
  std::shared_ptr<data::Dataset> dataset;
  std::string text;        // that decides all of this, of which the id is made
  std::string payer = {};  // address charged with the drawing
  std::string base_path = {};
  double picture_ms = 0;  // estimate of the time for one
};

// Returns at once if it is kept already, otherwise blocks until it is finished. Cancellation takes
// effect within about a tenth of a second, except while loading; no file remains. Errors:
// cancelled; too_large above protocol::limits::animation_bytes_max; busy after
// Animations::render_s_max; those of frame::complete(), prepare_picture() and movie::Writer.
Result<protocol::JobResult> draw_animation(Backend& backend, const AnimationWork& work,
                                           const Jobs::Handle& handle);

}  // namespace windsplat::tasks
