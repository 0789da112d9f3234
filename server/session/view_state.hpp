// The newest view of a session, the counts of its changes, and their removal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/codec.hpp"
#include "protocol/messages.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/unconfirmed_changes.hpp"

namespace windsplat::session {

// A version is the number of changes so far; `rev` and `t` are those of the client's newest patch.
class ViewState {
 public:
  using Change = UnconfirmedChanges::Change;

  explicit ViewState(Micros now) : changed_at_(now) {}

  [[nodiscard]] const protocol::ViewDocument& document() const { return document_; }
  [[nodiscard]] const protocol::View& view() const { return view_; }
  [[nodiscard]] std::uint32_t rev() const { return rev_; }
  [[nodiscard]] double t() const { return t_; }
  [[nodiscard]] std::uint64_t version() const { return version_; }
  // Version of the last change of /step.
  [[nodiscard]] std::uint64_t step_version() const { return step_version_; }
  [[nodiscard]] Micros changed_at() const { return changed_at_; }

  // The document with the patch applied becomes the view.
  void change(protocol::ViewDocument next, std::string patch_json, Micros now);
  // The same for a patch of the client, which expects an answer.
  void change(protocol::ViewDocument next, const protocol::PatchMessage& patch, Micros now);
  // Counts as a change, although there is none: the same view must be drawn again.
  void renew(Micros now) { show(document_, now); }

  // Records that the view of that version can be drawn.
  void confirm(std::uint64_t version);
  // The change to which a failed render of the version is attributed.
  [[nodiscard]] std::optional<Change> find_fault(std::uint64_t version) const;
  // Removes the change of that version. False: there is none, or it was confirmed.
  bool undo(std::uint64_t version, Micros now);

  // Whether a patch still needs a frame or `unchanged`.
  [[nodiscard]] bool is_unanswered() const { return unanswered_.has_value(); }
  void answered(std::uint64_t version);  // patches up to that version

 private:
  void show(protocol::ViewDocument next, Micros now);

  protocol::ViewDocument document_;
  protocol::View view_;  // the same view, typed
  std::uint32_t rev_ = 0;
  double t_ = 0;
  std::uint64_t version_ = 0;
  std::uint64_t step_version_ = 0;
  Micros changed_at_ = 0;
  UnconfirmedChanges unconfirmed_;
  std::optional<std::uint64_t> unanswered_;  // version of the newest patch, until it is answered
};

}  // namespace windsplat::session
