// One session as a pure state machine: messages, frames and times in, effects out. Owns no socket,
// thread or clock.
//
// Pacing. One render at a time, started only while fewer than two frames are unacknowledged and
// none is being written, and always of the newest view, so that no outdated frames queue up. While
// the view changes, moving frames are drawn at the setting (resolution, detail, method) that the
// chooser finds for quality.budgetMs (33 ms if it and maxError are null, less under contention for
// the renderer) and quality.maxError. A moving frame is always finished and sent, even when the
// view has changed, so that a steady flow of patches cannot starve the client. After `quiet`
// without a change the view is refined: if its final frame takes long, first at settings with half
// the error of the frame shown; then as specified at high quality, with its error measured, flagged
// final. With maxError, slabs are halved until the measured error is within it. The next change
// cancels these renders. A calibration run is requested after the final frame.
//
// The link. A render starts no sooner than its frame will find link and client free (link.hpp), so
// that it shows the newest view and does not queue. Quality and size of a moving frame follow the
// rate of the link (jpeg_rate.hpp). A final frame blocks a slow link: there the view must be at
// rest for half the transfer time first, up to `quiet_most`.
//
// A final frame remains valid for every later view with the same picture: an equivalent view, a
// return to it before another frame was sent, or another camera on a scene that is empty before and
// after. No frame is drawn or sent then, and `unchanged` names the patch's rev. Only a final frame
// proves that a scene is empty: an empty moving frame may be too coarse, so it is withheld and the
// final frame decides.
//
// Every accepted patch is answered by a frame of its rev or a later one, or by `unchanged`, also if
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
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"
#include "server/session/chooser.hpp"
#include "server/session/effects.hpp"
#include "server/session/jpeg_rate.hpp"
#include "server/session/link.hpp"
#include "server/session/player.hpp"

namespace windsplat::session {

struct Options {
  Micros idle_timeout_us = 300'000'000;  // without a message
  Micros quiet_us = 120'000;             // without a change, before the final frame
  Micros quiet_most_us = 1'000'000;      // maximum of it for slow links
};

// Checks whether a view can be drawn, without loading; the value is the number of steps of its
// dataset.
using Check = std::function<Result<int>(const protocol::View&)>;

// Progress of the current read of a dataset, if any. Must not block.
struct Reading {
  std::string field;
  double done = 0;  // 0 to 1
};
using WhatIsRead = std::function<std::optional<Reading>(const std::string& dataset)>;

// Known errors and times of the settings.
using Forecaster =
    std::function<quality::Forecasts(const quality::SceneSignature&, const quality::Viewpoint&)>;

// Queries of a session to its environment. None may block.
struct Surroundings {
  Check check;
  WhatIsRead what_is_read;  // may be empty
  Forecaster forecasts;     // empty: the prior
};

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
  // The pong of the ping sent directly before the frame of that seq and its texts.
  void on_pong(std::uint32_t seq, Micros now) { link_.heard(seq, now); }
  Effects on_time(Micros now);
  Effects on_drain(Micros now);
  // The dataset was reopened: earlier frames of it are invalid.
  Effects on_changed(const std::string& dataset, Micros now);

  // Counts of frames sent, dropped and cancelled.
  [[nodiscard]] const protocol::StatsMessage& stats() const { return stats_; }

  // When to call on_time() unless another input arrives first; none after Close.
  [[nodiscard]] std::optional<Micros> wake_at() const;

 private:
  enum class Purpose { moving, refining, final, still };

  // A change of the view that no frame has confirmed as drawable.
  struct Change {
    std::uint64_t version = 0;
    std::optional<std::uint32_t> rev;
    std::string patch_json;
  };
  struct Opening {
    std::uint32_t id = 0;
    std::uint64_t version = 0;  // of its change; 0 if it made none
  };
  struct Still {
    protocol::StillMessage message;
    protocol::View view;  // its image as large as the still
    std::uint32_t rev = 0;
    double t = 0;
  };
  // The final frame shown by the client, until another one is sent.
  struct Standing {
    std::uint32_t seq = 0;
    std::uint32_t rev = 0;  // last one reported to the client
    std::string view;
    std::string without_camera;  // empty if the scene is not empty
  };
  struct Render {
    std::uint64_t ticket = 0;
    Purpose purpose = Purpose::moving;
    std::string dataset;
    std::uint64_t version = 0;
    Micros begun = 0;
    std::uint32_t rev = 0;
    double t = 0;
    int step = 0;
    quality::Setting setting;
    Encoding encoding;
    std::uint32_t still_id = 0;
    bool unwanted = false;  // do not send its frame
    bool played = false;    // the first one of a step reached by playback
  };

  void follow(const protocol::OpenMessage& message, Micros now);
  void follow(const protocol::PatchMessage& message, Micros now);
  void follow(const protocol::StillMessage& message, Micros now);
  void follow(const protocol::PlayMessage& message, Micros now);
  void follow(const protocol::PauseMessage& message, Micros now);
  void follow(const protocol::AckMessage& message, Micros now);
  void follow(const protocol::VisibilityMessage& message, Micros now);

