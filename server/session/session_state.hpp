// The state of a session, by subject, and the effects of the current input.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "protocol/messages.hpp"
#include "server/base/error.hpp"
#include "server/session/effects.hpp"
#include "server/session/load_progress.hpp"
#include "server/session/open_requests.hpp"
#include "server/session/pacing/displayed_frame.hpp"
#include "server/session/pacing/flow_control.hpp"
#include "server/session/pacing/quality_control.hpp"
#include "server/session/pacing/render_slot.hpp"
#include "server/session/pacing/still_queue.hpp"
#include "server/session/pacing/video_choice.hpp"
#include "server/session/playback/playback_rate.hpp"
#include "server/session/playback/player.hpp"
#include "server/session/playback/prefetcher.hpp"
#include "server/session/surroundings.hpp"
#include "server/session/view_state.hpp"

namespace windsplat::session {

struct SessionState {
  SessionState(Options given, Surroundings around, Micros now)
      : options(given),
        surroundings(std::move(around)),
        view(now),
        quality(surroundings.forecasts, surroundings.time_by_work, surroundings.waiting,
                surroundings.may_try),
        video(given.video) {}

  void send(protocol::ServerMessage message) { effects.emplace_back(SendText{std::move(message)}); }
  void refuse(const Error& error, std::optional<std::uint32_t> id,
              std::optional<std::uint32_t> rev) {
    send(protocol::ErrorMessage{id, rev, protocol::problem_from(error)});
  }
  // The newest view, or at least its step, needs no further frame.
  [[nodiscard]] bool view_is_shown() const { return displayed.version() == view.version(); }
  [[nodiscard]] bool step_is_shown() const { return displayed.version() >= view.step_version(); }

  Options options;
  Surroundings surroundings;
  Effects effects;
  bool hidden = false;  // the client does not show the picture

  ViewState view;
  OpenRequests openings;
  StillQueue stills;
  Player player;
  PlaybackRate playback_rate;
  Prefetcher prefetcher;
  LoadProgress load_progress;

  QualityControl quality;
  VideoChoice video;
  FlowControl flow;
  RenderSlot slot;
  DisplayedFrame displayed;
  protocol::StatsMessage stats;
};

}  // namespace windsplat::session
