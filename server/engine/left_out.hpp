// What tolerances leave out of each brick -> upper bound on the mean change of the picture
// (docs/design/rendering-model.md#tolerances).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/engine/plan.hpp"
#include "server/engine/summaries.hpp"

namespace windsplat::engine {

// Upper bound on the alphas, summed over pixels, of the lines and splats of a brick that are below
// a tolerance. `depth`: view depth of the nearest.
double left_out_alphas(const RenderPlan& plan, const PassPlan& pass, const kernels::Brick& brick,
                       const KeptSummary& summary, double depth);

// Blocks of the picture, both ends included.
struct BlockRange {
  std::int16_t x = 0, x_last = 0;
  std::int16_t y = 0, y_last = 0;
};
std::int64_t pixels_in(const BlockRange& range, const kernels::Camera& camera);

// The union of ranges of blocks. Keeps its storage.
class TouchedBlocks {
 public:
  void begin(const kernels::Camera& camera);
  void add(const BlockRange& range) {
    std::int32_t* const top = covering_.data() + range.y * row_;
    std::int32_t* const below = covering_.data() + (range.y_last + 1) * row_;
    ++top[range.x];
    --top[range.x_last + 1];
    --below[range.x];
    ++below[range.x_last + 1];
  }
  // Call it once.
  std::int64_t pixels(const kernels::Camera& camera);

 private:
  std::ptrdiff_t row_ = 0;
  // Per block and one beyond: differences, along both axes, of the number of ranges that touch it.
  std::vector<std::int32_t> covering_;
};

}  // namespace windsplat::engine
