// The light of the media along rays, and its changes across them.
#pragma once

#include <array>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/frame/drawn_samples.hpp"
#include "server/quality/content.hpp"

namespace windsplat::frame {

// Quantities of quality::Content: integrals of squares over the picture, in squares of its height,
// and the width of the cells where the light differs, in heights of the picture.
struct LightChanges {
  Mean step;  // from one cell to the next
  std::array<Mean, quality::cells_apart.size()> cell_bends;
  std::array<Mean, quality::distances_count> bends;
  std::array<Mean, quality::distances_count> shifts;
  Mean order;
  Mean cell;
};

// A ray near a sample, which stands for so many of those drawn.
struct RayThrough {
  Index sample{};
  double stands_for = 1;
};
// Incomplete if cancelled.
LightChanges light_changes(const DrawnSamples& samples, const std::vector<RayThrough>& through,
                           const CancelToken& cancel);

}  // namespace windsplat::frame
