// Volumes that hold the middles of strided kernels alone (strided_sample() in coarsen.hpp).
#pragma once

#include <array>
#include <bit>
#include <cstddef>

#include "server/data/model/box.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

// The strided kernels in a box of samples that begins at a multiple of the stride along each axis.
inline Box strided_box(const Box& samples, int stride) {
  Box out;
  for (std::size_t a = 0; a < 3; ++a) {
    const int last = samples.first.at(a) + samples.count.at(a) - 1;
    out.first.at(a) = samples.first.at(a) / stride;
    out.count.at(a) = last / stride + 1 - out.first.at(a);
  }
  return out;
}

// The draw whose groups are the kernels of a stride that is a power of two: all of their middles.
inline Coarsening middles_of(int stride) {
  Coarsening how;
  how.halvings.fill(std::countr_zero(static_cast<unsigned>(stride)));
  how.reduction = Reduction::drawn;
  how.stride = stride;
  return how;
}

// The middles of a box of the kernels of that stride, from a volume of all samples: what is stored
// as `strided`, bit for bit.
Volume middles(const Volume& all, int stride, const Box& kernels);

}  // namespace windsplat::data
