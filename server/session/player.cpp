// The step that is due follows from the time of the next one; late calls skip or wait.
#include "server/session/player.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::session {

void Player::start(const protocol::PlayMessage& message, int step, Micros now) {
  message_ = message;
  period_us_ = std::max<Micros>(1, std::llround(1e6 / message.fps));
  const bool inside = step >= message.from && step <= message.to;
  const bool at_end = step == message.to && !message.loop;
  step_ = inside && !at_end ? step : message.from;
  due_ = now + period_us_;
  running_ = true;
}

void Player::move_to(int step, Micros now) {
  if (!running_) return;
  step_ = std::clamp(step, message_.from, message_.to);
  due_ = now + period_us_;
}

int Player::step_at(Micros now, bool shown) {
  if (!running_ || now < due_ || (!message_.drop && !shown)) return step_;
  const Micros passed = message_.drop ? 1 + (now - due_) / period_us_ : 1;
  // Without drop a late step does not make the following ones hurry.
  due_ = message_.drop ? due_ + passed * period_us_ : std::max(due_ + period_us_, now);
  const Micros place = step_ - message_.from + passed;
  if (place < count()) {
    step_ = message_.from + static_cast<int>(place);
  } else if (message_.loop) {
    step_ = message_.from + static_cast<int>(place % count());
  } else {
    step_ = message_.to;
  }
  if (!message_.loop && step_ == message_.to) running_ = false;
  return step_;
}

std::optional<Micros> Player::next_at(bool shown) const {
  if (!running_ || (!message_.drop && !shown)) return std::nullopt;
  return due_;
}

}  // namespace windsplat::session
