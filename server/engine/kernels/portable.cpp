// The kernels compiled for any processor, lane by lane: what the others are held against.
#define HWY_COMPILE_ONLY_SCALAR
#define WINDSPLAT_KERNEL_TABLE portable_table
#define WINDSPLAT_KERNEL_NAME "portable"
#include "server/engine/kernels/body.hpp"

#if HWY_TARGET != HWY_SCALAR
#error "the target is chosen above"
#endif
