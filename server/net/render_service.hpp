// The one thread that loads and draws. Jobs in from any thread; each runs to its end before the
// next: a frame has the whole thread pool to itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::net {

class RenderService {
 public:
  enum class Kind { stream, request };

  struct Job {
    Kind kind = Kind::request;
    std::uint64_t owner = 0;  // session or connection; jobs of one owner run in order
    CancelToken cancel;       // raised from outside, or by cancel_all()
    // Runs once, cancelled or not, on the renderer's thread. Must not throw.
    std::function<void(std::int64_t queue_us)> run;
  };

  // `requests_max`: jobs of kind request that may wait, cancelled ones not counted. Those of
  // streams are bounded by their sessions, each of which asks for one at a time.
  explicit RenderService(std::size_t requests_max);
  ~RenderService();  // cancels everything, runs what waits, joins
  RenderService(const RenderService&) = delete;
  RenderService& operator=(const RenderService&) = delete;

  // Streams and requests take turns, and so do the owners within each kind. Errors: busy.
  Result<void> submit(Job job);

  // Raises the token of every job that waits or runs.
  void cancel_all();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::net
