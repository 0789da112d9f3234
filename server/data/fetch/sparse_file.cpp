#include "server/data/fetch/sparse_file.hpp"

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <iterator>
#include <system_error>
#include <utility>

namespace windsplat::data::fetch {

namespace {

Error disk_fault(const std::string& url) {
  return make_error(ErrorKind::out_of_memory, in_quotes(url) +
                                                  " cannot be stored in the folder of "
                                                  "--data-cache: " +
                                                  std::generic_category().message(errno));
}

bool write_at(int file, std::uint64_t offset, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(wrote));
    offset += static_cast<std::uint64_t>(wrote);
  }
  return true;
}

std::size_t block_of(std::uint64_t offset) {
  return static_cast<std::size_t>(offset / SparseFile::block_bytes);
}

// Blocks that contain the bytes before `end`.
std::size_t blocks_to(std::uint64_t end) { return block_of(end + SparseFile::block_bytes - 1); }

}  // namespace

std::string state_of(const std::string& url, std::uint64_t bytes, const std::string& etag) {
  return ObjectCache::digest_of(url + '\n' + std::to_string(bytes) + '\n' + etag);
}

SparseFile::SparseFile(const std::string& url, std::pair<Descriptor, OpenSpace> file,
                       const Response& response, std::uint64_t begin_bytes, std::uint64_t bytes_max)
    : url_(url),
      file_(std::move(file.first)),
      space_(std::move(file.second)),
      validators_(response.validators),
      bytes_(response.file_bytes),
      bytes_max_(bytes_max),
      state_(state_of(url, bytes_, validators_.etag)),
      fetched_bytes_(begin_bytes),
      next_(block_of(begin_bytes)) {
  if (next_ > 0) present_[0] = next_;
}

Result<std::shared_ptr<SparseFile>> SparseFile::make(const std::string& url, PartialFile begin,
                                                     const Response& response,
                                                     std::uint64_t bytes_max) {
  constexpr std::uint64_t bytes_of_a_file_max = std::uint64_t{1} << 42;
  if (response.file_bytes > bytes_of_a_file_max) {
    return make_error(ErrorKind::too_large, in_quotes(url) + " has " +
                                                std::to_string(response.file_bytes) +
                                                " bytes; the limit is 4 TiB");
  }
  const std::uint64_t begin_bytes = begin.bytes();
  auto file = begin.take();
  if (::ftruncate(file.first.number(), static_cast<off_t>(response.file_bytes)) != 0) {
    return disk_fault(url);
  }
  return std::shared_ptr<SparseFile>(
      new SparseFile(url, std::move(file), response, begin_bytes, bytes_max));
}

Result<Descriptor> SparseFile::open() const {
  // Another open file description: a duplicate would share the position with other loaders.
  const std::string path = "/proc/self/fd/" + std::to_string(file_.number());
  Descriptor out(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!out) return disk_fault(url_);
  return out;
}

std::uint64_t SparseFile::fetched_bytes() const {
  const std::lock_guard lock(mutex_);
  return fetched_bytes_;
}

std::pair<std::size_t, std::size_t> SparseFile::first_missing(std::size_t from,
                                                              std::size_t end) const {
  const std::lock_guard lock(mutex_);
  const auto after = present_.upper_bound(from);
  if (after != present_.begin()) from = std::max(from, std::prev(after)->second);
  from = std::min(from, end);
  return {from, after == present_.end() ? end : std::min(end, after->first)};
}

Extent SparseFile::present_around(std::uint64_t offset, std::uint64_t end) const {
  const std::lock_guard lock(mutex_);
  const auto after = present_.upper_bound(block_of(offset));
  if (after == present_.begin()) return {offset, end};
  const auto [first, last] = *std::prev(after);
  return {first * block_bytes, std::min(bytes_, last * block_bytes)};
}

Result<Extent> SparseFile::fetch(std::uint64_t offset, std::uint64_t count, const Get& get,
                                 const Cancelled& cancelled) {
  constexpr std::chrono::milliseconds look_every{100};
  offset = std::min(offset, bytes_);
  const std::uint64_t end = offset + std::min(count, bytes_ - offset);
  const std::size_t end_block = blocks_to(end);
  if (offset == end) return Extent{offset, offset};
  std::size_t missing = first_missing(block_of(offset), end_block).first;
  if (missing == end_block) return present_around(offset, end);
  std::unique_lock lock(fetching_, std::defer_lock);
  while (!lock.try_lock_for(look_every)) {
    if (cancelled && cancelled()) {
      return make_error(ErrorKind::cancelled, in_quotes(url_) + " was cancelled");
    }
  }
  while ((missing = first_missing(missing, end_block).first) < end_block) {
    ahead_ = missing == next_ ? std::min(2 * ahead_, blocks_ahead_max) : 1;
    const std::size_t wanted = std::min(std::max(end_block, missing + ahead_), blocks_to(bytes_));
    const std::size_t to = first_missing(missing, wanted).second;
    if (auto done = fetch_blocks(missing, to, get); !done) return done.error();
    next_ = to;
  }
  return present_around(offset, end);
}

Result<void> SparseFile::fetch_blocks(std::size_t first, std::size_t end, const Get& get) {
  const std::uint64_t begin = first * block_bytes;
  const std::uint64_t wanted = std::min(bytes_, end * block_bytes) - begin;
  if (fetched_bytes() + wanted > bytes_max_) {
    return make_error(ErrorKind::too_large,
                      "the parts of " + in_quotes(url_) + " that were read have more than the " +
                          std::to_string(bytes_max_) + " bytes of --max-download");
  }
  if (!space_.reserve(wanted)) {
    return make_error(ErrorKind::out_of_memory,
                      in_quotes(url_) +
                          " cannot be read on: the parts of files in use have all of "
                          "--data-cache-size");
  }
  std::uint64_t came = 0;
  const auto got = get({begin, wanted}, [&](std::string_view bytes) {
    if (bytes.size() > wanted - came) return false;
    if (!write_at(file_.number(), begin + came, bytes)) return false;
    came += bytes.size();
    return true;
  });
  if (!got || came != wanted) {
    space_.give_back(wanted);
    if (!got) return got.error();
    return make_error(ErrorKind::bad_data, in_quotes(url_) + " was received incompletely");
  }
  const std::lock_guard lock(mutex_);
  fetched_bytes_ += wanted;
  const auto before = present_.lower_bound(first);
  if (before != present_.begin() && std::prev(before)->second == first) {
    first = std::prev(before)->first;
  }
  if (const auto after = present_.find(end); after != present_.end()) {
    end = after->second;
    present_.erase(after);
  }
  present_[first] = end;
  return {};
}

}  // namespace windsplat::data::fetch
