// Small blocks from the heap; large ones mapped and aligned for huge pages.
#include "server/data/model/sample_buffer.hpp"

#include <sys/mman.h>

#include <cstdint>
#include <new>

namespace windsplat::data {

namespace {

constexpr std::size_t huge_page = std::size_t{2} << 20;
constexpr std::size_t mapped_from = 2 * huge_page;  // bytes

std::shared_ptr<float> mapped(std::size_t bytes) {
  const std::size_t asked = bytes + huge_page;
  void* got = ::mmap(nullptr, asked, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (got == MAP_FAILED) throw std::bad_alloc();
  // The part before the first huge page boundary is never accessed.
  const auto place = reinterpret_cast<std::uintptr_t>(got);
  auto* first = static_cast<std::byte*>(got) + (huge_page - place % huge_page) % huge_page;
#ifdef MADV_HUGEPAGE
  static_cast<void>(::madvise(first, bytes, MADV_HUGEPAGE));  // advisory: everything works without
                                                              // it
#endif
  return {reinterpret_cast<float*>(first), [got, asked](float*) { ::munmap(got, asked); }};
}

}  // namespace

Samples::Samples(std::size_t count) : count_(count) {
  const std::size_t bytes = count * sizeof(float);
  if (bytes >= mapped_from) {
    memory_ = mapped(bytes);
  } else {
    memory_ = std::shared_ptr<float>(new float[count](), std::default_delete<float[]>());
  }
}

Samples::Samples(std::vector<float> values) : count_(values.size()) {
  const auto kept = std::make_shared<std::vector<float>>(std::move(values));
  memory_ = std::shared_ptr<float>(kept, kept->data());
}

}  // namespace windsplat::data
