// The threads that load what a picture needs and is not resident, so that the renderer never waits
// for a disk. Jobs in from any thread, first come first served, but for those of a dataset that one
// of them is busy with: a dataset whose files hang holds one thread and not the others' datasets.
// And a job that runs for long, because its files hang or it waits for memory, leaves its place to
// the next one, as long as there are spare threads.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::net {

class LoadService {
 public:
  struct Job {
    CancelToken cancel;
    // Runs once on a thread of the service's, cancelled or not. Must not throw.
    std::function<void()> run;
    // Bounded elsewhere: a session's, or the rest of what was let in before. Neither counted nor
    // refused.
    bool admitted = false;
    // What is read (Dataset::shared_info()): jobs of one run one at a time. Empty: nothing.
    std::shared_ptr<const void> dataset = nullptr;
    std::string payer = {};  // the address that asks; empty: nobody's
  };

  // `jobs_max`: that may wait for a dataset; for all of them datasets_full times as many. One payer
  // has half of either at most.
  // `what`: the jobs' name in the error of too many ("loads"). `refused` is called each time.
  // `spare`: threads beside the `threads` that run jobs which began less than `long_run` ago.
  static constexpr std::size_t datasets_full = 4;
  static constexpr std::chrono::milliseconds long_run{500};
  LoadService(std::size_t threads, std::size_t jobs_max, const char* what,
              std::function<void()> refused = {}, std::size_t spare = 0);
  ~LoadService();
  LoadService(const LoadService&) = delete;
  LoadService& operator=(const LoadService&) = delete;

  // Errors: busy, where too many wait that are not cancelled, for the same dataset or in all;
  // draining after end().
  Result<void> submit(Job job);
  // Cancels what waits, runs it, joins; refuses whatever comes after.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::net
