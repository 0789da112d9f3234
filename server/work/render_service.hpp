// The one thread that draws. Jobs in from any thread; each runs to its end before the next: a frame
// has the whole thread pool to itself. Whose turn it is: render_queue.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/work/render_queue.hpp"

namespace windsplat::net {

class RenderService {
 public:
  using Kind = RenderKind;
  using Job = RenderJob;

  struct Options {
    // What may wait of kind request, cancelled ones not counted; of one payer half as many.
    // Streams' jobs are bounded by their sessions, each of which asks for one at a time, background
    // jobs by their owners.
    std::size_t requests_max = 16;
    double requests_ms_max = 30'000;  // by the jobs' own estimates; one alone is always let in
    std::function<std::int64_t()> now_us = {};  // empty: a steady clock
    // How long requests of other payers, where some wait, may keep one waiting that takes less
    // itself; 0: as long as those above allow.
    double others_ms_max = 0;
    // Told what each job took that has a payer, on the renderer's thread, and each refusal.
    std::function<void(const std::string& payer, std::int64_t us)> charge = {};
    std::function<void()> refused = {};
  };

  explicit RenderService(Options options);
  ~RenderService();  // as end()
  RenderService(const RenderService&) = delete;
  RenderService& operator=(const RenderService&) = delete;

  // Errors: busy, with the time after which what waits now will be done, where requests alone are
  // refused; draining after end().
  Result<void> submit(Job job);

  // Raises the token of every job that waits or runs.
  void cancel_all();
  // Cancels everything, runs what waits, joins; refuses whatever comes after.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::net
