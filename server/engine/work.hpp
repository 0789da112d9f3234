// The work report of a frame: what was drawn, what was skipped, and why.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace windsplat::engine {

// What the plan chose; plain facts, because a frame that is drawn over and over should not allocate
// to say them.
struct Variant {
  bool reference = false;  // all that is said of the reference
  bool vector = false;
  bool scalar = false;
  bool perspective = false;
  bool heads = false;
  bool moving = false;
  bool slabs = false;
  bool curved = false;
  int passes = 0;
  const char* target = "";            // of the kernels; a literal
  std::array<int, 3> level{0, 0, 0};  // how often each axis was halved; filled by who knows
};

// In words, for example "vector+scalar perspective avx2 level=1,1,0".
std::string text_of(const Variant& variant);

struct WorkReport {
  std::int64_t samples = 0;  // kernel stops of the scene
  // Of bricks of 8 x 8 x 1 stops that lie wholly outside the picture or before the near plane.
  std::int64_t culled = 0;
  // Of the others, whatever the view direction:
  std::int64_t skipped_vector = 0;  // line left out: magnitude below its tolerance, or masked
  std::int64_t skipped_scalar = 0;  // splat left out: optical depth below its tolerance, or masked
  std::int64_t skipped_both = 0;    // whole kernel left out; these count above too
  std::int64_t occluded = 0;        // sample visits spared in tiles that had become opaque
  std::int64_t pixel_updates = 0;
  std::int64_t exponentials = 0;
  std::int64_t tiles = 0;
  std::int64_t tiles_stopped = 0;  // ended early by stop transmittance
  double skipped_bound = 0;  // mean over the picture of the alphas left out by tolerances, at most
  double stop_bound = 0;     // largest change of a pixel by tiles that ended early, at most
  std::vector<std::string> fields;  // filled by who knows their names
  std::int64_t bytes = 0;           // of the fields touched
  Variant variant;
};

}  // namespace windsplat::engine
