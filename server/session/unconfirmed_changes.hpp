// The changes of a view that are not confirmed as drawable by a frame, and the view before them.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "protocol/codec.hpp"

namespace windsplat::session {

class UnconfirmedChanges {
 public:
  struct Change {
    std::uint64_t version = 0;
    std::optional<std::uint32_t> rev;  // nullopt if the client did not send it
    std::string patch_json;
  };

  // Beyond a limit on number or size, the oldest changes count as confirmed.
  void add(Change change);
  // Records that a frame of that version was drawn.
  void confirm(std::uint64_t version);
  // Records that the newest version was drawn, with its document.
  void confirm_all(const protocol::ViewDocument& document, std::uint32_t rev);
  // The change to which a failed render of the version is attributed. A view reconstructed by a
  // removal has no change of its own (`newest`): then the newest change is chosen, until the
  // remaining view has been drawn before.
  [[nodiscard]] std::optional<Change> find_fault(std::uint64_t version, bool newest) const;
  // Returns false if there is no such change.
  bool remove(std::uint64_t version);

  // The view with the changes that remain.
  struct Rebuilt {
    protocol::ViewDocument document;
    std::uint32_t rev = 0;
    std::optional<std::uint64_t> unanswered;  // the newest version that the client sent
  };
  [[nodiscard]] Rebuilt rebuilt() const;

 private:
  void confirm_oldest();
  [[nodiscard]] std::size_t bytes() const;

  protocol::ViewDocument confirmed_;  // the newest view known to be drawable
  std::uint32_t confirmed_rev_ = 0;
  std::deque<Change> changes_;
};

}  // namespace windsplat::session
