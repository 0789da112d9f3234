// What tolerances leave out of each brick -> upper bound on the mean change of the picture
// (docs/design/rendering-model.md#tolerances).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/engine/plan.hpp"
#include "server/engine/projector.hpp"
#include "server/engine/summaries.hpp"

namespace windsplat::engine {

// What tolerances leave out of some bricks; see kernels::BrickSummary.
struct LeftOut {
  double lines = 0;   // their number
  double parts = 0;   // their lengths, relative to full length
  double medium = 0;  // optical depths summed over pixels, at a scale of 0

  void add(const KeptSummary& summary) {
    lines += summary.weak_lines;
    parts += static_cast<double>(summary.weak_parts);
    medium += static_cast<double>(summary.thin_medium);
  }
};

// Kernel positions in lattice order: the first along each axis and their number.
struct LatticeRange {
  std::array<int, 3> first{};
  std::array<int, 3> count{};

  [[nodiscard]] std::int64_t positions() const {
    return std::int64_t{count[0]} * count[1] * count[2];
  }
};

// The widest cells of a range along each axis, world units.
std::array<double, 3> widest_cells(const kernels::Pass& pass, const LatticeRange& range);

// Upper bound on the alphas, summed over pixels, of the lines and splats of some bricks that are
// below a tolerance. `edges`: the widest cells along each axis, world units; `depth`: view depth of
// the nearest kernel.
double left_out_alphas(const RenderPlan& plan, const PassPlan& pass,
                       const std::array<double, 3>& edges, const LeftOut& left_out, double depth);

// Blocks of the picture, both ends included.
struct BlockRange {
  std::int16_t x = 0, x_last = 0;
  std::int16_t y = 0, y_last = 0;
};
std::int64_t pixels_in(const BlockRange& range, const kernels::Camera& camera);
// The blocks of the picture that a rectangle touches.
BlockRange block_range(const Rectangle& rectangle, const kernels::Camera& camera);

// Adds what tolerances left out of bricks that may cover `found`: its alphas, but no more than the
// pixels there, to `sum`, and its blocks to `ranges`.
void add_left_out(const RenderPlan& plan, const PassPlan& pass, const std::array<double, 3>& edges,
                  const LeftOut& left_out, const Projected& found, double& sum,
                  std::vector<BlockRange>& ranges);

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
