// One session as a pure state machine: messages, frames and times in, effects out. Owns no socket,
// thread or clock.
//
// Pacing. One render at a time, started only while fewer than two frames are unacknowledged and
// none is being written, and always of the newest view, so that no outdated frames queue up. While
// the view changes, moving frames are drawn at the setting (resolution, detail, method) that the
// chooser finds for quality.budgetMs (33 ms if it and maxError are null, less under contention for
// the renderer) and quality.maxError. A moving frame is always finished and sent, even when the
// view has changed, so that a steady flow of patches cannot starve the client. After `quiet`
// without a change the view is refined: if its final frame takes a long time, first at settings
// with half the error of the frame shown; then as specified at high quality, with its error
// measured, flagged final. With maxError, slabs are halved until the measured error is within it.
// The next change cancels these renders. A calibration run is requested after the final frame.
//
// Data. A moving frame does not wait for data while coarser ones are in memory that can stand in
// for them (Drawn::info.detail.missingBytes), except in playback; the frames at rest wait for
// theirs, and are cancelled by the next change.
//
// The link. A render starts no sooner than its frame will find link and client free (link.hpp), so
// that it shows the newest view and does not queue. Quality and size of a moving frame follow the
// rate of the link (moving_encoding.hpp); a slow one gets H.264 (video_choice.hpp). Because a final
// frame blocks a slow link, the view must first be at rest for half the transfer time, up to
// `quiet_most`.
//
// A final frame remains valid for every later view with the same picture: an equivalent view, a
// return to it before another frame was sent, or another camera on a scene that is empty before and
// after. No frame is drawn or sent then, and `unchanged` names the patch's rev. Only a final frame
// proves that a scene is empty: an empty moving frame may be too coarse, so it is withheld and the
// final frame decides.
//
// Every accepted patch is answered by a frame of its rev or a later one, or by `unchanged`, even if
// a client repeats a rev.
//
// Stills. `still` draws the current view apart from the stream. Its picture is one binary frame of
// kind 1 with the final flag, codec png or jpeg, directly preceded by `progress` with the request's
// id, phase "still" and done 1, and the frame's `chosen`. Stills count as frames for seq and ack.
//
// Playback. `play` advances /step by the clock, forward or backward; a patch of /step continues
// from the new step, and a hidden client pauses playback. A step counts as dropped if its time
// passed before it was drawn. `stats` is sent once a second.
//
// Prefetch. During playback the next 16 steps are requested in order. At rest, after the final
// frame, both neighbouring steps are requested, so that a single step is immediate; a change of
// step, dataset or field withdraws that request until the view is at rest again.
//
// A patch that cannot be applied, whether detected at once or when its data cannot be read, has no
// effect: an `error` names its rev. Pending patches not yet shown by any frame may be rejected with
// it, newest first, each by its rev, until the remaining view can be drawn.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/codec.hpp"
#include "protocol/messages.hpp"
#include "server/base/error.hpp"
#include "server/session/effects.hpp"
#include "server/session/session_state.hpp"
#include "server/session/surroundings.hpp"

namespace windsplat::session {

class Session {
 public:
  Session(Options options, Surroundings surroundings, Micros now);

  // Each input returns its effects, in order. There are none after a Close.
  Effects on_message(const protocol::ClientMessage& message, Micros now);
  // Text that is not a valid message: answered by `error`; the session continues.
  Effects on_refused(const Error& error, const protocol::MessageTag& tag, Micros now);
  Effects on_binary(Micros now);
  Effects on_described(std::uint32_t id, Result<protocol::DatasetDescription> description,
                       Micros now);
  Effects on_rendered(std::uint64_t ticket, Result<Drawn> drawn, Micros now);
  Effects on_written(Micros now);  // the frame was written completely
  // The pong of the ping sent directly before the frame of that seq and its text messages.
  void on_pong(std::uint32_t seq, Micros now) { state_.flow.answered(seq, now); }
  Effects on_time(Micros now);
  Effects on_drain(Micros now);
  // The dataset was reopened: earlier frames of it are invalid.
  Effects on_changed(const std::string& dataset, Micros now);

  // Numbers of frames sent, dropped and cancelled.
  [[nodiscard]] const protocol::StatsMessage& stats() const { return state_.stats; }

  // Time to call on_time() unless another input arrives first; nullopt after Close.
  [[nodiscard]] std::optional<Micros> wake_at() const;

 private:
  Effects finish(Micros now);  // performs due actions and returns the effects
  void request_prefetch();
  void report_loading(Micros now);
  void close(int code, std::string reason);

  SessionState state_;
  Micros heard_at_ = 0;
  bool closed_ = false;
};

}  // namespace windsplat::session
