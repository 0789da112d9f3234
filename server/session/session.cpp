// Inputs of a session: messages, descriptions, frames and times change its state.
#include "server/session/session.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "protocol/limits.hpp"

namespace windsplat::session {
namespace {

namespace limits = protocol::limits;

constexpr int close_drain = 1001;
constexpr int close_bad_message = 4400;
constexpr int close_idle = 4410;

constexpr std::size_t openings_max = 4;
constexpr std::size_t stills_max = 2;
// Limit of unconfirmed changes kept apart; more count as confirmed.
constexpr std::size_t changes_max = 32;
constexpr std::size_t change_bytes_max = limits::message_bytes_max;

std::string json_string(const std::string& text) {
  std::string out(1, '"');
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  out += '"';
  return out;
}

// Opening another dataset resets everything but picture size and budget.
std::string open_patch(const std::string& dataset) {
  return "{\"dataset\":" + json_string(dataset) +
         ",\"step\":null,\"camera\":null,\"geometry\":null,\"vector\":null,\"scalars\":null,"
         "\"depthCue\":null,\"method\":null}";
}

// The size of a still: the message's, else the view's, times its scale.
Result<void> size_still(const protocol::StillMessage& message, protocol::View& view) {
  const auto scaled = [&](int edge) {
    return static_cast<std::int64_t>(std::ceil(edge * message.scale));
  };
  const std::int64_t width = scaled(message.width.value_or(view.image.width));
  const std::int64_t height = scaled(message.height.value_or(view.image.height));
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (std::max(width, height) > limits::image_edge_max) {
    return make_error_at(ErrorKind::too_large, "/scale",
                         "makes the picture " + size + "; no edge may be longer than " +
                             std::to_string(limits::image_edge_max));
  }
  if (width * height > limits::image_pixels_max) {
    return make_error_at(
        ErrorKind::too_large, "/scale",
        "makes the picture " + size + "; the limit is " + std::to_string(limits::image_pixels_max));
  }
  view.image.width = static_cast<int>(width);
  view.image.height = static_cast<int>(height);
  return {};
}

}  // namespace

Session::Session(Options options, Surroundings surroundings, Micros now)
    : options_(options), surroundings_(std::move(surroundings)), heard_at_(now), changed_at_(now) {}

// --- inputs -------------------------------------------------------------------------------------

Effects Session::on_message(const protocol::ClientMessage& message, Micros now) {
  if (closed_) return {};
  heard_at_ = now;
  std::visit([&](const auto& body) { follow(body, now); }, message);
  return finish(now);
}

Effects Session::on_refused(const Error& error, const protocol::MessageTag& tag, Micros now) {
  if (closed_) return {};
  heard_at_ = now;
  refuse(error, tag.id, tag.rev);
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
  if (closed_ || view_.dataset != dataset) return {};
  standing_.reset();
  show(document_, now);
  requested_ = {};
  protocol::View bare;
  bare.dataset = dataset;
  const auto steps = surroundings_.check(bare);
  if (steps && view_.step >= *steps) {
    std::string patch = "{\"step\":" + std::to_string(*steps - 1) + '}';
    if (auto next = document_.patched(patch)) {
      change(std::move(*next), std::nullopt, std::move(patch), now);
    }
  }
  // Describe the reopened dataset again if the client has its description.
  const bool is_asked = std::any_of(openings_.begin(), openings_.end(),
                                    [&](const Opening& known) { return known.id == opened_id_; });
  if (opened_id_ && !is_asked && openings_.size() < openings_max) {
    openings_.push_back({*opened_id_, 0});
    effects_.emplace_back(Describe{*opened_id_, dataset});
  }
  return finish(now);
}

Effects Session::on_time(Micros now) { return finish(now); }

Effects Session::on_written(Micros now) {
  writing_ = false;
  link_.written(now);
  return finish(now);
}

Effects Session::on_described(std::uint32_t id, Result<protocol::DatasetDescription> description,
                              Micros now) {
  const auto opening = std::find_if(openings_.begin(), openings_.end(),
                                    [&](const Opening& known) { return known.id == id; });
  if (closed_ || opening == openings_.end()) return {};
  const std::uint64_t version = opening->version;
  openings_.erase(opening);
  if (description) {
    not_opened_.reset();
    effects_.emplace_back(SendText{protocol::OpenedMessage{id, std::move(*description)}});
  } else {
    not_opened_ = description.error();
    refuse(description.error(), id, std::nullopt);
    undo(version, now);
  }
  return finish(now);
}

Effects Session::on_rendered(std::uint64_t ticket, Result<Drawn> drawn, Micros now) {
  if (closed_ || !render_ || render_->ticket != ticket) return {};
  const Render render = *render_;
  render_.reset();
  if (!drawn) {
    const ErrorKind kind = drawn.error().kind;
    // Data released during the read are requested again by the view; a still has left its queue and
    // gets the error.
    const bool released = kind == ErrorKind::not_resident || kind == ErrorKind::draining;
    if (kind == ErrorKind::cancelled || (released && render.purpose != Purpose::still)) {
      ++stats_.cancelled;
    } else if (!render.unwanted) {
      render_failed(render, drawn.error(), now);
    }
    return finish(now);
  }
  learn(render, *drawn, now);
  if (!render.unwanted && render.purpose != Purpose::still) not_opened_.reset();
  if (render.unwanted) {
    ++stats_.dropped;
  } else if (looks_standing(render, *drawn)) {
    render.purpose == Purpose::final ? stand() : withhold(render);
  } else {
    send_frame(render, std::move(*drawn), now);
  }
  return finish(now);
}

// --- messages -----------------------------------------------------------------------------------

void Session::follow(const protocol::OpenMessage& message, Micros now) {
  if (openings_.size() >= openings_max) {
    refuse(
        make_error(ErrorKind::busy, "too many datasets are being opened; wait for one to finish"),
        message.id, std::nullopt);
    return;
  }
  protocol::View bare;
  bare.dataset = message.dataset;
  if (const auto known = surroundings_.check(bare); !known) {
    not_opened_ = known.error();
    refuse(known.error(), message.id, std::nullopt);
    return;
  }
  Opening opening{message.id, 0};
  if (view_.dataset != message.dataset) {
    std::string patch = open_patch(message.dataset);
    auto next = document_.patched(patch);
    if (!next) {
      refuse(next.error(), message.id, std::nullopt);
      return;
    }
    player_.stop();
    abandon_render();
    change(std::move(*next), std::nullopt, std::move(patch), now);
    opening.version = version_;
  }
  openings_.push_back(opening);
  opened_id_ = message.id;
  effects_.emplace_back(
      SendText{protocol::ProgressMessage{message.id, "loading", 0, std::nullopt}});
  effects_.emplace_back(Describe{message.id, message.dataset});
}

void Session::follow(const protocol::PatchMessage& message, Micros now) {
  auto next = document_.patched(message.patch_json);
  if (!next) {
    refuse(next.error(), std::nullopt, message.rev);
    return;
  }
  const protocol::View view = next->view();
  // A client may set the picture size before it opens a dataset.
  if (!view.dataset.empty()) {
    if (const auto drawable = surroundings_.check(view); !drawable) {
      refuse(drawable.error(), std::nullopt, message.rev);
      return;
    }
  }
  if (view.dataset != view_.dataset) player_.stop();
  if (view.step != view_.step) player_.move_to(view.step, now);
  t_ = message.t;
  rev_ = message.rev;
  change(std::move(*next), message.rev, message.patch_json, now);
  unanswered_ = version_;
}

void Session::follow(const protocol::StillMessage& message, Micros /*now*/) {
  Still still{message, view_, rev_, t_};
  if (view_.dataset.empty()) {
    refuse(nothing_open(), message.id, std::nullopt);
  } else if (stills_.size() >= stills_max) {
    refuse(make_error(ErrorKind::busy, "earlier stills are pending; wait for one to finish"),
           message.id, std::nullopt);
  } else if (const auto fits = size_still(message, still.view); !fits) {
    refuse(fits.error(), message.id, std::nullopt);
  } else {
    if (stills_.empty()) still_turn_ = false;
    stills_.push_back(std::move(still));
    effects_.emplace_back(
        SendText{protocol::ProgressMessage{message.id, "still", 0, std::nullopt}});
  }
}

void Session::follow(const protocol::PlayMessage& message, Micros now) {
  if (view_.dataset.empty()) {
    refuse(nothing_open(), std::nullopt, std::nullopt);
    return;
  }
  const auto steps = surroundings_.check(view_);
  if (!steps) {
    refuse(steps.error(), std::nullopt, std::nullopt);
  } else if (std::max(message.from, message.to) >= *steps) {
    const char* const key = message.to >= *steps ? "/to" : "/from";
    refuse(make_error_at(ErrorKind::invalid, key,
                         "must be at most " + std::to_string(*steps - 1) + ", the last step"),
           std::nullopt, std::nullopt);
  } else {
    if (!player_.running()) pace_.reset();
    player_.start(message, view_.step, now);
  }
}

void Session::follow(const protocol::PauseMessage& /*message*/, Micros /*now*/) { player_.stop(); }

void Session::follow(const protocol::AckMessage& message, Micros now) {
  if (message.seq > sent_seq_) {
    refuse(make_error_at(ErrorKind::invalid, "/seq",
                         "was never sent; the newest frame is " + std::to_string(sent_seq_)),
           std::nullopt, std::nullopt);
    return;
  }
  acked_seq_ = std::max(acked_seq_, message.seq);
  link_.acked(message.seq, message.decode_ms, now);
}

void Session::follow(const protocol::VisibilityMessage& message, Micros now) {
  // Steps that passed in the meantime were not visible.
  if (hidden_ && !message.hidden) player_.move_to(view_.step, now);
  hidden_ = message.hidden;
  if (hidden_) abandon_render();
}

// --- changes of the view ------------------------------------------------------------------------

void Session::change(protocol::ViewDocument next, std::optional<std::uint32_t> rev,
                     std::string patch_json, Micros now) {
  show(std::move(next), now);
  changes_.push_back({version_, rev, std::move(patch_json)});
  const auto bytes = [&] {
    std::size_t sum = 0;
    for (const Change& kept : changes_) sum += kept.patch_json.size();
    return sum;
  };
  while (changes_.size() > changes_max || (changes_.size() > 1 && bytes() > change_bytes_max)) {
    settle_oldest();
  }
}

void Session::show(protocol::ViewDocument next, Micros now) {
  const int step = view_.step;
  const std::string dataset = view_.dataset;
  document_ = std::move(next);
  view_ = document_.view();
  if (view_.dataset != dataset) {
    chooser_ = Chooser();
    final_factor_.reset();
    drawn_style_.clear();
  }
  ++version_;
  if (view_.step != step) step_version_ = version_;
  changed_at_ = now;
  thinner_ = 0;
  const bool at_rest =
      render_ && (render_->purpose == Purpose::final || render_->purpose == Purpose::refining);
  if (at_rest) abandon_render();
}

void Session::settle_oldest() {
  if (auto next = proved_.patched(changes_.front().patch_json)) proved_ = std::move(*next);
  proved_rev_ = changes_.front().rev.value_or(proved_rev_);
  changes_.pop_front();
}

void Session::settle(std::uint64_t version) {
  if (version == version_) {  // usual case: no need to search the changes
    proved_ = document_;
    proved_rev_ = rev_;
    changes_.clear();
  }
  while (!changes_.empty() && changes_.front().version <= version) settle_oldest();
}

void Session::answered(std::uint64_t version) {
  if (unanswered_ && *unanswered_ <= version) unanswered_.reset();
}

void Session::undo(std::uint64_t version, Micros now) {
  const auto refused = std::find_if(changes_.begin(), changes_.end(),
                                    [&](const Change& kept) { return kept.version == version; });
  if (refused == changes_.end()) return;
  changes_.erase(refused);
  protocol::ViewDocument next = proved_;
  rev_ = proved_rev_;
  unanswered_.reset();
  for (const Change& kept : changes_) {
    if (auto patched = next.patched(kept.patch_json)) next = std::move(*patched);
    rev_ = kept.rev.value_or(rev_);
    if (kept.rev) unanswered_ = kept.version;
  }
  show(std::move(next), now);
}

void Session::render_failed(const Render& render, const Error& error, Micros now) {
  if (render.purpose == Purpose::still) {
    refuse(error, render.still_id, std::nullopt);
    return;
  }
  auto fault = std::find_if(changes_.begin(), changes_.end(),
                            [&](const Change& kept) { return kept.version == render.version; });
  // A view reconstructed by an undo has no change of its own: undo the newest one next, until the
  // rest has been drawn before.
  if (fault == changes_.end() && render.version == version_ && !changes_.empty()) {
    fault = std::prev(changes_.end());
  }
  if (fault != changes_.end()) {
    // Playback into a step that cannot be shown stops.
    if (!fault->rev) player_.stop();
    refuse(error, std::nullopt, fault->rev);
    not_opened_ = error;
    undo(fault->version, now);
    return;
  }
  // No earlier view: report the error and wait for a change.
  refuse(error, std::nullopt, render.rev);
  answered(render.version);
  player_.stop();
  drawn_version_ = render.version;
  drawn_final_ = true;
}

Error Session::nothing_open() const {
  if (!not_opened_) return make_error(ErrorKind::not_found, "no dataset is open");
  return make_error(not_opened_->kind, "no dataset is open: " + not_opened_->message);
}

void Session::refuse(const Error& error, std::optional<std::uint32_t> id,
                     std::optional<std::uint32_t> rev) {
  effects_.emplace_back(SendText{protocol::ErrorMessage{id, rev, protocol::problem_from(error)}});
}

void Session::close(int code, std::string reason) {
  abandon_render();
  if (render_ && !render_->unwanted) effects_.emplace_back(CancelRender{render_->ticket});
  closed_ = true;
  request_prefetch();
  effects_.emplace_back(Close{code, std::move(reason)});
}

void Session::abandon_render() {
  if (!render_ || render_->unwanted || render_->purpose == Purpose::still) return;
  render_->unwanted = true;
  effects_.emplace_back(CancelRender{render_->ticket});
}

Effects Session::finish(Micros now) {
  if (!closed_ && now - heard_at_ >= options_.idle_timeout_us) {
    close(close_idle, "idle timeout: no message received");
  }
  if (!closed_) {
    advance_step(now);
    confirm_unchanged();
    start_next(now);
    request_prefetch();
    tell_reading(now);
  }
  return std::exchange(effects_, {});
}

}  // namespace windsplat::session
