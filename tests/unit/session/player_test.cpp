// Times of steps determined by the clock only: late steps are dropped or delayed.
#include "server/session/playback/player.hpp"

#include <gtest/gtest.h>

namespace windsplat::session {
namespace {

constexpr Micros ms = 1000;

// From step 0 at time 0 through 100 steps, ten per second.
Player playing(bool drop) {
  Player player;
  player.start({0, 99, 10, true, drop}, 0, 0);
  return player;
}

TEST(Player, LateStepsAreDroppedTogether) {
  Player player = playing(true);
  EXPECT_EQ(player.advance(99 * ms, true).passed, 0);
  const auto late = player.advance(450 * ms, false);  // steps 1 to 4 are due
  EXPECT_EQ(late.step, 4);
  EXPECT_EQ(late.passed, 4);
  EXPECT_EQ(player.next_at(false), 500 * ms);
}

TEST(Player, WithoutDropAStallIsNotCompensated) {
  Player player = playing(false);
  int step = player.advance(1000 * ms, true).step;
  EXPECT_EQ(step, 1);
  for (Micros now = 1000 * ms; now <= 1250 * ms; now += 10 * ms) {
    step = player.advance(now, true).step;
  }
  EXPECT_GE(step, 3) << "two periods later";
  EXPECT_LE(step, 4);
}

}  // namespace
}  // namespace windsplat::session
