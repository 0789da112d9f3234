// The portable body of the kernels, compiled once per target; the including file names the target
// by WINDSPLAT_KERNEL_TABLE. Everything here has internal linkage, so that the linker cannot merge
// functions built for different instruction sets.
//
// A brick is processed in three steps, the first two by pairs of rows with one lane per kernel
// position: its positions are projected and culled, the rest is prepared as lines and splats, and
// these are composited in visibility order, block by block with one lane per pixel.
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
                               open_body,
                               close_body,
                               copy_row,
                               count_open,
                               attenuate,
                               partial,
                               jitter};
  return table;
}

}  // namespace windsplat::engine::kernels
