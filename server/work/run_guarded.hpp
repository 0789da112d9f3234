// What a service's thread does for somebody: no exception leaves it, and nothing is begun that
// nobody waits for.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/log.hpp"

namespace windsplat::net {

// Where memory is short there may be none for the words.
inline void log_fault(const char* message, const std::exception& fault, const char* job = "",
                      const std::string& request_id = {}) noexcept {
  try {
    log::error(message, {{"job", job}, {"request", request_id}, {"fault", fault.what()}});
  } catch (const std::exception&) {
    log::error(message, {});
  }
}

// `what` names the work in the log, and `request_id` whose it is. A fault of ours becomes an error
// without its words. Throws nothing, and its errors need no memory: their words are short enough to
// lie within a string (15 bytes).
template <class T, class Make>
Result<T> run_guarded(const char* what, const CancelToken& cancel, const Make& make,
                      const std::string& request_id = {}) {
  try {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "nobody waits for the answer");
    return make();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "no memory left");
  } catch (const std::exception& fault) {
    log_fault("a job failed", fault, what, request_id);
    return make_error(ErrorKind::internal, "the job failed");
  }
}

}  // namespace windsplat::net
