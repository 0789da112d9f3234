// The machine and build that a study ran on.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat::study {

struct Machine {
  std::string processor;
  std::string system;
  std::string compiler;
  std::string version;  // version of windsplat
  std::string program;  // digest of the running executable's bytes
  std::string kernels;  // the selected instruction set
  unsigned hardware_threads = 0;
  unsigned threads = 0;  // render threads
};

// Errors: internal (the executable cannot be read).
Result<Machine> this_machine(unsigned threads);

}  // namespace windsplat::study
