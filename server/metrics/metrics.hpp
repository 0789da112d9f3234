// What the server counts about itself: events in from any thread, text in Prometheus' exposition
// format out. Every series is there from the start, so that no client can make more of them.
// docs/user/metrics.md describes each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "protocol/frame_header.hpp"
#include "server/data/resident/budget.hpp"
#include "server/metrics/limit_kind.hpp"
#include "server/session/effects.hpp"

namespace windsplat::net {

// Thread-safe.
class Metrics {
 public:
  enum class Stage { queue, render, encode, write };
  enum class Over { http, stream };

  // Answers are counted by route: one of `routes`, else "other".
  explicit Metrics(std::span<const char* const> routes = {});
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  void stage_took(Stage stage, std::int64_t us);
  // A frame that was handed to the socket whole.
  void frame_sent(session::Tier tier, const protocol::FrameHeader& header);
  void frames_dropped(std::uint64_t count);
  void renders_cancelled(std::uint64_t count);
  void bytes_sent(Over over, std::size_t bytes);
  void unsent(std::int64_t more_bytes);  // or fewer
  void session_opened();
  void session_closed();
  void answered(std::string_view route, int status);
  void accept_failed();
  void handshake_took(std::int64_t us);  // of a processor
  void connection_refused();             // closed unanswered: there were too many
  void refused(LimitKind kind);
  void dataset_opened(bool ok);
  void background_done(bool cancelled);

  // All of it, with what `budget` counts and what the system tells of this process.
  [[nodiscard]] std::string text(const data::BudgetCounts& budget) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::net
