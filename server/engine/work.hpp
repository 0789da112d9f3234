// The work report of a frame: what was drawn, what was skipped, and why.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/trace/segments.hpp"

namespace windsplat::engine {

// The code path that the plan selected. Plain data, so that repeated frames do not allocate for the
// report.
struct Variant {
  bool reference = false;  // the reference renderer; the other members are unused
  bool vector = false;
  bool scalar = false;
  bool perspective = false;
  bool heads = false;
  bool marks = false;
  bool moving = false;
  bool slabs = false;
  bool curved = false;
  bool body = false;
  bool surfaces = false;
  bool lit = false;
  int passes = 0;
  const char* target = "";            // instruction set of the kernels; a string literal
  std::array<int, 3> level{0, 0, 0};  // how often each axis was halved; set by the caller
};

// Text form, for example "vector+scalar perspective avx2 level=1,1,0".
std::string text_of(const Variant& variant);

struct WorkReport {
  std::int64_t samples = 0;  // kernel positions of the scene
  // Kernel positions in bricks of 8 x 8 x 1 that lie entirely outside the picture, before the near
  // plane or behind the body.
  std::int64_t culled = 0;
  // Among the others, independent of the view direction:
  std::int64_t skipped_vector = 0;  // line skipped: magnitude below its tolerance, or masked
  std::int64_t skipped_scalar = 0;  // splat skipped: optical depth below its tolerance, or masked
  std::int64_t skipped_both = 0;    // neither line nor splat; included in the counts above
  std::int64_t occluded = 0;        // visits avoided because blocks were opaque
  std::int64_t pixel_updates = 0;   // each rounds the alpha of its pixel by at most 1e-7
  std::int64_t exponentials = 0;
  std::int64_t tiles = 0;
  std::int64_t tiles_stopped = 0;  // tiles ended by early ray termination
  // Upper bounds: mean over the picture of the change by what tolerances skip, and the largest
  // change of a pixel by early termination.
  double skipped_bound = 0;
  double stop_bound = 0;
  std::vector<std::string> fields;  // set by the caller
  std::int64_t bytes = 0;           // size of the fields read
  Variant variant;
  std::optional<trace::Tally> streamlets;  // set by the caller
};

}  // namespace windsplat::engine
