// Reports the progress of loading while a frame or a description waits for data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/messages.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/surroundings.hpp"

namespace windsplat::session {

class LoadProgress {
 public:
  // `waited_for`: 0 for a description, the ticket for a frame, nullopt if nothing is waited for.
  std::optional<protocol::ProgressMessage> due(std::optional<std::uint64_t> waited_for,
                                               const WhatIsRead& what_is_read,
                                               const std::string& dataset, Micros now);
  // Time at which the next report is due.
  [[nodiscard]] std::optional<Micros> due_at() const;

 private:
  struct Wait {
    std::uint64_t what = 0;
    Micros tell_at = 0;
  };
  std::optional<Wait> wait_;
};

}  // namespace windsplat::session
