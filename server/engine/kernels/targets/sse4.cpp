// The kernels compiled for one target: see targets.cmake for its flags.
#define WINDSPLAT_KERNEL_TABLE sse4_table
#define WINDSPLAT_KERNEL_NAME "sse4"
#include "server/engine/kernels/body.hpp"

static_assert(HWY_TARGET == HWY_SSE4, "the flags of targets.cmake choose the target");
