// Limit on the storage kept between frames.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace windsplat {

// Storage up to this picture size (in whole MCUs) is kept; that of a larger picture is released
// before the next smaller one.
inline constexpr std::size_t retained_pixels = std::size_t{1920} * 1088;

// Releases the storage and its contents if it is larger than both limits.
template <class T>
void trim_storage(std::vector<T>& storage, std::size_t needed, std::size_t kept) {
  // Assigning {} would keep the capacity.
  if (storage.capacity() > std::max(needed, kept)) storage = std::vector<T>();
}

}  // namespace windsplat
