// The kernels compiled for one target: see targets.cmake for its flags.
#define WINDSPLAT_KERNEL_TABLE portable_table
#define WINDSPLAT_KERNEL_NAME "portable"
#include "server/engine/kernels/body.hpp"
