// Starts another program without a shell, with nothing of this process but what it is given.
#pragma once

#include <sys/types.h>

#include <span>
#include <string>
#include <vector>

namespace windsplat {

// An open descriptor, and the number that the program finds it by.
struct PassedDescriptor {
  int here = -1;
  int there = -1;
};

// Starts `program` (an absolute path) with these arguments (the first is its own name), variables
// ("NAME=value") and descriptors. Descriptors from `closed_from` on are closed in it. Signals have
// their default actions and none is blocked. It has a process group of its own: a terminal sends
// signals to that of this process only, which ends what it has started. Sets `id` and returns 0, or
// returns the number of the error (posix_spawn(3)).
int spawn(const std::string& program, std::vector<std::string> arguments,
          std::vector<std::string> variables, std::span<const PassedDescriptor> descriptors,
          int closed_from, pid_t& id);

}  // namespace windsplat
