// One viewer as a pure state machine: messages, frames and times in, effects out. It owns no
// socket, thread or clock.
//
// Pacing. One render at a time, begun only while fewer than two frames are unacknowledged and none
// is being written, and always of the newest view: there is nothing old to send after the viewer
// has stopped. While the view changes, moving frames follow each other at the setting (resolution,
// detail, method) that the chooser finds for quality.budgetMs (33 ms if it and maxError are null,
// less where many wait for the renderer) and quality.maxError. A moving frame is always finished
// and sent, even when the view has moved on, so that a steady flow of patches cannot starve the
// viewer. After `quiet` without a change the view is refined: if its final frame is long in coming,
// first by settings that err half as much as what is shown; then it is drawn as it stands at high
// quality, its error measured, flagged final. With maxError slabs become thinner until the measured
// error keeps it. Those renders are cancelled by the next change. Once the final frame is there, a
// survey of the settings is asked for.
//
// The link. A render is begun no sooner than that its frame finds the link and the viewer free
// (link.hpp): it shows the newest view there is then, and waits nowhere. A moving frame's quality
// and size follow what the link carries (jpeg_rate.hpp). While a final frame is on a slow link
// nothing else can be: there the view rests for half that time before, up to `quiet_most`.
//
// A final frame stands for every later view that looks the same: the same view said in other words
// or come back to before anything else was sent, or another camera on a scene of which nothing
// shows before and after. Then no frame is drawn or sent, and `unchanged` names the patch's rev.
// Only a final frame tells that nothing shows: a moving one with nothing in it may be too coarse
// for what there is, so it is kept back, and the final one decides.
//
// Every patch that is followed is answered by a frame of its rev or a later one, or by `unchanged`,
// also where a client says the same rev again.
//
// Stills. `still` draws the present view apart from the stream. Its picture is one binary frame of
// kind 1 with the final flag, codec png or jpeg; right before it come `progress` with the request's
// id, phase "still" and done 1, and the frame's `chosen`. Stills count as frames for seq and ack.
//
// Steps that run. `play` moves /step on by the clock, forward or backward; a patch of /step
// meanwhile moves on from there, and a viewer who is hidden holds them. A step is counted as
// dropped when time went past it before it was drawn. `stats` comes once a second.
//
// Prefetch. While steps run, the next 16 in their order are wished for. At rest, once the final
// frame of a view is there, its two neighbours are, so that a single step is instant; another step,
// dataset or field takes that wish back until the view rests again.
//
// A patch that cannot be followed, whether that is seen at once or only when its data cannot be
// read, leaves no trace: an `error` names its rev. Patches that came with it and that no frame had
// shown yet may be refused too, newest first, each by its rev: what is left is drawable.
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
  Micros quiet_most_us = 1'000'000;      // the same where it would be long on the link
};

// Whether a view can be drawn, as far as is known without loading anything; the value is the
// number of steps of its dataset.
using Check = std::function<Result<int>(const protocol::View&)>;

// What is being read of a dataset at the moment, if anything. Must not wait.
struct Reading {
  std::string field;
  double done = 0;  // 0 to 1
};
using WhatIsRead = std::function<std::optional<Reading>(const std::string& dataset)>;

// What is known of the settings' errors and times.
using Forecaster =
    std::function<quality::Forecasts(const quality::SceneSignature&, const quality::Viewpoint&)>;

// What a session asks of its surroundings while it decides. None of it may wait.
struct Surroundings {
  Check check;
  WhatIsRead what_is_read;  // may be empty
  Forecaster forecasts;     // empty: the prior
};

class Session {
 public:
  Session(Options options, Surroundings surroundings, Micros now);

  // What each input asks for, in order. After a Close nothing more comes.
  Effects on_message(const protocol::ClientMessage& message, Micros now);
  // Text that is no message: answered by `error`, the session lives.
  Effects on_refused(const Error& error, const protocol::MessageTag& tag, Micros now);
  Effects on_binary(Micros now);
  Effects on_described(std::uint32_t id, Result<protocol::DatasetDescription> description,
                       Micros now);
  Effects on_rendered(std::uint64_t ticket, Result<Drawn> drawn, Micros now);
  Effects on_written(Micros now);  // the frame was handed over whole
  // The pong of the ping that went right before the frame of that seq and its texts.
  void on_pong(std::uint32_t seq, Micros now) { link_.heard(seq, now); }
  Effects on_time(Micros now);
  Effects on_drain(Micros now);
  // The dataset was opened anew: whatever was drawn of it is no longer true.
  Effects on_changed(const std::string& dataset, Micros now);

  // What was sent, dropped and cancelled so far.
  [[nodiscard]] const protocol::StatsMessage& stats() const { return stats_; }

  // When on_time is to be called, unless another input comes first; none after Close.
  [[nodiscard]] std::optional<Micros> wake_at() const;

 private:
  enum class Purpose { moving, refining, final, still };

  // A change of the view that no frame has proved to be drawable yet.
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
  // The final frame that the viewer has, until another one is sent.
  struct Standing {
    std::uint32_t seq = 0;
    std::uint32_t rev = 0;  // told to the viewer last
    std::string view;
    std::string without_camera;  // empty where something shows
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
    bool unwanted = false;  // its frame is not to be sent
    bool played = false;    // the first one of a step that time has reached
  };

