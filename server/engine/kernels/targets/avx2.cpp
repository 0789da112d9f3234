// The kernels compiled for one target: see targets.cmake for its flags.
#define WINDSPLAT_KERNEL_TABLE avx2_table
#define WINDSPLAT_KERNEL_NAME "avx2"
#include "server/engine/kernels/body.hpp"

static_assert(HWY_TARGET == HWY_AVX2, "the flags of targets.cmake choose the target");
