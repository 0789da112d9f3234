// The bytes of a chunk, in memory that is not cleared before they are read or decoded into it.
#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace windsplat::data::zarr {

// An allocator whose elements are uninitialised where no value is given: clearing a chunk takes a
// tenth of the time of decoding it.
template <class T>
struct UninitializedAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UninitializedAllocator<U>;
  };
  using std::allocator<T>::allocator;
  template <class U>
  void construct(U* place) noexcept {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Values>
  void construct(U* place, Values&&... values) {
    std::construct_at(place, std::forward<Values>(values)...);
  }
};

// Whoever resizes it must write every byte that was added.
using ChunkBytes = std::vector<unsigned char, UninitializedAllocator<unsigned char>>;

}  // namespace windsplat::data::zarr
