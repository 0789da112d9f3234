// Chooses setting and encoding of each frame from the limits of the view, the measured times and
// the link.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>

#include "protocol/view.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/setting.hpp"
#include "server/session/effects.hpp"
#include "server/session/pacing/chooser.hpp"
#include "server/session/pacing/frame_times.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/pacing/moving_encoding.hpp"
#include "server/session/pacing/render_slot.hpp"
#include "server/session/pacing/video_choice.hpp"
#include "server/session/view_state.hpp"

namespace windsplat::session {

// How to render one frame.
struct FramePlan {
  quality::Setting setting;
  Encoding encoding;
};

class QualityControl {
 public:
  QualityControl(Forecaster forecaster, TimeByWork time_by_work, Waiting waiting, MayTry may_try)
      : times_(std::move(forecaster), std::move(time_by_work)),
        waiting_(std::move(waiting)),
        may_try_(std::move(may_try)) {}

  [[nodiscard]] FramePlan moving(const protocol::View& view, const Link& link, VideoChoice& video,
                                 Micros now);
  // Refinement before the final frame: at most half of `shown_error`, that of the frame displayed,
  // at a fraction of the final time. nullopt: draw the final frame next.
  [[nodiscard]] std::optional<FramePlan> refining(const protocol::View& view, const Link& link,
                                                  double shown_error, Micros now) const;
  // The view as specified, whatever was shown before; with thinner slabs if its error would exceed
  // maxError. Frames before it are never finer.
  [[nodiscard]] FramePlan final_frame(const protocol::View& view) const;
  [[nodiscard]] static FramePlan still(const protocol::View& view, bool png);

  // Whether a final frame is expected within the budget of a moving one.
  [[nodiscard]] bool final_is_cheap(const protocol::View& view, Micros now) const;
  // Encoding of the last moving frame.
  [[nodiscard]] const quality::Setting& moving_setting() const { return moving_setting_; }

  void on_view_changed(bool other_dataset);
  // Learns times only from frames drawn without loading, for which nothing stands in.
  void learn(const Render& render, const Drawn& drawn, const ViewState& state, Micros now);
  // Records that a frame is sent; `text_bytes` precede it.
  void learn_bytes(const Render& render, const Drawn& drawn, std::size_t frame_bytes,
                   std::size_t text_bytes);
  // Whether a frame drawn as final exceeds maxError and thinner slabs are possible: the next one
  // then has thinner slabs.
  [[nodiscard]] bool needs_thinner_slabs(const Render& render, const Drawn& drawn,
                                         const ViewState& state);

 private:
  [[nodiscard]] quality::Aim aim(const protocol::View& view) const;
  [[nodiscard]] double waited_us() const;  // recently, by a moving frame for the renderer
  [[nodiscard]] quality::Setting final_setting(const protocol::View& view) const;

  FrameTimes times_;
  Waiting waiting_;
  MayTry may_try_;
  Chooser chooser_;
  MovingEncoding encoding_;
  quality::Setting moving_setting_;  // the last one chosen
  std::optional<double> queue_us_;   // recent waiting time of moving frames for the renderer
  protocol::QualityView limits_;     // of the last moving frame
  int thinner_ = 0;                  // number of halvings of the final frame's slabs for maxError
  double thicker_error_ = 0;         // measured before the last halving
};

}  // namespace windsplat::session
