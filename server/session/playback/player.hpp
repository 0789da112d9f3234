// Playback of time steps: a clock in, the step to show out.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/messages.hpp"
#include "server/session/pacing/chooser.hpp"

namespace windsplat::session {

class Player {
 public:
  // Continues from `step` if it is in the range of the message, otherwise starts at its first step.
  // After a stop, playback that had reached its end starts again. During playback only the
  // parameters change: the next step is due one new period after the last one, or at once if that
  // time has passed.
  void start(const protocol::PlayMessage& message, int step, Micros now);
  void stop() { running_ = false; }
  // The user chose a step; playback continues from there.
  void move_to(int step, Micros now);

  [[nodiscard]] bool running() const { return running_; }
  [[nodiscard]] Micros period() const { return period_us_; }

  struct Advance {
    int step = 0;
    std::int64_t passed = 0;  // steps since the previous one
  };
  // The step due now. `shown`: the current one was sent; without `drop` the next step waits for
  // that. Stops after the last step unless playback loops.
  Advance advance(Micros now, bool shown);
  // Time when the next step is due; nullopt if it waits for the current one.
  [[nodiscard]] std::optional<Micros> next_at(bool shown) const;
  // The steps after the current one, nearest first, without duplicates, at most `most`.
  [[nodiscard]] std::vector<int> upcoming(int most) const;

 private:
  [[nodiscard]] bool contains(int step) const;
  [[nodiscard]] std::int64_t count() const;
  [[nodiscard]] std::int64_t place(int step) const;     // position in playback order, from 0
  [[nodiscard]] int step_of(std::int64_t place) const;  // the inverse
  [[nodiscard]] bool ended() const { return !message_.loop && step_ == message_.to; }

  bool running_ = false;
  protocol::PlayMessage message_;
  Micros period_us_ = 100'000;
  int step_ = 0;
  Micros due_ = 0;  // due time of the step after step_
};

}  // namespace windsplat::session
