// The portable body of the kernels, compiled once a target: the including file names the target by
// WINDSPLAT_KERNEL_TABLE. Everything here has internal linkage, so no function built for one
// instruction set can stand in for another's.
//
// A brick goes through three steps, the first two by pairs of rows with a lane a stop: its stops
// are projected and culled, what is left is made ready as lines and splats, and these are
// composited in visibility order, block by block with a lane a pixel.
#include <cstddef>
#include <cstdint>

#include "server/engine/kernels/body_slabs.hpp"
#include "server/engine/kernels/table.hpp"

namespace windsplat::engine::kernels {

const Table& WINDSPLAT_KERNEL_TABLE() {
  static constexpr Table table{WINDSPLAT_KERNEL_NAME,
                               summarise,
                               draw,
                               prepare,
                               draw_prepared,
                               pack_splats,
                               pack_lines,
                               gather,
                               close_slab,
                               prefetch_brick,
                               fill_rays,
                               copy_row,
                               count_open,
                               attenuate,
                               jitter};
  return table;
}

}  // namespace windsplat::engine::kernels
