#include "server/session/view_changes.hpp"

#include <utility>

#include "protocol/codec.hpp"

namespace windsplat::session {
namespace {

void after_change(SessionState& state, const std::string& dataset_before) {
  state.quality.on_view_changed(state.view.view().dataset != dataset_before);
  state.slot.abandon_rest(state.effects);
}

}  // namespace

void change_view(SessionState& state, protocol::ViewDocument next, std::string patch_json,
                 Micros now) {
  const std::string dataset = state.view.view().dataset;
  state.view.change(std::move(next), std::move(patch_json), now);
  after_change(state, dataset);
}

void change_view(SessionState& state, protocol::ViewDocument next,
                 const protocol::PatchMessage& patch, Micros now) {
  const std::string dataset = state.view.view().dataset;
  state.view.change(std::move(next), patch, now);
  after_change(state, dataset);
}

void change_step(SessionState& state, int step, Micros now) {
  std::string patch = protocol::step_patch(step);
  if (auto next = state.view.document().patched(patch)) {
    change_view(state, std::move(*next), std::move(patch), now);
  }
}

void renew_view(SessionState& state, Micros now) {
  state.view.renew(now);
  after_change(state, state.view.view().dataset);
}

void undo_change(SessionState& state, std::uint64_t version, Micros now) {
  const std::string dataset = state.view.view().dataset;
  if (state.view.undo(version, now)) after_change(state, dataset);
}

}  // namespace windsplat::session
