// Work that a client asks for and does not wait for: submitted from any thread, run on threads of
// its own, looked up by its id.
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

namespace windsplat::net {

// Thread-safe. A job that throws is a failed job.
class Jobs {
 public:
  // What a job is given: whether it is still wanted, and a way to tell how much is done, 0 to 1.
  struct Handle {
    CancelToken cancel;
    std::function<void(double done)> report_progress;
  };
  // Where it was cancelled it leaves nothing behind and says `cancelled`.
  using Work = std::function<Result<protocol::JobResult>(const Handle&)>;
  struct Terms {
    CancelToken cancel = {};  // raised when nobody wants the job any more
    bool slow = false;        // such jobs leave a thread to the others
  };

  // `known_max`: jobs that are remembered; the oldest finished one is forgotten for a new one.
  Jobs(std::size_t known_max, std::size_t running_max);
  ~Jobs();  // as end()
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  // Errors: busy where every job that is remembered is still unfinished.
  Result<protocol::JobDescription> submit(std::string kind, Work work) {
    return submit(std::move(kind), std::move(work), Terms());
  }
  Result<protocol::JobDescription> submit(std::string kind, Work work, const Terms& terms);
  [[nodiscard]] std::vector<protocol::JobDescription> list() const;  // the oldest first
  // Errors: not_found.
  [[nodiscard]] Result<protocol::JobDescription> find(const std::string& id) const;
  // One that waits is cancelled at once, one that runs when it notices; a finished one stays as it
  // is. Errors: not_found.
  Result<void> cancel(const std::string& id);
  void cancel_all();
  // Cancels everything, waits for what runs, and runs nothing any more.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::net
