// The kernels compiled for one target: see targets.cmake for its flags.
#define WINDSPLAT_KERNEL_TABLE neon_table
#define WINDSPLAT_KERNEL_NAME "neon"
#include "server/engine/kernels/body.hpp"

static_assert(HWY_TARGET == HWY_NEON, "the flags of targets.cmake choose the target");
