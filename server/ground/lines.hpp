// The embedded file of lines -> levels. Its format: scripts/ground_data.
#pragma once

#include <array>
#include <string>

#include "server/ground/atlas.hpp"

namespace windsplat::ground {

// The uncompressed bytes.
std::string embedded_lines();

std::array<Level, levels> read_levels();

}  // namespace windsplat::ground
