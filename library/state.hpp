// What the public classes hold, and how internal errors become exceptions.
#pragma once

#include <memory>
#include <utility>

#include "library/windsplat/windsplat.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat {

struct Volume::State {
  std::shared_ptr<data::Dataset> dataset;
};

namespace library {

[[noreturn]] void throw_problem(const Error& error);

// The value of a result.
template <class T>
T taken(Result<T> result) {
  if (!result) throw_problem(result.error());
  return std::move(*result);
}

// The path of the program that reads files. Errors: not_found.
Result<std::string> program();

}  // namespace library
}  // namespace windsplat
