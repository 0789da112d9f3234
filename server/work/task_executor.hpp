// Threads that run tasks which may block, so that neither the renderer nor the network thread waits
// for a disk: loads, client jobs, look-ups of files, changes of saved views. Tasks run in order of
// arrival, one at a time per key, which is the dataset they read: a dataset whose files hang
// occupies one thread only. A task that runs for long, because its files hang or it waits for
// memory, gives its place to the next one while there are spare threads.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::work {

class TaskExecutor {
 public:
  struct Task {
    CancelToken cancel;
    // Called exactly once on a thread of the executor, cancelled or not. Must not throw.
    std::function<void()> run;
    // Bounded elsewhere: a task of a session, a client job, or the continuation of an admitted
    // request. Neither counted nor refused.
    bool admitted = false;
    // Tasks of the same key run one at a time: for a dataset Dataset::shared_info(). Empty: none.
    std::shared_ptr<const void> key = nullptr;
    std::string payer = {};  // address of the client; empty: none
  };

  // `tasks_max`: limit of waiting tasks per key; the total limit is keys_full times as many. One
  // payer may use half of either. `what`: the tasks' name in error messages ("loads"). `refused` is
  // called for each refusal. `spare`: threads beyond `threads`, which limits the tasks started less
  // than `long_run` ago.
  static constexpr std::size_t keys_full = 4;
  static constexpr std::chrono::milliseconds long_run{500};
  TaskExecutor(std::size_t threads, std::size_t tasks_max, const char* what,
               std::function<void()> refused = {}, std::size_t spare = 0);
  ~TaskExecutor();
  TaskExecutor(const TaskExecutor&) = delete;
  TaskExecutor& operator=(const TaskExecutor&) = delete;

  // Errors: busy if too many uncancelled tasks wait, for the key or in total; draining after end().
  Result<void> submit(Task task);
  // Cancels waiting tasks, runs them, joins the threads; later tasks are refused.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::work
