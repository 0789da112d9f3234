// What a loop of frames keeps of one picture's storage for the next.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace windsplat {

// A picture as large as this one, in whole MCUs, is kept; what a larger one needed is given back by
// the next smaller one.
inline constexpr std::size_t retained_pixels = std::size_t{1920} * 1088;

// Gives storage back that is larger than both, and with it what it holds.
template <class T>
void trim_storage(std::vector<T>& storage, std::size_t needed, std::size_t kept) {
  // Of `= {}` the capacity would stay.
  if (storage.capacity() > std::max(needed, kept)) storage = std::vector<T>();
}

}  // namespace windsplat
