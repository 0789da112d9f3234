// Derives the due step from the due time of the next one; late calls skip steps or wait.
#include "server/session/playback/player.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace windsplat::session {

bool Player::contains(int step) const {
  const auto [low, high] = std::minmax(message_.from, message_.to);
  return step >= low && step <= high;
}

std::int64_t Player::count() const {
  return std::abs(std::int64_t{message_.to} - message_.from) + 1;
}

std::int64_t Player::place(int step) const { return std::abs(std::int64_t{step} - message_.from); }

int Player::step_of(std::int64_t place) const {
  const int direction = message_.from <= message_.to ? 1 : -1;
  return message_.from + direction * static_cast<int>(place);
}

void Player::start(const protocol::PlayMessage& message, int step, Micros now) {
  const Micros before = due_ - period_us_;  // start of the current step
  message_ = message;
  period_us_ = std::max<Micros>(1, std::llround(1e6 / message.fps));
  step_ = contains(step) ? step : message.from;
  if (running_) {
    // Never in the past: earlier delays are not made up.
    due_ = std::max(now, before + period_us_);
  } else {
    if (ended()) step_ = message.from;
    due_ = now + period_us_;
  }
  running_ = true;
}

void Player::move_to(int step, Micros now) {
  if (!running_) return;
  const auto [low, high] = std::minmax(message_.from, message_.to);
  step_ = std::clamp(step, low, high);
  due_ = now + period_us_;
}

Player::Advance Player::advance(Micros now, bool shown) {
  if (!running_) return {step_, 0};
  if (ended() || count() == 1) {  // no further step
    running_ = false;
    return {step_, 0};
  }
  if (now < due_ || (!message_.drop && !shown)) return {step_, 0};
  const std::int64_t late = message_.drop ? (now - due_) / period_us_ : 0;
  // Without drop a late step does not shorten the following periods.
  due_ = message_.drop ? due_ + (1 + late) * period_us_ : std::max(due_ + period_us_, now);
  const std::int64_t here = place(step_);
  const std::int64_t there = here + 1 + late;
  const std::int64_t end = message_.loop ? there : std::min(there, count() - 1);
  step_ = step_of(end % count());
  if (ended()) running_ = false;
  return {step_, end - here};
}

std::optional<Micros> Player::next_at(bool shown) const {
  if (!running_ || (!message_.drop && !shown)) return std::nullopt;
  return due_;
}

std::vector<int> Player::upcoming(int most) const {
  std::vector<int> steps;
  const std::int64_t here = place(step_);
  for (std::int64_t ahead = 1; ahead < count() && ahead <= most; ++ahead) {
    if (!message_.loop && here + ahead >= count()) break;
    steps.push_back(step_of((here + ahead) % count()));
  }
  return steps;
}

}  // namespace windsplat::session
