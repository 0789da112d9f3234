// Time steps running by themselves: a clock in, the step to show out.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/messages.hpp"
#include "server/session/chooser.hpp"

namespace windsplat::session {

class Player {
 public:
  // Goes on from `step` if it is one of the message's, else begins at its first. From rest, a last
  // step that nothing follows begins anew. While steps run already, only how they run changes: the
  // next one comes when the new period has passed since the last one, at once if it has.
  void start(const protocol::PlayMessage& message, int step, Micros now);
  void stop() { running_ = false; }
  // The user chose a step: time goes on from there.
  void move_to(int step, Micros now);

  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] Micros period() const { return period_us_; }

  struct Advance {
    int step = 0;
    std::int64_t passed = 0;  // steps on from the one before
  };
  // The step due now. `shown`: the present one was sent; without `drop` the next waits for that.
  // Stops by itself after the last step when it does not loop.
  Advance advance(Micros now, bool shown);
  // When the next step is due; none if it waits for the present one.
  [[nodiscard]] std::optional<Micros> next_at(bool shown) const;
  // The steps after the present one, nearest first, each once, at most `most`.
  [[nodiscard]] std::vector<int> upcoming(int most) const;

 private:
  [[nodiscard]] bool contains(int step) const;
  [[nodiscard]] std::int64_t count() const;
  [[nodiscard]] std::int64_t place(int step) const;     // in the order of showing, from 0
  [[nodiscard]] int step_of(std::int64_t place) const;  // the inverse
  [[nodiscard]] bool ended() const { return !message_.loop && step_ == message_.to; }

  bool running_ = false;
  protocol::PlayMessage message_;
  Micros period_us_ = 100'000;
  int step_ = 0;
  Micros due_ = 0;  // of the step after step_
};

}  // namespace windsplat::session
