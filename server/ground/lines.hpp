// The embedded file of lines -> levels. Its format: scripts/ground_data.
#pragma once

#include <cstddef>
#include <string>

#include "server/ground/atlas.hpp"

namespace windsplat::ground {

// The uncompressed bytes.
std::string embedded_lines();

// A level of the atlas; those before it in the file are passed over.
Level read_level(std::size_t number);

}  // namespace windsplat::ground
