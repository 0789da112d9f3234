#include "server/session/view_state.hpp"

#include <utility>

namespace windsplat::session {

void ViewState::show(protocol::ViewDocument next, Micros now) {
  const int step = view_.step;
  document_ = std::move(next);
  view_ = document_.view();
  ++version_;
  if (view_.step != step) step_version_ = version_;
  changed_at_ = now;
}

void ViewState::change(protocol::ViewDocument next, std::string patch_json, Micros now) {
  show(std::move(next), now);
  unconfirmed_.add({version_, std::nullopt, std::move(patch_json)});
}

void ViewState::change(protocol::ViewDocument next, const protocol::PatchMessage& patch,
                       Micros now) {
  rev_ = patch.rev;
  t_ = patch.t;
  show(std::move(next), now);
  unconfirmed_.add({version_, patch.rev, patch.patch_json});
  unanswered_ = version_;
}

void ViewState::confirm(std::uint64_t version) {
  if (version == version_) {  // usual case: no need to search the changes
    unconfirmed_.confirm_all(document_, rev_);
  } else {
    unconfirmed_.confirm(version);
  }
}

std::optional<ViewState::Change> ViewState::find_fault(std::uint64_t version) const {
  return unconfirmed_.find_fault(version, version == version_);
}

bool ViewState::undo(std::uint64_t version, Micros now) {
  if (!unconfirmed_.remove(version)) return false;
  UnconfirmedChanges::Rebuilt rebuilt = unconfirmed_.rebuilt();
  rev_ = rebuilt.rev;
  unanswered_ = rebuilt.unanswered;
  show(std::move(rebuilt.document), now);
  return true;
}

void ViewState::answered(std::uint64_t version) {
  if (unanswered_ && *unanswered_ <= version) unanswered_.reset();
}

}  // namespace windsplat::session
