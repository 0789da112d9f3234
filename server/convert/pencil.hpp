// What a pencil of level 0 gives: reductions of all levels, and the statistics of its bricks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/convert/plan.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::convert {

// The product of a field's samples in a box of the data, which begins at a multiple of the groups
// of the level.
data::Volume reduce(const Plan& plan, const Product& product, const data::Volume& pencil,
                    const data::Box& box);

// The floats of a brick of level 0: its least and greatest value or magnitude, NaN if all are
// masked; the number masked; how many are in each of equal parts between these.
struct BrickStatistics {
  float low = 0;
  float high = 0;
  std::uint32_t masked = 0;
  std::array<std::uint32_t, histogram_bins> histogram{};
};
BrickStatistics statistics_of(const data::Volume& brick);

// Those of the bricks of a unit, x fastest.
struct Statistics {
  std::vector<float> low, high;
  std::vector<std::uint32_t> masked, histogram;
  explicit Statistics(std::size_t bricks)
      : low(bricks), high(bricks), masked(bricks), histogram(bricks * histogram_bins) {}
  void set(std::size_t brick, const BrickStatistics& of);
};

// Copies what two boxes of a grid have in common. NaN or not, bits are kept.
void copy_common(const float* from, const data::Box& from_box, const data::Box& to_box, float* to);

}  // namespace windsplat::convert
