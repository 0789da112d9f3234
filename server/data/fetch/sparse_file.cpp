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
      state_(state_of(url, bytes_, validators_.etag)) {
  blocks_.fetched_bytes = begin_bytes;
  blocks_.next = block_of(begin_bytes);
  if (blocks_.next > 0) blocks_.present[0] = blocks_.next;
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
  return blocks_.fetched_bytes;
}

bool SparseFile::is_present(const Extent& extent) const {
  const std::lock_guard lock(mutex_);
  return blocks_.first_missing(block_of(extent.begin)) >= blocks_to(extent.end);
}

std::size_t SparseFile::Blocks::first_missing(std::size_t from) const {
  const auto after = present.upper_bound(from);
  return after == present.begin() ? from : std::max(from, std::prev(after)->second);
}

SparseFile::FlightPtr SparseFile::Blocks::flight_of(std::size_t block) const {
  const auto after = flights.upper_bound(block);
  if (after == flights.begin() || std::prev(after)->second->end <= block) return nullptr;
  return std::prev(after)->second;
}

std::size_t SparseFile::Blocks::end_of_missing(std::size_t from, std::size_t end) const {
  const auto after = present.upper_bound(from);
  if (after != present.end()) end = std::min(end, after->first);
  const auto flight = flights.upper_bound(from);
  return flight == flights.end() ? end : std::min(end, flight->first);
}

Extent SparseFile::present_around(std::uint64_t offset, std::uint64_t end) const {
  const auto after = blocks_.present.upper_bound(block_of(offset));
  if (after == blocks_.present.begin()) return {offset, end};
  const auto [first, last] = *std::prev(after);
  return {first * block_bytes, std::min(bytes_, last * block_bytes)};
}

Result<Extent> SparseFile::fetch(std::uint64_t offset, std::uint64_t count, const Get& get,
                                 const Cancelled& cancelled, Purpose purpose) {
  offset = std::min(offset, bytes_);
  const std::uint64_t end = offset + std::min(count, bytes_ - offset);
  const std::size_t end_block = blocks_to(end);
  if (offset == end) return Extent{offset, offset};
  std::unique_lock lock(mutex_);
  std::size_t at = block_of(offset);
  while ((at = blocks_.first_missing(at)) < end_block) {
    if (const auto flight = blocks_.flight_of(at)) {
      if (purpose == Purpose::ahead) {
        at = flight->end;
      } else if (auto done = wait_for(flight, lock, cancelled); !done) {
        return done.error();
      }
      continue;
    }
    std::size_t to = end_block;
    if (purpose == Purpose::read) {
      blocks_.ahead = at == blocks_.next ? std::min(2 * blocks_.ahead, blocks_ahead_max) : 1;
      to = std::min(std::max(end_block, at + blocks_.ahead), blocks_to(bytes_));
    }
    to = blocks_.end_of_missing(at, to);
    if (purpose == Purpose::read) blocks_.next = to;
    auto flight = begin_flight(at, to, purpose);
    if (!flight) return flight.error();
    lock.unlock();
    auto done = fetch_blocks(at, *flight, get);
    lock.lock();
    if (!done) return done.error();
  }
  return present_around(offset, end);
}

Result<void> SparseFile::wait_for(const FlightPtr& flight, std::unique_lock<std::mutex>& lock,
                                  const Cancelled& cancelled) {
  constexpr std::chrono::milliseconds look_every{100};
  while (!blocks_.landed.wait_for(lock, look_every, [&] { return flight->has_landed; })) {
    if (cancelled && cancelled()) {
      return make_error(ErrorKind::cancelled, in_quotes(url_) + " was cancelled");
    }
  }
  const bool is_shared = flight->error && flight->error->kind != ErrorKind::cancelled &&
                         flight->purpose == Purpose::read;
  return is_shared ? Result<void>(*flight->error) : Result<void>();
}

Result<SparseFile::FlightPtr> SparseFile::begin_flight(std::size_t first, std::size_t end,
                                                       Purpose purpose) {
  auto flight = std::make_shared<Flight>();
  flight->end = end;
  flight->bytes = std::min(bytes_, end * block_bytes) - first * block_bytes;
  flight->purpose = purpose;
  if (blocks_.fetched_bytes + blocks_.flying_bytes + flight->bytes > bytes_max_) {
    return make_error(ErrorKind::too_large,
                      "the parts of " + in_quotes(url_) + " that were read have more than the " +
                          std::to_string(bytes_max_) + " bytes of --max-download");
  }
  blocks_.flights.emplace(first, flight);
  blocks_.flying_bytes += flight->bytes;
  return flight;
}

// Sends its request; the flight ends in any case, so that no reader waits for it without end.
Result<void> SparseFile::fetch_blocks(std::size_t first, const FlightPtr& flight, const Get& get) {
  Result<void> done = make_error(ErrorKind::cancelled, in_quotes(url_) + " was not received");
  try {
    done = fetch_bytes(first * block_bytes, flight->bytes, get);
  } catch (...) {
    land(first, *flight, done);
    throw;
  }
  land(first, *flight, done);
  return done;
}

Result<void> SparseFile::fetch_bytes(std::uint64_t begin, std::uint64_t wanted, const Get& get) {
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
  if (got && came == wanted) return {};
  space_.give_back(wanted);
  if (!got) return got.error();
  return make_error(ErrorKind::bad_data, in_quotes(url_) + " was received incompletely");
}

void SparseFile::land(std::size_t first, Flight& flight, const Result<void>& done) {
  const std::lock_guard lock(mutex_);
  blocks_.flights.erase(first);
  blocks_.flying_bytes -= flight.bytes;
  flight.has_landed = true;
  blocks_.landed.notify_all();
  if (!done) {
    flight.error = done.error();
    return;
  }
  blocks_.fetched_bytes += flight.bytes;
  blocks_.add(first, flight.end);
}

void SparseFile::Blocks::add(std::size_t first, std::size_t end) {
  const auto before = present.lower_bound(first);
  if (before != present.begin() && std::prev(before)->second == first) {
    first = std::prev(before)->first;
  }
  if (const auto after = present.find(end); after != present.end()) {
    end = after->second;
    present.erase(after);
  }
  present[first] = end;
}

}  // namespace windsplat::data::fetch
