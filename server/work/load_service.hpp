// Threads that load data which a picture needs and which is not resident, so that the renderer
// never waits for a disk. Jobs run in order of arrival, one at a time per dataset: a dataset whose
// files hang occupies one thread only. A job that runs for long, because its files hang or it waits
// for memory, gives its place to the next one while there are spare threads.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::work {

class LoadService {
 public:
  struct Job {
    CancelToken cancel;
    // Called exactly once on a thread of the service, cancelled or not. Must not throw.
    std::function<void()> run;
    // Bounded elsewhere: a job of a session, or the continuation of an admitted request. Neither
    // counted nor refused.
    bool admitted = false;
    // The dataset that is read (Dataset::shared_info()): its jobs run one at a time. Empty: none.
    std::shared_ptr<const void> dataset = nullptr;
    std::string payer = {};  // address of the client; empty: none
  };

  // `jobs_max`: limit of waiting jobs per dataset; the total limit is datasets_full times as many.
  // One payer may use half of either. `what`: the jobs' name in error messages ("loads"). `refused`
  // is called for each refusal. `spare`: threads beyond `threads`, which limits the jobs started
  // less than `long_run` ago.
  static constexpr std::size_t datasets_full = 4;
  static constexpr std::chrono::milliseconds long_run{500};
  LoadService(std::size_t threads, std::size_t jobs_max, const char* what,
              std::function<void()> refused = {}, std::size_t spare = 0);
  ~LoadService();
  LoadService(const LoadService&) = delete;
  LoadService& operator=(const LoadService&) = delete;

  // Errors: busy if too many uncancelled jobs wait, for the dataset or in total; draining after
  // end().
  Result<void> submit(Job job);
  // Cancels waiting jobs, runs them, joins the threads; later jobs are refused.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::work
