// Time steps running by themselves: a clock in, the step to show out.
#pragma once

#include <optional>

#include "protocol/messages.hpp"
#include "server/session/level_chooser.hpp"

namespace windsplat::session {

class Player {
 public:
  // Goes on from `step` if it is one of the message's, else begins at its first; a last step that
  // is not to be followed by the first begins anew.
  void start(const protocol::PlayMessage& message, int step, Micros now);
  void stop() { running_ = false; }
  // The user chose a step: time goes on from there.
  void move_to(int step, Micros now);

  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] Micros period() const { return period_us_; }

  // The step due now. `shown`: the present one was sent; without `drop` the next waits for that.
  // Stops by itself after the last step when it does not loop.
  int step_at(Micros now, bool shown);
  // When the next step is due; none if it waits for the present one.
  [[nodiscard]] std::optional<Micros> next_at(bool shown) const;

 private:
  [[nodiscard]] Micros count() const { return Micros{message_.to} - message_.from + 1; }

  bool running_ = false;
  protocol::PlayMessage message_;
  Micros period_us_ = 100'000;
  int step_ = 0;
  Micros due_ = 0;  // of the step after step_
};

}  // namespace windsplat::session
