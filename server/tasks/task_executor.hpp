// Threads that run tasks which may block, so that neither the renderer nor the network thread waits
// for a disk: loads, client jobs, look-ups of files, changes of saved views. Tasks run in order of
// arrival, one at a time per key, which is the dataset they read: a dataset whose files hang
// occupies one thread only. A task that runs for a long time, because its files hang or it waits
// for memory, gives its place to the next one while there are spare threads.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "protocol/limits.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::tasks {

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

  static constexpr std::size_t keys_full = 4;
  static constexpr std::chrono::milliseconds long_run{500};
  struct Settings {
    const char* what;       // the tasks' name in error messages
    std::size_t threads;    // limits the tasks started less than `long_run` ago
    std::size_t tasks_max;  // waiting per key, keys_full times as many in total, half per payer;
                            // for client jobs the length of their list
    std::size_t threads_spare = 0;  // beyond `threads`
  };
  // `refused` is called for each refusal.
  explicit TaskExecutor(const Settings& settings, std::function<void()> refused = {});
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

// Limit on waiting requests for pictures and of loads for one dataset.
inline constexpr std::size_t requests_waiting_max = 16;

// All executors of the server (docs/design/overview.md). The spare threads are for loads that hang
// or wait for memory.
inline constexpr TaskExecutor::Settings load_settings{"loads", 2, requests_waiting_max, 4};
// A reference and an animation may run for an hour beside each other: the spare thread is for
// others.
inline constexpr TaskExecutor::Settings job_settings{"jobs", protocol::limits::jobs_running_max,
                                                     protocol::limits::jobs_max, 1};
// Resolves posted names: a slow disk delays no other executor.
inline constexpr TaskExecutor::Settings look_up_settings{"files to open", 1, requests_waiting_max};
// Changes saved views; each change may take one disk sync.
inline constexpr TaskExecutor::Settings view_io_settings{"changes of saved views", 1, 64};
// Compresses large answers.
inline constexpr TaskExecutor::Settings packing_settings{"answers to compress", 1, 64};
// Writes parts of uploads, and removes them. The spare threads are for large ones that are removed.
inline constexpr TaskExecutor::Settings upload_io_settings{"changes of uploads", 1, 64, 3};
// Unpacks archives that were uploaded: those of an address one after the other.
inline constexpr TaskExecutor::Settings unpack_settings{"archives to unpack", 2, 64};
// Checks files for changes and reopens them; the server submits one check at a time.
inline constexpr TaskExecutor::Settings file_check_settings{"file checks", 1, 1};

}  // namespace windsplat::tasks
