// Which lines of a scene of plain lines can be seen, and where two of them cross.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"
#include "tests/bench/direction/cues.hpp"

namespace windsplat::bench {

struct SeenLine {
  Axis axis;  // tail to head
  bool alone = false;
};

// Of two lines; no third one covers it.
struct Crossing {
  Axis front, behind;
  double x = 0, y = 0;
};

struct Truth {
  std::vector<SeenLine> lines;
  std::vector<Crossing> crossings;
};

Truth truth_of(const scene::Scene& scene);

}  // namespace windsplat::bench
