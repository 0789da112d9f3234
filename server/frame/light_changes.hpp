// The light of the media along rays, and its changes across them.
#pragma once

#include <array>
#include <vector>

#include "server/frame/drawn_samples.hpp"
#include "server/quality/content.hpp"

namespace windsplat::frame {

// Integrals of squares over the picture, in squares of its height, and the width of the cells where
// the light differs, in heights of the picture.
struct LightChanges {
  Mean step;                                     // from one cell to the next
  std::array<Mean, quality::bends_count> bends;  // quality::Content::bends
  Mean incline;                                  // for each cell of distance, from place to place
  Mean order;
  Mean cell;
};

// A ray near a sample, which stands for so many of those drawn.
struct RayThrough {
  Index sample{};
  double stands_for = 1;
};
LightChanges light_changes(const DrawnSamples& samples, const std::vector<RayThrough>& through);

}  // namespace windsplat::frame
