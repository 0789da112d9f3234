// Which resolution keeps a moving frame within its budget: measured times in, a level out.
#pragma once

#include <array>
#include <cstdint>

namespace windsplat::session {

using Micros = std::int64_t;  // microseconds of a clock that only goes forward

// Level n has 1/2^n of the view's width and height.
class LevelChooser {
 public:
  static constexpr int level_max = 4;
  static constexpr int edge_min = 64;  // pixels; no level makes an edge shorter than this

  // A frame of a view of width x height pixels was drawn at `level` in `cost`.
  void learn(int level, int width, int height, Micros cost, Micros now);

  // The finest level expected to cost at most `budget`, or the coarsest there is.
  [[nodiscard]] int choose(int width, int height, Micros budget, Micros now) const;

  // What a frame of that level is expected to cost.
  [[nodiscard]] Micros expected(int level, int width, int height, Micros now) const;

 private:
  struct Measure {
    double cost_us = 0;
    double pixels = 0;  // of the view, level 0
    Micros at = 0;
    bool known = false;
  };

  std::array<Measure, level_max + 1> measures_{};
  int newest_ = -1;  // level measured last
};

}  // namespace windsplat::session
