#include "server/session/pacing/frame_delivery.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "server/session/playback/playback.hpp"
#include "server/session/view_changes.hpp"

namespace windsplat::session {
namespace {

constexpr std::size_t chosen_bytes = 600;  // approximate size of the message without its view

std::uint32_t clamped_us(std::int64_t us) {
  constexpr std::int64_t most = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(us, 0, most));
}

protocol::MethodCode method_code(const std::string& name) {
  if (name == "slab") return protocol::MethodCode::slab;
  if (name == "reference") return protocol::MethodCode::reference;
  return protocol::MethodCode::kernel;
}

Tier tier_of(Purpose purpose, bool final) {
  if (purpose == Purpose::still) return Tier::still;
  if (final) return Tier::final;
  return purpose == Purpose::moving ? Tier::moving : Tier::rest;
}

// JPEG in place of video that failed.
protocol::Codec codec_of(const Render& render, const Drawn& drawn) {
  const protocol::Codec asked = render.encoding.codec;
  return asked == protocol::Codec::h264 && !drawn.video ? protocol::Codec::jpeg : asked;
}

protocol::FrameHeader header_of(const Render& render, const Drawn& drawn, std::uint32_t seq,
                                bool final) {
  protocol::FrameHeader header;
  header.seq = seq;
  header.rev = render.rev;
  header.step = static_cast<std::uint32_t>(render.step);
  header.flags = final ? protocol::flag_final : 0;
  if (drawn.info.error_kind == "measured") header.flags |= protocol::flag_error_measured;
  if (drawn.info.error_kind == "estimated") header.flags |= protocol::flag_error_estimated;
  header.width = static_cast<std::uint16_t>(drawn.info.width);
  header.height = static_cast<std::uint16_t>(drawn.info.height);
  header.codec = codec_of(render, drawn);
  if (drawn.key) header.flags |= protocol::flag_key;
  header.quality = static_cast<std::uint8_t>(render.encoding.quality);
  header.method = method_code(drawn.info.method);
  header.level = quality::wire_level(render.setting.half_level);
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  header.error = static_cast<float>(drawn.info.error_value.value_or(unknown));
  header.jpeg_error = static_cast<float>(drawn.info.jpeg_error.value_or(unknown));
  header.queue_us = clamped_us(drawn.queue_us);
  header.render_us = clamped_us(drawn.render_us);
  header.encode_us = clamped_us(drawn.encode_us);
  header.payload_bytes = static_cast<std::uint32_t>(drawn.payload->size());
  header.t = render.t;
  return header;
}

void stand(SessionState& state) {
  if (const auto unchanged = state.displayed.stand_for(state.view)) state.send(*unchanged);
}

// Counts the frame for the link and the statistics.
void count_sent(SessionState& state, const Render& render, const Drawn& drawn, Micros now) {
  const bool moves = render.purpose == Purpose::moving;
  const std::size_t frame_bytes = protocol::frame_header_bytes + drawn.payload->size();
  const std::size_t text_bytes = chosen_bytes + drawn.view_json.size();
  ++state.stats.frames;
  state.stats.bytes += frame_bytes;
  state.flow.sent({text_bytes + frame_bytes, render.begun, moves, render.purpose == Purpose::final},
                  now);
  state.quality.learn_bytes(render, drawn, frame_bytes, text_bytes);
}

// The view is at rest and its final frame was sent; its description is made between stills.
void calibrate(SessionState& state) {
  if (state.player.running() || !state.stills.empty()) return;
  state.effects.emplace_back(Calibrate{state.view.view()});
}

// Call after a frame of the stream (not a still) was sent.
void after_frame(SessionState& state, const Render& render, std::uint32_t seq, double error,
                 bool final, bool blank) {
  state.stills.moving_frame_sent();
  state.view.confirm(render.version);
  state.view.answered(render.version);
  if (!final) return state.displayed.sent(render.version, error);
  // A final frame is of the current view: any change would have cancelled it.
  state.displayed.sent_final(state.view, seq, error, blank);
  state.send(state.stats);
  calibrate(state);
}

// Sends the frame with its accompanying messages.
void send_frame(SessionState& state, const Render& render, Drawn drawn, Micros now) {
  const bool still = render.purpose == Purpose::still;
  const bool final = render.purpose == Purpose::final &&
                     !state.quality.needs_thinner_slabs(render, drawn, state.view);
  const bool blank = is_blank(drawn.info);
  const bool loaded = drawn.loaded;
  const bool stands_in = drawn.info.detail && drawn.info.detail->missing_bytes > 0;
  // Do not refine twice if the error is unknown.
  const double otherwise = render.purpose == Purpose::refining ? 0 : 1;
  const double error = drawn.info.error_value.value_or(otherwise);
  const std::uint32_t seq = state.flow.next_seq();
  if (drawn.video && !render.old_video) state.video.sent();
  count_sent(state, render, drawn, now);
  const protocol::FrameHeader header = header_of(render, drawn, seq, final || still);

  state.effects.emplace_back(Ping{seq});
  if (still) state.send(protocol::ProgressMessage{render.still_id, "still", 1, 0.0});
  state.send(protocol::ChosenMessage{seq, std::move(drawn.info), std::move(drawn.view_json)});
  state.effects.emplace_back(
      SendFrame{header, std::move(drawn.payload), tier_of(render.purpose, final), stands_in});
  if (still) return;
  count_played(state, render, loaded, now);
  after_frame(state, render, seq, error, final, blank);
}

void render_failed(SessionState& state, const Render& render, const Error& error, Micros now) {
  if (render.purpose == Purpose::still) {
    state.refuse(error, render.still_id, std::nullopt);
    return;
  }
  if (const auto fault = state.view.find_fault(render.version)) {
    // Playback into a step that cannot be shown stops.
    if (!fault->rev) state.player.stop();
    state.refuse(error, std::nullopt, fault->rev);
    state.openings.failed(error);
    undo_change(state, fault->version, now);
    return;
  }
  // No earlier view: report the error and wait for a change.
  state.refuse(error, std::nullopt, render.rev);
  state.view.answered(render.version);
  state.player.stop();
  state.displayed.failed(render.version);
}

// Data released during the read are requested again by the view; a still has left its queue and
// gets the error.
bool is_cancelled(const Render& render, ErrorKind kind) {
  const bool released = kind == ErrorKind::not_resident || kind == ErrorKind::draining;
  return kind == ErrorKind::cancelled || (released && render.purpose != Purpose::still);
}

void deliver_result(SessionState& state, const Render& render, Result<Drawn> drawn, Micros now) {
  if (!drawn) {
    if (is_cancelled(render, drawn.error().kind)) {
      ++state.stats.cancelled;
    } else if (!render.unwanted) {
      render_failed(state, render, drawn.error(), now);
    }
    return;
  }
  state.quality.learn(render, *drawn, state.view, now);
  if (render.unwanted) {
    ++state.stats.dropped;
    return;
  }
  const bool still = render.purpose == Purpose::still;
  if (!still) state.openings.succeeded();
  const bool same = !still && render.version == state.view.version() && is_blank(drawn->info) &&
                    state.displayed.equals_blank(state.view.view());
  if (!same) {
    send_frame(state, render, std::move(*drawn), now);
  } else if (render.purpose == Purpose::final) {
    stand(state);
  } else {
    state.view.confirm(render.version);
    state.displayed.withheld(render.version);
  }
}

}  // namespace

void deliver(SessionState& state, const Render& render, Result<Drawn> drawn, Micros now) {
  if (render.encoding.codec == protocol::Codec::h264) {
    // The encoder refers to this frame, whether it is sent or not; send_frame() confirms that.
    state.video.lost();
    if (drawn && !drawn->video) state.video.failed(now);
  }
  deliver_result(state, render, std::move(drawn), now);
  // The still cancelled the calibration of the view.
  if (render.purpose != Purpose::still || !state.view_is_shown()) return;
  if (state.displayed.is_final() && state.displayed.equals(state.view.view())) calibrate(state);
}

void confirm_unchanged(SessionState& state) {
  if (state.view_is_shown() || state.slot.draws_stream()) return;
  if (state.displayed.equals(state.view.view())) stand(state);
}

}  // namespace windsplat::session
