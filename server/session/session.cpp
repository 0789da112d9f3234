#include "server/session/session.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "server/session/message_handler.hpp"
#include "server/session/pacing/frame_delivery.hpp"
#include "server/session/pacing/frame_scheduler.hpp"
#include "server/session/playback/playback.hpp"
#include "server/session/view_changes.hpp"

namespace windsplat::session {
namespace {

constexpr int close_drain = 1001;
constexpr int close_bad_message = 4400;
constexpr int close_idle = 4410;

// What the data are being read for: 0 for a description, the ticket for a frame.
std::optional<std::uint64_t> waiting_for_data(const SessionState& state) {
  if (state.hidden) return std::nullopt;
  if (state.openings.pending()) return 0;
  const auto& render = state.slot.render();
  return render && !render->unwanted ? std::optional(render->ticket) : std::nullopt;
}

}  // namespace

Session::Session(Options options, Surroundings surroundings, Micros now)
    : state_(options, std::move(surroundings), now), heard_at_(now) {}

// --- inputs -------------------------------------------------------------------------------------

Effects Session::on_message(const protocol::ClientMessage& message, Micros now) {
  if (closed_) return {};
  heard_at_ = now;
  std::visit(MessageHandler(state_, now), message);
  return finish(now);
}

Effects Session::on_refused(const Error& error, const protocol::MessageTag& tag, Micros now) {
  if (closed_) return {};
  heard_at_ = now;
  state_.refuse(error, tag.id, tag.rev);
  return finish(now);
}

Effects Session::on_binary(Micros now) {
  if (!closed_) close(close_bad_message, "binary messages are not supported; send text");
  return finish(now);
}

Effects Session::on_drain(Micros now) {
  if (!closed_) close(close_drain, "the server is shutting down");
  return finish(now);
}

Effects Session::on_changed(const std::string& dataset, Micros now) {
  const auto& minus = state_.view.view().difference;
  const bool subtracted = minus && minus->dataset == dataset;
  const bool own = state_.view.view().dataset == dataset;
  if (closed_ || !(own || subtracted)) return {};
  state_.displayed.forget();
  renew_view(state_, now);
  state_.prefetcher.forget();
  if (!own) return finish(now);
  protocol::View bare;
  bare.dataset = dataset;
  const auto steps = state_.surroundings.check(bare);
  if (steps && state_.view.view().step >= *steps) change_step(state_, *steps - 1, now);
  // Describe the reopened dataset again if the client has its description.
  if (const auto id = state_.openings.repeat()) {
    state_.effects.emplace_back(Describe{*id, dataset});
  }
  return finish(now);
}

Effects Session::on_time(Micros now) { return finish(now); }

Effects Session::on_written(Micros now) {
  state_.flow.written(now);
  return finish(now);
}

Effects Session::on_described(std::uint32_t id, Result<protocol::DatasetDescription> description,
                              Micros now) {
  if (closed_) return {};
  const auto version = state_.openings.take(id);
  if (!version) return {};
  if (description) {
    state_.openings.succeeded();
    state_.send(protocol::OpenedMessage{id, std::move(*description)});
  } else {
    state_.openings.failed(description.error());
    state_.refuse(description.error(), id, std::nullopt);
    undo_change(state_, *version, now);
  }
  return finish(now);
}

Effects Session::on_rendered(std::uint64_t ticket, Result<Drawn> drawn, Micros now) {
  if (closed_) return {};
  const auto render = state_.slot.take(ticket);
  if (!render) return {};
  deliver(state_, *render, std::move(drawn), now);
  return finish(now);
}

// --- due actions --------------------------------------------------------------------------------

Effects Session::finish(Micros now) {
  if (!closed_ && now - heard_at_ >= state_.options.idle_timeout_us) {
    close(close_idle, "idle timeout: no message received");
  }
  if (!closed_) {
    advance_playback(state_, now);
    confirm_unchanged(state_);
    start_due_render(state_, now);
    if (!state_.slot.render() && state_.video.take_ended(now)) {
      state_.effects.emplace_back(EndVideo{});
    }
    request_prefetch();
    report_loading(now);
  }
  return std::exchange(state_.effects, {});
}

void Session::request_prefetch() {
  const bool may_load = !closed_ && !state_.hidden && !state_.openings.pending();
  const bool final_shown = state_.view_is_shown() && state_.displayed.is_final();
  auto request = state_.prefetcher.update(
      {state_.view.view(), state_.player, may_load, final_shown, state_.quality.moving_setting()},
      state_.surroundings.check);
  if (request) state_.effects.emplace_back(std::move(*request));
}

void Session::report_loading(Micros now) {
  auto progress = state_.load_progress.due(
      waiting_for_data(state_), state_.surroundings.what_is_read, state_.view.view().dataset, now);
  if (progress) state_.send(std::move(*progress));
}

void Session::close(int code, std::string reason) {
  state_.slot.cancel(state_.effects);
  closed_ = true;
  request_prefetch();
  state_.effects.emplace_back(Close{code, std::move(reason)});
}

std::optional<Micros> Session::wake_at() const {
  if (closed_) return std::nullopt;
  Micros wake = heard_at_ + state_.options.idle_timeout_us;
  wake = std::min(wake, next_step_at(state_).value_or(wake));
  wake = std::min(wake, state_.load_progress.due_at().value_or(wake));
  wake = std::min(wake, next_render_at(state_).value_or(wake));
  if (const Micros ends = state_.video.ends_at(); ends > 0 && !state_.slot.render()) {
    wake = std::min(wake, ends);
  }
  return wake;
}

}  // namespace windsplat::session
