// Runs a task of an executor: catches all exceptions and skips cancelled work.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/log.hpp"

namespace windsplat::tasks {

// Ignore a failure to log when memory is exhausted.
inline void log_fault(const char* message, const std::exception& fault, const char* job = "",
                      const std::string& request_id = {}) noexcept {
  try {
    log::error(message, {{"job", job}, {"request", request_id}, {"fault", fault.what()}});
  } catch (const std::exception&) {
    log::error(message, {});
  }
}

// `what` names the work in the log, `request_id` its request. An exception becomes an error without
// its message. Does not throw; messages of errors after an exception fit into the small string
// buffer (15 bytes) and need no allocation.
template <class T, class Make>
Result<T> run_guarded(const char* what, const CancelToken& cancel, const Make& make,
                      const std::string& request_id = {}) {
  try {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
    return make();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "no memory left");
  } catch (const std::exception& fault) {
    log_fault("a job failed", fault, what, request_id);
    return make_error(ErrorKind::internal, "the job failed");
  }
}

}  // namespace windsplat::tasks
