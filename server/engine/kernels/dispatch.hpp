// Selection of the kernels by instruction set.
#pragma once

#include <vector>

#include "server/base/error.hpp"
#include "server/engine/kernels/table.hpp"

namespace windsplat::engine::kernels {

// The tables that this processor supports, from portable to the widest.
std::vector<const Table*> usable_tables();

// The widest usable table, or the one named by the environment variable WINDSPLAT_TARGET (portable;
// sse4, avx2 or avx512; neon). Selected once per process. Errors: invalid, if the named target is
// unknown or not supported by this processor.
Result<const Table*> chosen_table();

}  // namespace windsplat::engine::kernels
