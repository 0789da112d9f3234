// Metrics of the server: events in from any thread, Prometheus text format out. All series exist
// from the start, so that clients cannot create more.
// docs/user/metrics.md describes each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/frame_header.hpp"
#include "server/data/resident/budget.hpp"
#include "server/metrics/limit_kind.hpp"
#include "server/session/effects.hpp"

namespace windsplat::metrics {

// Thread-safe.
class Metrics {
 public:
  enum class Stage { queue, render, encode, write, describe };
  enum class Over { http, stream };

  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // Responses are counted by these routes, others as "other". Call before events arrive.
  void count_routes(const std::vector<const char*>& routes);
  void stage_took(Stage stage, std::int64_t us);
  // A frame written completely to the socket. stands_in: see session::SendFrame.
  void frame_sent(session::Tier tier, const protocol::FrameHeader& header, bool stands_in);
  void video_encoders(int more);  // negative: fewer
  void video_failed();            // the encoder: JPEG is sent
  void frames_dropped(std::uint64_t count);
  void renders_cancelled(std::uint64_t count);
  void bytes_sent(Over over, std::size_t bytes);
  void unsent(std::int64_t more_bytes);  // negative: fewer
  void session_opened();
  void session_closed();
  void answered(std::string_view route, int status);
  void accept_failed();
  void handshake_took(std::int64_t us);  // processor time
  void connection_refused();             // closed without a response because of a limit
  void refused(LimitKind kind);
  void dataset_opened(bool ok);
  void background_done(bool cancelled);

  // All metrics, including those of `budget` and of the process.
  [[nodiscard]] std::string text(const data::BudgetCounts& budget) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::metrics
