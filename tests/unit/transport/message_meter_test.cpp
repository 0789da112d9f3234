// The bytes of an incoming message that never ends.
#include "server/transport/websocket/message_meter.hpp"

#include <gtest/gtest.h>

#include "protocol/limits.hpp"

namespace windsplat::transport {
namespace {

using Verdict = MessageMeter::Verdict;
using std::chrono::seconds;

constexpr std::size_t wire_bytes_max = 2 * protocol::limits::message_bytes_max;
const MessageMeter::Clock::time_point start{};

TEST(MessageMeter, AllowsTenSecondsFromTheFirstByte) {
  MessageMeter meter;
  EXPECT_EQ(meter.check(0, start), Verdict::fine);
  EXPECT_EQ(meter.check(1, start + seconds(30)), Verdict::fine);
  EXPECT_EQ(meter.check(2, start + seconds(40)), Verdict::fine);
  EXPECT_EQ(meter.check(3, start + seconds(41)), Verdict::too_slow);
}

TEST(MessageMeter, StartsAnewAfterACompleteMessage) {
  MessageMeter meter;
  EXPECT_EQ(meter.check(1, start), Verdict::fine);
  meter.heard_whole();
  EXPECT_EQ(meter.check(0, start + seconds(11)), Verdict::fine);
  EXPECT_EQ(meter.check(1, start + seconds(12)), Verdict::fine);
}

TEST(MessageMeter, LimitsTheBytesOfAMessage) {
  MessageMeter meter;
  EXPECT_EQ(meter.check(wire_bytes_max, start), Verdict::fine);
  EXPECT_EQ(meter.check(wire_bytes_max + 1, start), Verdict::too_long);
}

TEST(MessageMeter, DoesNotCountControlFrames) {
  MessageMeter meter;
  EXPECT_TRUE(meter.heard_control(4, 10));  // six bytes of header
  EXPECT_EQ(meter.check(10, start), Verdict::fine);
  EXPECT_EQ(meter.check(10, start + seconds(20)), Verdict::fine) << "no message has begun";
}

TEST(MessageMeter, RefusesAFloodOfControlFramesBetweenTwoChecks) {
  MessageMeter meter;
  for (int i = 1; i < 10000; ++i) ASSERT_TRUE(meter.heard_control(0, 0)) << i;
  meter.check(0, start);
  for (int i = 1; i < 10000; ++i) ASSERT_TRUE(meter.heard_control(0, 0)) << i;
  EXPECT_FALSE(meter.heard_control(0, 0));
}

}  // namespace
}  // namespace windsplat::transport
