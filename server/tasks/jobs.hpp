// Asynchronous jobs of clients: submitted from any thread, run on separate threads, looked up by
// id.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/measurements.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/tasks/task_executor.hpp"

namespace windsplat::tasks {

// Thread-safe. A job that throws ends as failed.
class Jobs {
 public:
  // Passed to a job: its cancellation, and a callback for its progress, 0 to 1.
  struct Handle {
    CancelToken cancel;
    std::function<void(double done)> report_progress;
  };
  // A cancelled job leaves no side effects and returns `cancelled`.
  using Work = std::function<Result<protocol::JobResult>(const Handle&)>;
  struct Terms {
    CancelToken cancel = {};  // raised to cancel the job
    bool slow = false;        // slow jobs of a kind run one at a time
  };

  // `tasks_max` is the limit on listed jobs; a new one replaces the oldest finished one.
  explicit Jobs(const TaskExecutor::Settings& settings);
  ~Jobs();  // calls end()
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  // Errors: busy if every listed job is unfinished or still in the queue of the executor.
  Result<protocol::JobDescription> submit(std::string kind, Work work) {
    return submit(std::move(kind), std::move(work), Terms());
  }
  Result<protocol::JobDescription> submit(std::string kind, Work work, const Terms& terms);
  [[nodiscard]] std::vector<protocol::JobDescription> list() const;  // oldest first
  // Errors: not_found.
  [[nodiscard]] Result<protocol::JobDescription> find(const std::string& id) const;
  // A waiting job is cancelled at once, a running one at its next check; a finished job is
  // unchanged. Errors: not_found.
  Result<void> cancel(const std::string& id);
  void cancel_all();
  // Cancels all jobs, waits for the running ones, and starts no others.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::tasks
