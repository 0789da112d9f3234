// What a kept result depends on -> the key under which a study finds it again.
#pragma once

#include <string>

#include "server/study/machine.hpp"
#include "server/study/scenes.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// What a point is measured against, and how.
struct Measuring {
  bool integral = true;  // the truth; else it is extrapolated from slabs
  double tolerance = 0;  // of the integral
  int runs = 1;          // by the clock
};

// Of a subject's integral: the subject's data and view, the tolerance, and the program itself.
std::string truth_key(const Subject& subject, const Machine& machine, double tolerance);

// Of one point: the truth, the setting and the runs, and what the time depends on: processor,
// threads and instruction set.
std::string point_key(const Subject& subject, const Setting& setting, const Machine& machine,
                      const Measuring& measuring);

}  // namespace windsplat::study
