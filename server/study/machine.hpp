// What a study ran on.
#pragma once

#include <string>

namespace windsplat::study {

struct Machine {
  std::string processor;
  std::string system;
  std::string compiler;
  std::string version;  // of windsplat
  std::string kernels;  // the instruction set chosen
  unsigned hardware_threads = 0;
  unsigned threads = 0;  // that rendered
};

// Asks the system.
Machine this_machine(unsigned threads);

}  // namespace windsplat::study
