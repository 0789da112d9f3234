#include "server/convert/open_files.hpp"

#include <sys/resource.h>

#include <algorithm>

namespace windsplat::convert {

namespace {

constexpr rlim_t files_of_program = 64;
constexpr rlim_t files_of_loader = 16;  // beside the files of the store: sockets, memory, input

// Files of a unit that are open at once, of the field that has most.
rlim_t files_of_unit(const Plan& plan) {
  rlim_t most = 0;
  for (const PlannedField& field : plan.fields) {
    rlim_t files = 0;
    for (const Product& made : field.products) files += made.arrays.size();
    most = std::max(most, files);
  }
  return most;
}

}  // namespace

unsigned workers_with_files(const Plan& plan, unsigned workers) {
  const rlim_t each = files_of_unit(plan) + files_of_loader;
  const rlim_t wanted = files_of_program + workers * each;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return workers;
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  // If it is refused, the first file that cannot be opened is the error.
  if (::setrlimit(RLIMIT_NOFILE, &limit) != 0) return 1;
  const rlim_t left = std::max(limit.rlim_cur, files_of_program) - files_of_program;
  return static_cast<unsigned>(std::clamp<rlim_t>(left / each, 1, workers));
}

}  // namespace windsplat::convert