  Effects finish(Micros now);  // performs due actions and returns the effects
  void advance_step(Micros now);
  void start_next(Micros now);
  void start_moving(Micros now);
  void start_refining(Micros now);
  void start_final(Micros now);
  [[nodiscard]] quality::Setting final_setting() const;
  [[nodiscard]] bool errs_too_much(const Render& render, const Drawn& drawn);
  [[nodiscard]] quality::Forecasts forecasts() const;
  void learn(const Render& render, const Drawn& drawn, Micros now);
  void request_prefetch();  // of the next steps
  [[nodiscard]] std::vector<int> wanted_steps() const;
  void count_played(const Render& render, bool loaded, Micros now);
  void start_still(Micros now);
  // Reports the progress of loading while a frame or description waits for data.
  void tell_reading(Micros now);
  [[nodiscard]] std::optional<std::uint64_t> waited_for() const;
  [[nodiscard]] Micros final_cost(const quality::Forecasts& known, Micros now) const;
  [[nodiscard]] Render render_of(Purpose purpose, Micros now) const;
  void start(Render render, const protocol::View& view);
  void abandon_render();

  void change(protocol::ViewDocument next, std::optional<std::uint32_t> rev, std::string patch_json,
              Micros now);
  void show(protocol::ViewDocument next, Micros now);
  void settle(std::uint64_t version);  // the view of that version is drawable
  void settle_oldest();
  void answered(std::uint64_t version);          // patches up to that version
  void undo(std::uint64_t version, Micros now);  // the change was rejected later
  void render_failed(const Render& render, const Error& error, Micros now);
  void stand();  // marks the final frame valid for the current view
  void confirm_unchanged();
  void withhold(const Render& render);  // its frame has the same content as the valid one
  [[nodiscard]] bool looks_standing(const Render& render, const Drawn& drawn) const;
  void send_frame(const Render& render, Drawn drawn,
                  Micros now);  // with the messages that go with it
  // Error if there is no dataset to play or draw.
  [[nodiscard]] Error nothing_open() const;
  void refuse(const Error& error, std::optional<std::uint32_t> id,
              std::optional<std::uint32_t> rev);
  void close(int code, std::string reason);

  [[nodiscard]] bool can_start() const;
  // When the next render starts in the current state; none if there is nothing to draw.
  [[nodiscard]] std::optional<Micros> start_at() const;
  [[nodiscard]] bool wants_moving() const;
  // Rest time before the final frame.
  [[nodiscard]] Micros rest() const;
  [[nodiscard]] bool shown() const { return drawn_version_ == version_; }
  // A frame of the current step was sent, though the view may have changed since.
  [[nodiscard]] bool step_shown() const { return drawn_version_ >= step_version_; }
  [[nodiscard]] bool wants_final() const;
  [[nodiscard]] Micros budget() const;
  [[nodiscard]] quality::Aim aim() const;

  Options options_;
  Surroundings surroundings_;
  Effects effects_;
  Micros heard_at_ = 0;
  bool closed_ = false;
  bool hidden_ = false;
  bool writing_ = false;     // a frame
  bool still_turn_ = false;  // a moving frame was sent since a still was requested
  bool drawn_final_ = true;
  std::uint32_t rev_ = 0;
  std::uint32_t proved_rev_ = 0;
  std::uint32_t sent_seq_ = 0;
  std::uint32_t acked_seq_ = 0;

  protocol::ViewDocument document_;  // the newest view
  protocol::View view_;              // the same, typed
  double t_ = 0;
  std::uint64_t version_ = 0;          // counts changes
  std::uint64_t step_version_ = 0;     // of the last change of /step
  std::uint64_t started_version_ = 0;  // newest version whose render was started
  std::uint64_t drawn_version_ = 0;
  Micros changed_at_ = 0;
  protocol::ViewDocument proved_;  // the newest view known to be drawable
  std::deque<Change> changes_;     // from proved_ to document_
  std::deque<Opening> openings_;
  std::optional<std::uint32_t> opened_id_;  // of the latest open request
  std::optional<Error> not_opened_;         // why the last view could not be shown
  std::deque<Still> stills_;
  Player player_;
  struct Pace {  // steps shown since a moment
    Micros since = 0;
    int steps = 0;
  };
  std::optional<Pace> pace_;  // from the first step shown
  Prefetch requested_;
  std::string requested_fields_;
  bool requested_at_rest_ = false;  // false during playback

  std::optional<Standing> standing_;
  std::optional<std::uint64_t> unanswered_;  // version of the newest patch, until it is answered

  struct Wait {
    std::uint64_t what = 0;
    Micros tell_at = 0;
  };
  std::optional<Wait> wait_;

  std::optional<Render> render_;
  std::uint64_t tickets_ = 0;
  Chooser chooser_;
  std::optional<double> final_factor_;  // time of the last final frame over that of its setting
  quality::Setting moving_setting_;     // the last one chosen
  int thinner_ = 0;                    // number of halvings of the final frame's slabs for maxError
  double queue_us_ = 0;                // recent waiting time of moving frames for the renderer
  double thicker_error_ = 0;           // measured before the last halving
  double shown_error_ = 1;             // of the frame sent last, if known
  std::string drawn_style_;            // of the view drawn last, before completion
  quality::SceneSignature signature_;  // after completion
  quality::Viewpoint viewpoint_;
  Link link_;
  JpegRate jpeg_;
  double final_bytes_ = 0;  // of the last final frame
  protocol::StatsMessage stats_;
};

}  // namespace windsplat::session
