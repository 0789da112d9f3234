// Which connection gives its place to a newcomer.
#include "server/net/connections.hpp"

#include <gtest/gtest.h>

namespace windsplat::net {
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

TEST(Connections, end_the_one_that_is_idle_for_longest) {
  const Clock::time_point now = Clock::now();
  const auto of = [&](int seconds) {
    return std::make_shared<Idle>(now - std::chrono::seconds(seconds));
  };
  const auto busy = std::make_shared<Idle>(std::nullopt);
  const std::vector<std::shared_ptr<Idle>> idle{of(1), of(30), of(2)};
  Connections connections;
  connections.add(connections.next_id(), busy, false);
  for (const auto& one : idle) connections.add(connections.next_id(), one, false);
  EXPECT_FALSE(connections.end_longest(&Connection::idle_since, 3)) << "so many there may be";
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

}  // namespace
}  // namespace windsplat::net
