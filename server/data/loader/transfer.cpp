// memfd_create, seals, mmap, and hole punching for what has been copied.
#include "server/data/loader/transfer.hpp"

#include <fcntl.h>
#include <linux/falloc.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

namespace windsplat::data::loader {

namespace {

constexpr std::size_t copied_at_once = std::size_t{512} << 10;  // floats per huge page

Error no_memory(std::size_t bytes) {
  return make_error(ErrorKind::out_of_memory,
                    "cannot allocate " + std::to_string(bytes) +
                        " bytes for a volume: " + std::generic_category().message(errno));
}

}  // namespace

Result<Mapping> Mapping::of(const Descriptor& memory, bool writable) {
  struct stat status {};
  if (::fstat(memory.number(), &status) != 0) return no_memory(0);
  const auto bytes = static_cast<std::size_t>(status.st_size);
  const int rights = writable ? PROT_READ | PROT_WRITE : PROT_READ;
  void* at = ::mmap(nullptr, bytes, rights, MAP_SHARED, memory.number(), 0);
  if (at == MAP_FAILED) return no_memory(bytes);
  Mapping out;
  out.data_ = static_cast<float*>(at);
  out.floats_ = bytes / sizeof(float);
  return out;
}

Mapping::Mapping(Mapping&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), floats_(std::exchange(other.floats_, 0)) {}

Mapping& Mapping::operator=(Mapping&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(floats_, other.floats_);
  return *this;
}

Mapping::~Mapping() {
  if (data_ != nullptr) ::munmap(data_, bytes());
}

Result<Transfer> Transfer::make(std::size_t floats, bool kept) {
  Transfer out;
  out.kept_ = kept;
  out.memory_.reset(::memfd_create("windsplat-volume", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  const std::size_t bytes = floats * sizeof(float);
  if (!out.memory_ || ::ftruncate(out.descriptor(), static_cast<off_t>(bytes)) != 0 ||
      ::fcntl(out.descriptor(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW) != 0) {
    return no_memory(bytes);
  }
  auto mapping = Mapping::of(out.memory_, false);
  if (!mapping) return mapping.error();
  out.mapping_ = std::move(*mapping);
  return out;
}

Samples Transfer::take(std::size_t floats) {
  Samples out(floats);
  for (std::size_t from = 0; from < floats; from += copied_at_once) {
    const std::size_t count = std::min(copied_at_once, floats - from);
    std::copy_n(mapping_.data() + from, count, out.data() + from);
    if (!is_kept()) {
      static_cast<void>(::fallocate(descriptor(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                                    static_cast<off_t>(from * sizeof(float)),
                                    static_cast<off_t>(count * sizeof(float))));
    }
  }
  return out;
}

bool Transfer::close() {
  mapping_ = Mapping();  // even a read-only shared mapping counts as a writer
  return ::fcntl(descriptor(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SEAL) == 0;
}

}  // namespace windsplat::data::loader
