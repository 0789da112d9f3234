// Which connection is closed to admit a new one.
#include "server/transport/connections.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace windsplat::transport {
namespace {

using Clock = std::chrono::steady_clock;

class Idle : public Connection {
 public:
  explicit Idle(Since since) : since_(since) {}
  void drain() override {}
  void abort() override {
    since_.reset();
    ended = true;
  }
  [[nodiscard]] Since idle_since() const override { return since_; }
  bool ended = false;

 private:
  Since since_;
};

TEST(Connections, CloseTheLongestIdleConnection) {
  const Clock::time_point now = Clock::now();
  const auto of = [&](int seconds) {
    return std::make_shared<Idle>(now - std::chrono::seconds(seconds));
  };
  const auto busy = std::make_shared<Idle>(std::nullopt);
  const std::vector<std::shared_ptr<Idle>> idle{of(1), of(30), of(2)};
  Connections connections;
  connections.add(connections.next_id(), busy, false);
  for (const auto& one : idle) connections.add(connections.next_id(), one, false);
  EXPECT_FALSE(connections.end_longest(&Connection::idle_since, 3)) << "the limit";
  EXPECT_FALSE(connections.end_longest(&Connection::unasked_since));
  EXPECT_TRUE(connections.end_longest(&Connection::idle_since, 2));
  EXPECT_TRUE(idle[1]->ended);
  EXPECT_TRUE(connections.end_longest(&Connection::idle_since));
  EXPECT_TRUE(idle[2]->ended);
  EXPECT_FALSE(idle[0]->ended);
  EXPECT_TRUE(connections.end_longest(&Connection::idle_since));
  EXPECT_FALSE(connections.end_longest(&Connection::idle_since));
  EXPECT_FALSE(busy->ended);
}

class Shaking : public Connection {
 public:
  Shaking(std::string address, int seconds, bool known = false)
      : address_(std::move(address)),
        since_(Clock::now() - std::chrono::seconds(seconds)),
        known_(known) {}
  void drain() override {}
  void abort() override { since_.reset(); }
  [[nodiscard]] Since handshaking_since() const override { return since_; }
  [[nodiscard]] std::string_view address() const override { return address_; }
  [[nodiscard]] bool is_known() const override { return known_; }
  [[nodiscard]] bool ended() const { return !since_; }

 private:
  const std::string address_;
  Since since_;
  const bool known_;
};

TEST(Connections, CloseAHandshakeOfTheLargestHolderAndUnauthenticatedFirst) {
  std::vector<std::shared_ptr<Shaking>> all;
  Connections connections;
  const auto come = [&](const std::string& address, int seconds, bool known = false) {
    all.push_back(std::make_shared<Shaking>(address, seconds, known));
    connections.add(connections.next_id(), all.back(), false);
  };
  const auto next = [&](std::size_t most) {  // index of the closed connection; -1: none
    std::vector<bool> before;
    for (const auto& one : all) before.push_back(one->ended());
    if (!connections.end_handshake(most)) return -1;
    for (std::size_t n = 0; n < all.size(); ++n) {
      if (all[n]->ended() != before[n]) return static_cast<int>(n);
    }
    return -2;
  };
  EXPECT_EQ(next(0), -1);
  come("a", 100, true);  // 0
  come("b", 90);         // 1
  come("c", 10);         // 2
  come("c", 20);         // 3
  come("a", 80, true);   // 4
  come("a", 70, true);   // 5
  connections.add(connections.next_id(), std::make_shared<Idle>(std::nullopt), false);
  EXPECT_EQ(next(6), -1);
  EXPECT_EQ(next(5), 3) << "the oldest of the unauthenticated address with two";
  EXPECT_EQ(next(4), 1) << "one each";
  EXPECT_EQ(next(3), 2);
  EXPECT_EQ(next(2), 0) << "no other connection is left";
  EXPECT_EQ(next(2), -1);
}

}  // namespace
}  // namespace windsplat::transport
