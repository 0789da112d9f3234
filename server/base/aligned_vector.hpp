// A vector aligned to a cache line, as required by aligned SIMD loads and stores.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace windsplat {

constexpr std::size_t cache_line = 64;  // bytes

template <class T>
struct AlignedAllocator {
  using value_type = T;

  AlignedAllocator() = default;
  template <class U>
  explicit AlignedAllocator(const AlignedAllocator<U>& /*other*/) {}

  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new (count * sizeof(T), std::align_val_t{cache_line}));
  }
  void deallocate(T* at, std::size_t /*count*/) {
    ::operator delete (at, std::align_val_t{cache_line});
  }
  friend bool operator==(const AlignedAllocator& /*a*/, const AlignedAllocator& /*b*/) {
    return true;
  }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace windsplat
