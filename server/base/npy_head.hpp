// The head of a file of NPY 1.0, which the values follow.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace windsplat {

// Of float32, little-endian, last index fastest. Magic and version, then a Python dict, padded so
// that the values start on a multiple of 64 bytes.
std::string npy_head(std::span<const std::size_t> shape);

}  // namespace windsplat
