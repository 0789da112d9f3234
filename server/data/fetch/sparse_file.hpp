// A file of a host of which only the bytes that were read are on disk: extent -> requests for the
// blocks that are missing.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/error.hpp"
#include "server/data/fetch/http_client.hpp"
#include "server/data/fetch/object_cache.hpp"
#include "server/data/files/descriptor.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::fetch {

// Digest of URL, size and ETag of a file.
std::string state_of(const std::string& url, std::uint64_t bytes, const std::string& etag);

// Who asks for bytes: a reader, or nobody yet, so that a failure is no reader's error.
enum class Purpose { read, ahead };

// Thread-safe, with several requests at a time. The file has no name on disk, so that it ends with
// the process; its blocks count in the size of the cache, which must outlive it.
class SparseFile {
 public:
  // The metadata of HDF5 files lie scattered among their data, so that blocks are small.
  static constexpr std::uint64_t block_bytes = std::uint64_t{64} << 10;
  static constexpr std::uint64_t begin_bytes = 4 * block_bytes;  // of the first request
  // Of a file that is read in sequence: each request asks for twice as many blocks as the last one.
  static constexpr std::size_t blocks_ahead_max = 128;

  // Sends a request for bytes of the file in its state.
  using Get = std::function<Result<void>(ByteRange range, const HttpClient::Sink& sink)>;
  using Cancelled = std::function<bool()>;

  // `begin`: the first bytes of the file, whole blocks, of a file that is longer.
  // `bytes_max`: of all blocks that are fetched. Errors: out_of_memory.
  static Result<std::shared_ptr<SparseFile>> make(const std::string& url, PartialFile begin,
                                                  const Response& response,
                                                  std::uint64_t bytes_max);

  // Fetches what is missing of [offset, offset + count), clipped to the file. The result contains
  // it and is present; ahead, blocks that others are fetching are left to them and may be missing.
  // Readers wait for blocks that are being fetched and share the error of a reader's request, but
  // ask again after one that was cancelled or made ahead. Errors: those of `get`; too_large;
  // cancelled; out_of_memory, also if the cache has no room for it.
  Result<Extent> fetch(std::uint64_t offset, std::uint64_t count, const Get& get,
                       const Cancelled& cancelled, Purpose purpose = Purpose::read);
  [[nodiscard]] bool is_present(const Extent& extent) const;
  // Opens it for reading, with a position of its own. Errors: out_of_memory.
  [[nodiscard]] Result<Descriptor> open() const;

  [[nodiscard]] const std::string& url() const { return url_; }
  [[nodiscard]] const Validators& validators() const { return validators_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t fetched_bytes() const;
  // state_of() of it.
  [[nodiscard]] const std::string& state() const { return state_; }

 private:
  SparseFile(const std::string& url, std::pair<Descriptor, OpenSpace> file,
             const Response& response, std::uint64_t begin_bytes, std::uint64_t bytes_max);
  // A request that is under way.
  struct Flight {
    std::size_t end = 0;  // of its blocks, from its key in Blocks::flights on
    std::uint64_t bytes = 0;
    Purpose purpose = Purpose::read;
    bool has_landed = false;
    std::optional<Error> error;
  };
  using FlightPtr = std::shared_ptr<Flight>;
  struct Blocks {
    // Blocks [key, value) that are present, not side by side: as much memory as was fetched
    // deserves, whatever size the host claims.
    std::map<std::size_t, std::size_t> present;
    std::map<std::size_t, FlightPtr> flights;  // by their first block; apart
    std::condition_variable landed;
    std::uint64_t fetched_bytes = 0;
    std::uint64_t flying_bytes = 0;
    std::size_t next = 0;   // the block after a reader's last request
    std::size_t ahead = 1;  // blocks of that request at least

    // The first block from `from` on that is missing.
    [[nodiscard]] std::size_t first_missing(std::size_t from) const;
    // Null: the block is not being fetched.
    [[nodiscard]] FlightPtr flight_of(std::size_t block) const;
    // The end of the blocks from a missing one on that neither are present nor are being fetched.
    [[nodiscard]] std::size_t end_of_missing(std::size_t from, std::size_t end) const;
    void add(std::size_t first, std::size_t end);
  };
  Result<void> fetch_blocks(std::size_t first, const FlightPtr& flight, const Get& get);
  Result<void> fetch_bytes(std::uint64_t begin, std::uint64_t wanted, const Get& get);
  void land(std::size_t first, Flight& flight, const Result<void>& done);
  // The functions below need the mutex to be held.
  Result<FlightPtr> begin_flight(std::size_t first, std::size_t end, Purpose purpose);
  Result<void> wait_for(const FlightPtr& flight, std::unique_lock<std::mutex>& lock,
                        const Cancelled& cancelled);
  [[nodiscard]] Extent present_around(std::uint64_t offset, std::uint64_t end) const;

  const std::string url_;
  const Descriptor file_;
  OpenSpace space_;
  const Validators validators_;
  const std::uint64_t bytes_;
  const std::uint64_t bytes_max_;
  const std::string state_;
  mutable std::mutex mutex_;  // guards the next member
  Blocks blocks_;
};

}  // namespace windsplat::data::fetch
