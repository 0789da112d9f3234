#include "server/session/load_progress.hpp"

namespace windsplat::session {
namespace {

constexpr Micros first_after = 300'000;
constexpr Micros every = 250'000;

}  // namespace

std::optional<protocol::ProgressMessage> LoadProgress::due(std::optional<std::uint64_t> waited_for,
                                                           const WhatIsRead& what_is_read,
                                                           const std::string& dataset, Micros now) {
  if (!waited_for || !what_is_read) {
    wait_.reset();
    return std::nullopt;
  }
  if (!wait_ || wait_->what != *waited_for) wait_ = Wait{*waited_for, now + first_after};
  if (now < wait_->tell_at) return std::nullopt;
  wait_->tell_at = now + every;
  const auto reading = what_is_read(dataset);
  if (!reading) return std::nullopt;
  return protocol::ProgressMessage{std::nullopt, "loading " + reading->field, reading->done,
                                   std::nullopt};
}

std::optional<Micros> LoadProgress::due_at() const {
  return wait_ ? std::optional(wait_->tell_at) : std::nullopt;
}

}  // namespace windsplat::session
