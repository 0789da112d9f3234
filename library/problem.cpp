// Internal errors -> exceptions.
#include "library/state.hpp"

namespace windsplat {

Problem::Problem(Kind kind, const std::string& message)
    : std::runtime_error(message), kind_(kind) {}

Problem::~Problem() = default;

namespace library {
namespace {

Problem::Kind kind_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::malformed:
    case ErrorKind::invalid:
      return Problem::Kind::invalid;
    case ErrorKind::not_found:
      return Problem::Kind::not_found;
    case ErrorKind::bad_data:
      return Problem::Kind::bad_data;
    case ErrorKind::too_large:
      return Problem::Kind::too_large;
    case ErrorKind::out_of_memory:
      return Problem::Kind::out_of_memory;
    case ErrorKind::not_resident:
    case ErrorKind::conflict:
    case ErrorKind::busy:
    case ErrorKind::draining:
    case ErrorKind::cancelled:
    case ErrorKind::internal:
      break;
  }
  return Problem::Kind::internal;
}

}  // namespace

void throw_problem(const Error& error) { throw Problem(kind_of(error.kind), error.message); }

}  // namespace library
}  // namespace windsplat
