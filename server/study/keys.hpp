// Everything that determines a stored result -> its key.
#pragma once

#include <string>

#include "server/study/machine.hpp"
#include "server/study/scenes.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// The reference of a point, and the number of its timed renderings.
struct Measuring {
  bool integral = true;  // true: integral; false: extrapolated from slabs
  double tolerance = 0;  // tolerance of the integral
  int runs = 1;          // number of timed renderings
};

// Key of a subject's integral: data and view, tolerance, and the executable.
std::string truth_key(const Subject& subject, const Machine& machine, double tolerance);

// Key of one point: reference, setting and runs, and everything that determines the time:
// processor, threads and instruction set.
std::string point_key(const Subject& subject, const Setting& setting, const Machine& machine,
                      const Measuring& measuring);

}  // namespace windsplat::study
