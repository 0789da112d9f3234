// Times of the generated scenes (scene_set.hpp) and how they grow.
#pragma once

#include <string>

#include "tests/bench/text_table.hpp"

namespace windsplat::bench {

struct SceneOptions {
  std::string only;     // scenes whose name contains it
  std::string content;  // "lines", "medium" or "both"; empty: all
  int rounds = 5;       // frames of each kind; best and median are listed
  int side = 256;       // samples along each side of the two large cubes
  bool naive = true;
  bool processor_time = false;  // of all threads, on a machine that others use
  bool smoke = false;           // tiny pictures of a few samples
};

// One row for each scene, content and size. Columns: best and median of `kernel` and `slab` on one
// and two threads, ms; ratios of the bests. `samples^` and `pixels^`: the exponents with which the
// time of one thread grows from an eighth of the samples, and from the smaller picture.
Table scene_times(const SceneOptions& options);

}  // namespace windsplat::bench
