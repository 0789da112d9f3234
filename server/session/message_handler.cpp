#include "server/session/message_handler.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "server/session/view_changes.hpp"

namespace windsplat::session {

void MessageHandler::operator()(const protocol::OpenMessage& message) {
  if (state_.openings.full()) {
    state_.refuse(
        make_error(ErrorKind::busy, "too many datasets are being opened; wait for one to finish"),
        message.id, std::nullopt);
    return;
  }
  protocol::View bare;
  bare.dataset = message.dataset;
  if (const auto known = state_.surroundings.check(bare); !known) {
    state_.openings.failed(known.error());
    state_.refuse(known.error(), message.id, std::nullopt);
    return;
  }
  std::uint64_t version = 0;
  if (state_.view.view().dataset != message.dataset) {
    std::string patch = protocol::dataset_patch(message.dataset);
    auto next = state_.view.document().patched(patch);
    if (!next) {
      state_.refuse(next.error(), message.id, std::nullopt);
      return;
    }
    state_.player.stop();
    state_.slot.abandon(state_.effects);
    change_view(state_, std::move(*next), std::move(patch), now_);
    version = state_.view.version();
  }
  state_.openings.add(message.id, version);
  state_.send(protocol::ProgressMessage{message.id, "loading", 0, std::nullopt});
  state_.effects.emplace_back(Describe{message.id, message.dataset});
}

void MessageHandler::operator()(const protocol::PatchMessage& message) {
  auto next = state_.view.document().patched(message.patch_json);
  if (!next) {
    state_.refuse(next.error(), std::nullopt, message.rev);
    return;
  }
  const protocol::View view = next->view();
  // A client may set the picture size before it opens a dataset.
  if (!view.dataset.empty()) {
    if (const auto drawable = state_.surroundings.check(view); !drawable) {
      state_.refuse(drawable.error(), std::nullopt, message.rev);
      return;
    }
  }
  if (view.dataset != state_.view.view().dataset) state_.player.stop();
  if (view.step != state_.view.view().step) state_.player.move_to(view.step, now_);
  change_view(state_, std::move(*next), message, now_);
}

void MessageHandler::operator()(const protocol::StillMessage& message) {
  if (state_.view.view().dataset.empty()) {
    state_.refuse(state_.openings.nothing_open(), message.id, std::nullopt);
    return;
  }
  const auto added =
      state_.stills.add({message, state_.view.view(), state_.view.rev(), state_.view.t()});
  if (!added) {
    state_.refuse(added.error(), message.id, std::nullopt);
    return;
  }
  state_.send(protocol::ProgressMessage{message.id, "still", 0, std::nullopt});
}

void MessageHandler::operator()(const protocol::PlayMessage& message) {
  const protocol::View& view = state_.view.view();
  if (view.dataset.empty()) {
    state_.refuse(state_.openings.nothing_open(), std::nullopt, std::nullopt);
    return;
  }
  const auto steps = state_.surroundings.check(view);
  if (!steps) {
    state_.refuse(steps.error(), std::nullopt, std::nullopt);
  } else if (std::max(message.from, message.to) >= *steps) {
    const char* const key = message.to >= *steps ? "/to" : "/from";
    state_.refuse(
        make_error_at(ErrorKind::invalid, key,
                      "must be at most " + std::to_string(*steps - 1) + ", the last step"),
        std::nullopt, std::nullopt);
  } else {
    if (!state_.player.running()) state_.playback_rate.reset();
    state_.player.start(message, view.step, now_);
  }
}

void MessageHandler::operator()(const protocol::PauseMessage& /*message*/) { state_.player.stop(); }

void MessageHandler::operator()(const protocol::AckMessage& message) {
  if (const auto acked = state_.flow.acked(message, now_); !acked) {
    state_.refuse(acked.error(), std::nullopt, std::nullopt);
  }
}

void MessageHandler::operator()(const protocol::VisibilityMessage& message) {
  // Steps that passed in the meantime were not visible.
  if (state_.hidden && !message.hidden) {
    state_.player.move_to(state_.view.view().step, now_);
  }
  state_.hidden = message.hidden;
  if (!state_.hidden) return;
  state_.slot.abandon(state_.effects);
  state_.effects.emplace_back(Hide{});
}

void MessageHandler::operator()(const protocol::VideoMessage& message) {
  // A frame that is being encoded belongs to the stream that ends here.
  state_.slot.restart_video();
  state_.video.announced(message.codecs);
}

}  // namespace windsplat::session
