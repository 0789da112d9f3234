// The kernels for any processor, without SIMD; tests compare the other targets with it.
#define HWY_COMPILE_ONLY_SCALAR
#define WINDSPLAT_KERNEL_TABLE portable_table
#define WINDSPLAT_KERNEL_NAME "portable"
#include "server/engine/kernels/body.hpp"

#if HWY_TARGET != HWY_SCALAR
#error "the target is chosen above"
#endif
