// What a study ran on.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat::study {

struct Machine {
  std::string processor;
  std::string system;
  std::string compiler;
  std::string version;  // of windsplat
  std::string program;  // digest of the running executable's bytes
  std::string kernels;  // the instruction set chosen
  unsigned hardware_threads = 0;
  unsigned threads = 0;  // that rendered
};

// Asks the system. Errors: internal (the executable cannot be read).
Result<Machine> this_machine(unsigned threads);

}  // namespace windsplat::study
