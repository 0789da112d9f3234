// std::stable_sort with storage kept by the caller: insertion sort of runs, then pairwise merging.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

namespace windsplat::engine {

// Sorts items[first, last); equivalent items keep their order. `spare` grows to the number of
// items.
template <class T, class Less>
void stable_sort(std::vector<T>& items, std::size_t first, std::size_t last, std::vector<T>& spare,
                 const Less& less) {
  constexpr std::size_t run = 8;
  const std::size_t count = last - first;
  T* from = items.data() + first;
  for (std::size_t begin = 0; begin < count; begin += run) {
    const std::size_t end = std::min(begin + run, count);
    for (std::size_t i = begin + 1; i < end; ++i) {
      const T item = from[i];
      std::size_t at = i;
      for (; at > begin && less(item, from[at - 1]); --at) from[at] = from[at - 1];
      from[at] = item;
    }
  }
  if (count <= run) return;
  if (spare.size() < count) spare.resize(count);
  T* to = spare.data();
  for (std::size_t width = run; width < count; width *= 2) {
    for (std::size_t begin = 0; begin < count; begin += 2 * width) {
      const std::size_t middle = std::min(begin + width, count);
      const std::size_t end = std::min(begin + 2 * width, count);
      std::merge(from + begin, from + middle, from + middle, from + end, to + begin, less);
    }
    std::swap(from, to);
  }
  if (from == spare.data()) {
    std::copy_n(spare.data(), count, items.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

template <class T, class Less>
void stable_sort(std::vector<T>& items, std::vector<T>& spare, const Less& less) {
  stable_sort(items, 0, items.size(), spare, less);
}

}  // namespace windsplat::engine
