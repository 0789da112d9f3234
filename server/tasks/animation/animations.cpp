#include "server/tasks/animation/animations.hpp"

#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <system_error>
#include <utility>

namespace windsplat::tasks {

Result<std::shared_ptr<const MappedFile>> MappedFile::of(const data::Descriptor& file) {
  const auto failed = [] {
    return make_error(ErrorKind::internal, "the temporary file cannot be read: " +
                                               std::generic_category().message(errno));
  };
  struct stat about {};
  if (::fstat(file.number(), &about) != 0) return failed();
  const auto size = static_cast<std::size_t>(about.st_size);
  void* const start = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file.number(), 0);
  if (start == MAP_FAILED) return failed();
  return std::shared_ptr<const MappedFile>(
      new MappedFile({static_cast<const std::uint8_t*>(start), size}));
}

MappedFile::~MappedFile() { ::munmap(const_cast<std::uint8_t*>(bytes_.data()), bytes_.size()); }

template <class Unwanted>
Animations::Entries Animations::take(const Unwanted& unwanted) {
  Entries out;
  for (auto at = entries_.begin(); at != entries_.end();) {
    const auto next = std::next(at);
    if (unwanted(*at)) out.splice(out.end(), entries_, at);
    at = next;
  }
  return out;
}

void Animations::keep(Kept kept, Clock::time_point now) {
  Entries removed;  // declared before the lock: destroyed after it
  const std::lock_guard lock(mutex_);
  removed = take([&](const Entry& old) {
    return old.until <= now || old.kept.description.id == kept.description.id;
  });
  entries_.push_back({std::move(kept), now + lasts});
  std::int64_t bytes = 0;
  for (const Entry& one : entries_) bytes += one.kept.description.bytes;
  while (bytes > kept_bytes_max || entries_.size() > kept_max) {
    bytes -= entries_.front().kept.description.bytes;
    removed.splice(removed.end(), entries_, entries_.begin());
  }
}

std::optional<Animations::Kept> Animations::find(const std::string& id, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& one) {
    return one.until > now && one.kept.description.id == id;
  });
  if (found == entries_.end()) return std::nullopt;
  return found->kept;
}

bool Animations::remove(const std::string& id) {
  Entries removed;
  const std::lock_guard lock(mutex_);
  removed = take([&](const Entry& one) { return one.kept.description.id == id; });
  return !removed.empty();
}

void Animations::expire(Clock::time_point now) {
  Entries removed;
  const std::lock_guard lock(mutex_);
  removed = take([&](const Entry& one) { return one.until <= now; });
}

}  // namespace windsplat::tasks