  void follow(const protocol::OpenMessage& message, Micros now);
  void follow(const protocol::PatchMessage& message, Micros now);
  void follow(const protocol::StillMessage& message, Micros now);
  void follow(const protocol::PlayMessage& message, Micros now);
  void follow(const protocol::PauseMessage& message, Micros now);
  void follow(const protocol::AckMessage& message, Micros now);
  void follow(const protocol::VisibilityMessage& message, Micros now);

  Effects finish(Micros now);  // what is due, then the effects gathered
  void advance_step(Micros now);
  void start_next(Micros now);
  void start_moving(Micros now);
  void start_refining(Micros now);
  void start_final(Micros now);
  [[nodiscard]] quality::Setting final_setting() const;
  [[nodiscard]] bool errs_too_much(const Render& render, const Drawn& drawn);
  [[nodiscard]] quality::Forecasts forecasts() const;
  void learn(const Render& render, const Drawn& drawn, Micros now);
  void request_prefetch();  // which steps to have ready
  [[nodiscard]] std::vector<int> wanted_steps() const;
  void count_played(const Render& render, bool loaded, Micros now);
  void start_still(Micros now);
  // While a frame or a description is long in coming for want of data: how far that has come.
  void tell_reading(Micros now);
  [[nodiscard]] std::optional<std::uint64_t> waited_for() const;
  [[nodiscard]] Micros final_cost(const quality::Forecasts& known, Micros now) const;
  [[nodiscard]] Render render_of(Purpose purpose, Micros now) const;
  void start(Render render, const protocol::View& view);
  void abandon_render();

  void change(protocol::ViewDocument next, std::optional<std::uint32_t> rev, std::string patch_json,
              Micros now);
  void show(protocol::ViewDocument next, Micros now);
  void settle(std::uint64_t version);  // the view of that version can be drawn
  void settle_oldest();
  void answered(std::uint64_t version);          // patches up to that version
  void undo(std::uint64_t version, Micros now);  // that change was refused after all
  void render_failed(const Render& render, const Error& error, Micros now);
  void stand();  // for the present view
  void confirm_unchanged();
  void withhold(const Render& render);  // its frame looks as the standing one, as far as it shows
  [[nodiscard]] bool looks_standing(const Render& render, const Drawn& drawn) const;
  void send_frame(const Render& render, Drawn drawn,
                  Micros now);  // with the messages that go with it
  // Why there is no dataset to play or draw.
  [[nodiscard]] Error nothing_open() const;
  void refuse(const Error& error, std::optional<std::uint32_t> id,
              std::optional<std::uint32_t> rev);
  void close(int code, std::string reason);

  [[nodiscard]] bool can_start() const;
  // When the next render is to begin as things stand; none if there is nothing to draw.
  [[nodiscard]] std::optional<Micros> start_at() const;
  [[nodiscard]] bool wants_moving() const;
  // How long the view rests before its final frame.
  [[nodiscard]] Micros rest() const;
  [[nodiscard]] bool shown() const { return drawn_version_ == version_; }
  // A frame of the present step was, though the view may have changed since then.
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
  bool still_turn_ = false;  // a moving frame went out since a still was asked for
  bool drawn_final_ = true;
  std::uint32_t rev_ = 0;
  std::uint32_t proved_rev_ = 0;
  std::uint32_t sent_seq_ = 0;
  std::uint32_t acked_seq_ = 0;

  protocol::ViewDocument document_;  // the newest view
  protocol::View view_;              // the same, typed
  double t_ = 0;
  std::uint64_t version_ = 0;          // counts changes
  std::uint64_t step_version_ = 0;     // when /step changed last
  std::uint64_t started_version_ = 0;  // newest one that was begun to be drawn
  std::uint64_t drawn_version_ = 0;
  Micros changed_at_ = 0;
  protocol::ViewDocument proved_;  // the newest view known to be drawable
  std::deque<Change> changes_;     // from proved_ to document_
  std::deque<Opening> openings_;
  std::optional<std::uint32_t> opened_id_;  // of the last that was asked for
  std::optional<Error> not_opened_;         // why the last view that could not be shown could not
  std::deque<Still> stills_;
  Player player_;
  struct Pace {  // steps shown since a moment
    Micros since = 0;
    int steps = 0;
  };
  std::optional<Pace> pace_;  // from the first step shown
  Prefetch requested_;
  std::string requested_fields_;
  bool requested_at_rest_ = false;  // not while steps ran

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
  std::optional<double> final_factor_;  // a final frame's time over its setting's, the last time
  quality::Setting moving_setting_;     // the last one chosen
  int thinner_ = 0;           // how often the final's slabs were halved for the sake of maxError
  double queue_us_ = 0;       // that moving frames waited for the renderer, lately
  double thicker_error_ = 0;  // measured before the last halving
  double shown_error_ = 1;    // of the frame sent last, as far as it is known
  std::string drawn_style_;   // of the view that was drawn last, before it was completed
  quality::SceneSignature signature_;  // and after
  quality::Viewpoint viewpoint_;
  Link link_;
  JpegRate jpeg_;
  double final_bytes_ = 0;  // of the last one, on the wire
  protocol::StatsMessage stats_;
};

}  // namespace windsplat::session
