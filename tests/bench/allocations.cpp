// Counting replacements of the global operator new and delete. Block sizes are those of the C heap,
// so that deletes without a size balance.
#include "tests/bench/allocations.hpp"

#include <malloc.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::int64_t> count{0};
std::atomic<std::int64_t> bytes{0};
std::atomic<std::int64_t> live{0};
std::atomic<std::int64_t> live_peak{0};

void* counted(void* block, std::size_t size) {
  if (block == nullptr) throw std::bad_alloc();
  count.fetch_add(1, std::memory_order_relaxed);
  bytes.fetch_add(static_cast<std::int64_t>(size), std::memory_order_relaxed);
  const auto real = static_cast<std::int64_t>(malloc_usable_size(block));
  const std::int64_t now = live.fetch_add(real, std::memory_order_relaxed) + real;
  std::int64_t peak = live_peak.load(std::memory_order_relaxed);
  while (peak < now && !live_peak.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
  }
  return block;
}

void* take(std::size_t size) { return counted(std::malloc(size == 0 ? 1 : size), size); }

void* take(std::size_t size, std::align_val_t alignment) {
  const auto align = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(align, (size + align - 1) / align * align), size);
}

void give(void* block) noexcept {
  if (block == nullptr) return;
  live.fetch_sub(static_cast<std::int64_t>(malloc_usable_size(block)), std::memory_order_relaxed);
  std::free(block);
}

}  // namespace

namespace windsplat::bench {

Allocations allocations() { return {count, bytes, live, live_peak}; }

void forget_peak() { live_peak = live.load(); }

}  // namespace windsplat::bench

// The nothrow and array forms call these.
void* operator new(std::size_t size) { return take(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return take(size, alignment); }
void operator delete(void* block) noexcept { give(block); }
void operator delete(void* block, std::size_t /*size*/) noexcept { give(block); }
void operator delete(void* block, std::align_val_t /*alignment*/) noexcept { give(block); }
void operator delete(void* block, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  give(block);
}
