// The error type of the project: errors are values, returned to the outermost layer, which converts
// them to problem+json, a WebSocket error message or a line on stderr.
#pragma once

#include <boost/assert/source_location.hpp>
#include <boost/system/result.hpp>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace windsplat {

// The kind of an error, which determines HTTP status and exit code.
enum class ErrorKind {
  malformed,      // 400, exit 2: not parseable (broken JSON, bad query)
  invalid,        // 422, exit 2: parseable, but a value violates a limit; see `at`
  not_found,      // 404, exit 1
  bad_data,       // 422 from a loader, exit 3: invalid or unsupported file
  too_large,      // 413, exit 2: more pixels, bytes or work than the limit
  not_resident,   // 409, exit 1: the data are not in memory yet
  conflict,       // 409, exit 1: what would be made exists
  busy,           // 429, exit 1
  draining,       // 503, exit 1
  out_of_memory,  // 507, exit 1: over the memory limit, or a disk that is full or read-only
  cancelled,      // 499, exit 1: the request was cancelled
  internal,       // 500, exit 1: an internal error
};

// An invalid value: its JSON pointer (RFC 6901) in the document, and the violated constraint.
struct FieldError {
  std::string pointer;
  std::string detail;
};

struct Error {
  ErrorKind kind = ErrorKind::internal;
  std::string message;         // one sentence that names the place and the limit
  std::vector<FieldError> at;  // the invalid values of a document, if any
  int retry_after_s = 0;       // for busy; 0: unknown
};

// Called by value() of a failed Result, which is a bug in the caller.
[[noreturn]] void throw_exception_from_error(const Error& error,
                                             const boost::source_location& where);

template <class T>
using Result = boost::system::result<T, Error>;

inline Error make_error(ErrorKind kind, std::string message) {
  return Error{kind, std::move(message), {}};
}

// An error at one JSON pointer; the message repeats the pointer in printable form.
Error make_error_at(ErrorKind kind, std::string pointer, std::string detail);

// Escapes untrusted text for log lines, messages and terminals: valid UTF-8 of at most `bytes_max`
// bytes. Control characters (C0, DEL, C1), line separators (U+2028, U+2029), bidirectional controls
// and bytes that are not UTF-8 become \xNN. Truncated text ends with "...".
std::string printable(std::string_view text, std::size_t bytes_max = 200);

// The same in single quotes, for names from files or users in messages.
std::string in_quotes(std::string_view name);

}  // namespace windsplat
