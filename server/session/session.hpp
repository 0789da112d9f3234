// One viewer as a pure state machine: messages, frames and times in, effects out. It owns no
// socket, thread or clock.
//
// Pacing. One render at a time, begun only while fewer than two frames are unacknowledged and none
// is being written, and always of the newest view: there is nothing old to send after the viewer
// has stopped. While the view changes, moving frames follow each other at the level that keeps them
// within quality.budgetMs (33 ms if null). A moving frame is always finished and sent, even when
// the view has moved on, so that a steady flow of patches cannot starve the viewer. After `quiet`
// without a change the view is drawn once more at full resolution and high quality, flagged final;
// that render is cancelled by the next change.
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
#include "server/session/effects.hpp"
#include "server/session/level_chooser.hpp"
#include "server/session/player.hpp"

namespace windsplat::session {

struct Options {
  Micros idle_timeout_us = 300'000'000;  // without a message
  Micros quiet_us = 120'000;             // without a change, before the final frame
};

// Whether a view can be drawn, as far as is known without loading anything; the value is the
// number of steps of its dataset.
using Check = std::function<Result<int>(const protocol::View&)>;

class Session {
 public:
  Session(Options options, Check check, Micros now);

  // What each input asks for, in order. After a Close nothing more comes.
  Effects on_message(const protocol::ClientMessage& message, Micros now);
  // Text that is no message: answered by `error`, the session lives.
  Effects on_refused(const Error& error, const protocol::MessageTag& tag, Micros now);
  Effects on_binary(Micros now);
  Effects on_described(std::uint32_t id, Result<protocol::DatasetDescription> description,
                       Micros now);
  Effects on_rendered(std::uint64_t ticket, Result<Drawn> drawn, Micros now);
  Effects on_written(Micros now);  // the frame was handed over whole
  Effects on_time(Micros now);
  Effects on_drain(Micros now);

  // When on_time is to be called, unless another input comes first; none after Close.
  [[nodiscard]] std::optional<Micros> wake_at() const;

 private:
  enum class Purpose { moving, final, still };

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
    std::uint64_t version = 0;
    std::uint32_t rev = 0;
    double t = 0;
    int step = 0;
    int width = 0;  // of the view
    int height = 0;
    Encoding encoding;
    std::uint32_t still_id = 0;
    bool unwanted = false;  // its frame is not to be sent
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
  void start_final();
  void start_still();
  [[nodiscard]] Micros final_cost(int width, int height, Micros now) const;
  [[nodiscard]] Render render_of(Purpose purpose) const;
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
  void stand_if_same();
  void withhold(const Render& render);  // its frame looks as the standing one, as far as it shows
  [[nodiscard]] bool looks_standing(const Render& render, const Drawn& drawn) const;
  void send_frame(const Render& render, Drawn drawn);  // with the messages that go with it
  void refuse(const Error& error, std::optional<std::uint32_t> id,
              std::optional<std::uint32_t> rev);
  void close(int code, std::string reason);

  [[nodiscard]] bool can_start() const;
  [[nodiscard]] bool shown() const { return drawn_version_ == version_; }
  [[nodiscard]] bool wants_final() const;
  [[nodiscard]] Micros budget() const;

  Options options_;
  Check check_;
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
  std::uint64_t version_ = 0;  // counts changes
  std::uint64_t drawn_version_ = 0;
  Micros changed_at_ = 0;
  protocol::ViewDocument proved_;  // the newest view known to be drawable
  std::deque<Change> changes_;     // from proved_ to document_
  std::deque<Opening> openings_;
  std::deque<Still> stills_;
  Player player_;

  std::optional<Standing> standing_;
  std::optional<std::uint64_t> unanswered_;  // version of the newest patch, until it is answered

  std::optional<Render> render_;
  std::uint64_t tickets_ = 0;
  LevelChooser levels_;
  std::optional<Micros> last_final_cost_;  // of a frame not drawn by kernel
  protocol::StatsMessage stats_;
};

}  // namespace windsplat::session
