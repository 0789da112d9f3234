// The render thread. Jobs in from any thread; each runs to completion before the next, so that a
// frame has the whole thread pool. For the scheduling see render_queue.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/tasks/render_queue.hpp"

namespace windsplat::tasks {

class RenderService {
 public:
  using Kind = RenderKind;
  using Job = RenderJob;

  struct Options {
    // Limit on waiting jobs of kind request, not counting cancelled ones; a payer may have half of
    // it. Sessions limit the jobs of streams to one at a time each, owners those of the background.
    std::size_t requests_max = 16;
    double requests_ms_max = 30'000;  // limit on the sum of the jobs' estimates; a single job is
                                      // always admitted
    std::function<std::int64_t()> now_us = {};  // empty: a steady clock
    // Limit on how long requests of other payers may delay a request that is itself shorter; 0: no
    // additional limit.
    double others_ms_max = 0;
    // Called on the renderer's thread with the time of each job that has a payer, and on each
    // refusal.
    std::function<void(const std::string& payer, std::int64_t us)> charge = {};
    std::function<void()> refused = {};
  };

  explicit RenderService(Options options);
  ~RenderService();  // calls end()
  RenderService(const RenderService&) = delete;
  RenderService& operator=(const RenderService&) = delete;

  // Errors: busy, with the time until the waiting jobs are done, for requests only; draining after
  // end().
  Result<void> submit(Job job);

  // Time that a new job of a stream is expected to wait: that of recent ones, or, if more wait now,
  // of those waiting. 0: none ran within the last second, and none waits. Any thread.
  [[nodiscard]] std::int64_t stream_wait_us() const;

  // Raises the token of every waiting or running job.
  void cancel_all();
  // Cancels all jobs, runs the waiting ones, joins the thread; later jobs are refused.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::tasks
