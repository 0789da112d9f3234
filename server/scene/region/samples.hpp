// The part of a volume that a region keeps: a box of samples, and columns within it.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/data/model/volume.hpp"

namespace windsplat::scene {

// Along x, samples may go on beyond the end of the data: index i of the crop is index (first + i)
// modulo `turn` of the data there, if turn > 0.
struct Crop {
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> count{1, 1, 1};
  int turn = 0;
  // Of the columns of the crop, x fastest: 1 if its samples are kept, 0 if they are masked. Null:
  // all are kept.
  std::shared_ptr<const std::vector<unsigned char>> columns;

  [[nodiscard]] int x_of(int i) const {
    const int x = first[0] + i;
    return turn > 0 ? x % turn : x;
  }
  [[nodiscard]] std::size_t samples() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
           static_cast<std::size_t>(count[2]);
  }
};

// Its samples; O(samples of the crop).
data::Volume cropped(const data::Volume& volume, const Crop& crop);

// The volume, masked where a scalar of the same samples is beyond low..high or masked.
data::Volume masked_by(const data::Volume& volume, const data::Volume& scalar,
                       const std::array<double, 2>& range);

}  // namespace windsplat::scene
