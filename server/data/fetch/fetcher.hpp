// Files of datasets on other hosts: URL -> cache or request -> open file.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/fetch/host_rules.hpp"
#include "server/data/fetch/http_client.hpp"
#include "server/data/fetch/noted_files.hpp"
#include "server/data/fetch/object_cache.hpp"
#include "server/data/fetch/s3.hpp"
#include "server/data/fetch/sparse_file.hpp"
#include "server/data/files/descriptor.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::fetch {

struct FetchOptions {
  HostRules rules;
  RequestLimits limits;
  CacheOptions cache;
  std::string authorities;  // file of certificates to trust; empty: those of the system
  std::optional<S3Service> s3;
};

using Cancelled = std::function<bool()>;

// A file that is open for reading.
struct FetchedFile {
  Descriptor file;
  std::shared_ptr<SparseFile> parts;  // null: all bytes are present
  std::string state;                  // identifies its bytes; empty: its times do
};

enum class Fetch { whole, parts };  // parts: as many files as their hosts send parts of

// Thread-safe.
class Fetcher {
 public:
  // Errors: those of ObjectCache::open().
  static Result<std::unique_ptr<Fetcher>> open(FetchOptions options);

  // Whether the host of a location is permitted. Errors: invalid.
  [[nodiscard]] Result<void> check(const Location& location) const;

  // The file at a URL of https, http or s3, from the cache if its host confirms it, or did so
  // recently. A URL may have a percent-encoded query. Errors: those of HttpClient::get(),
  // out_of_memory if it cannot be stored.
  // Ahead, files of more than AheadLimits::bytes_max are left to the reader: too_large.
  Result<FetchedFile> fetch(const std::string& url, Fetch how, const Cancelled& cancelled,
                            Purpose purpose = Purpose::read);
  // Bytes of a file that is here in parts, which is that of the URL; the file is kept in the cache
  // when all are present. Errors: those of SparseFile::fetch() and HttpClient::get(), after which
  // the next to open it asks for its state.
  Result<Extent> fetch_part(const std::string& url, SparseFile& file, std::uint64_t offset,
                            std::uint64_t count, const Cancelled& cancelled,
                            Purpose purpose = Purpose::read);
  // Whether parts that do not fit together were received of a file (SparseFile::url()) that is thus
  // fetched as a whole when it is opened next.
  [[nodiscard]] bool is_unfit(const std::string& key) { return noted_.is_unfit(key); }
  // Names directly below a folder of an S3 service, sorted; folders end in '/'. Errors: bad_data,
  // also for other hosts, which have no lists.
  Result<std::vector<std::string>> list(const std::string& folder_url, const Cancelled& cancelled);

  // What may be fetched ahead of its readers.
  struct AheadLimits {
    std::uint64_t bytes_max = 0;                  // of a dataset, on disk before they are read
    std::uint64_t file_bytes_max = 0;             // of a file that is fetched as a whole
    std::uint64_t all_bytes_max = 0;              // of parts of all datasets, about
    std::atomic<std::uint64_t> unread_bytes = 0;  // of these
    std::atomic<int> threads = 0;
    // One more thread. False: there are enough of them.
    [[nodiscard]] bool begin();
    void end() { --threads; }
  };
  [[nodiscard]] AheadLimits& ahead_limits() { return ahead_; }

  // Ends all present and future requests.
  void end() { ended_ = true; }

 private:
  explicit Fetcher(FetchOptions options);
  // The request for a URL of a file; without a query.
  [[nodiscard]] Result<Request> request_of(const Url& url, const Cancelled& cancelled) const;
  Result<Response> get(const Request& request, const HttpClient::Sink& sink);

  using Clock = std::chrono::steady_clock;
  // Those used last come first.
  struct KnownParts {
    std::string key;
    std::shared_ptr<SparseFile> file;
    Clock::time_point confirmed;
  };
  [[nodiscard]] std::optional<KnownParts> find_parts(const std::string& key);
  void keep_parts(const std::string& key, std::shared_ptr<SparseFile> file);
  void forget_parts(const std::string& key);
  // Removes files that no dataset has open until there is room for so many bytes in the cache.
  void drop_idle_parts(std::uint64_t bytes);
  void keep_whole(const SparseFile& file);
  [[nodiscard]] std::string state_of_kept(const std::string& key, const ObjectCache::Entry& entry);

  FetchOptions options_;
  std::shared_ptr<const HostRules> rules_;
  std::unique_ptr<ObjectCache> cache_;
  std::atomic<bool> ended_ = false;
  AheadLimits ahead_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<HttpClient>> idle_;  // guarded by the mutex
  std::list<KnownParts> parts_;                    // guarded by the mutex
  NotedFiles noted_;
};

// The files of a location that is fetched. `cancelled` ends a request that is under way. The
// fetcher must outlive the result.
std::shared_ptr<Files> fetched_files(Fetcher& fetcher, Location location, Cancelled cancelled);

}  // namespace windsplat::data::fetch
