// The one error type of the project: errors are values that travel up to the edge, where they
// become problem+json, a WebSocket error message or a line on stderr.
#pragma once

#include <boost/assert/source_location.hpp>
#include <boost/system/result.hpp>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace windsplat {

// What went wrong, in terms the edge can answer: HTTP status and exit code follow from it.
enum class ErrorKind {
  malformed,      // 400, exit 2: not parseable at all (broken JSON, bad query)
  invalid,        // 422, exit 2: parseable, but a value breaks its limit; `at` says which
  not_found,      // 404, exit 1
  bad_data,       // 422 from a loader, exit 3: the file is not what it should be
  too_large,      // 413, exit 2: more pixels, bytes or work than the limit
  not_resident,   // 409, exit 1: the data are not in memory yet
  busy,           // 429, exit 1
  draining,       // 503, exit 1
  out_of_memory,  // 507, exit 1: over the memory limit, or a disk that is full or read-only
  cancelled,      // 499, exit 1: the request was cancelled
  internal,       // 500, exit 1: an internal error
};

// A value at fault: JSON pointer (RFC 6901) into the document, and what its limit is.
struct FieldError {
  std::string pointer;
  std::string detail;
};

struct Error {
  ErrorKind kind = ErrorKind::internal;
  std::string message;         // one sentence that names the place and the limit
  std::vector<FieldError> at;  // empty unless a value of a document is at fault
  int retry_after_s = 0;       // of busy, where it is known; 0: soon
};

// Asking a failed Result for its value is a bug in the caller.
[[noreturn]] void throw_exception_from_error(const Error& error,
                                             const boost::source_location& where);

template <class T>
using Result = boost::system::result<T, Error>;

inline Error make_error(ErrorKind kind, std::string message) {
  return Error{kind, std::move(message), {}};
}

// An error at one JSON pointer; the message repeats it, made printable, so that it reads well
// alone.
Error make_error_at(ErrorKind kind, std::string pointer, std::string detail);

// Text that came from outside, made fit for a log line, message or terminal: valid UTF-8 of at most
// `bytes_max` bytes. Control characters (C0, DEL, C1), what reorders or breaks lines (U+2028,
// U+2029, bidirectional controls) and bytes that are not UTF-8 become \xNN; what is cut ends with
// "...".
std::string printable(std::string_view text, std::size_t bytes_max = 200);

// The same between single quotes: a name from a file or a user, fit for a message.
std::string in_quotes(std::string_view name);

}  // namespace windsplat
