// Which instruction set's kernels this process uses.
#pragma once

#include <vector>

#include "server/base/error.hpp"
#include "server/engine/kernels/table.hpp"

namespace windsplat::engine::kernels {

// The tables that this processor can run, portable first, widest last.
std::vector<const Table*> usable_tables();

// The widest usable one, or what the environment's WINDSPLAT_TARGET (portable or avx2) names;
// decided once. Errors: invalid, if that is no target or not one of this processor.
Result<const Table*> chosen_table();

}  // namespace windsplat::engine::kernels
