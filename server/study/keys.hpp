// What a stored result depends on -> its key.
#pragma once

#include <string>

#include "server/study/machine.hpp"
#include "server/study/scenes.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// The reference of a point, and how often it is timed.
struct Measuring {
  bool integral = true;  // the reference; else extrapolated from slabs
  double tolerance = 0;  // of the integral
  int runs = 1;          // timed
};

// Key of a subject's integral: data and view, tolerance, and the executable.
std::string truth_key(const Subject& subject, const Machine& machine, double tolerance);

// Key of one point: reference, setting and runs, and what the time depends on: processor, threads
// and instruction set.
std::string point_key(const Subject& subject, const Setting& setting, const Machine& machine,
                      const Measuring& measuring);

}  // namespace windsplat::study
