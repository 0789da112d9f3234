// Fetched files on disk, within a limit on bytes: URL -> open file. Processes may share a folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "server/base/error.hpp"
#include "server/data/fetch/http_client.hpp"
#include "server/data/files/descriptor.hpp"

struct evp_md_ctx_st;

namespace windsplat::data::fetch {

struct CacheOptions {
  std::string folder;  // created, with mode 0700, if it does not exist
  std::uint64_t bytes_max = 0;
  // How long a file that was fetched or confirmed is used without asking its host.
  std::chrono::milliseconds fresh_time{60'000};
};

class ObjectCache;

// Space on disk of a file that has no name in the cache; counts in its size while this exists.
class OpenSpace {
 public:
  explicit OpenSpace(ObjectCache& cache) : cache_(&cache) {}
  OpenSpace(OpenSpace&& other) noexcept;
  OpenSpace& operator=(OpenSpace&&) = delete;
  OpenSpace(const OpenSpace&) = delete;
  OpenSpace& operator=(const OpenSpace&) = delete;
  ~OpenSpace();
  // Removes other files if the cache becomes too large. A file that is being received as a whole
  // may exceed its size, until it is kept.
  void add(std::uint64_t bytes);
  // The same, but false, and nothing is added, if files without a name alone would be too large.
  [[nodiscard]] bool reserve(std::uint64_t bytes);
  void give_back(std::uint64_t bytes);

 private:
  friend class ObjectCache;
  ObjectCache* cache_;
  std::uint64_t bytes_ = 0;
};

// A file that is being received; removed unless it is kept.
class PartialFile {
 public:
  PartialFile(PartialFile&& other) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  ~PartialFile();
  // False: the disk is full or faulty.
  bool append(std::string_view bytes);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  // Removes its name, and gives up the file and its space.
  std::pair<Descriptor, OpenSpace> take();

 private:
  friend class ObjectCache;
  PartialFile(Descriptor file, std::string path, ObjectCache& cache);
  Descriptor file_;
  OpenSpace space_;
  std::string path_;
  std::uint64_t bytes_ = 0;
  std::shared_ptr<evp_md_ctx_st> digest_;
};

// Thread-safe. A file is named by the digests (SHA-256) of its URL and of its bytes, and completed
// by renaming, so that a name always has the same bytes. Its time of modification is derived from
// its bytes: the identity of an open file (InputFile::identity()) is equal if and only if its bytes
// are, whenever it was fetched. Beyond the limit the files used least recently are removed; open
// descriptors remain valid.
class ObjectCache {
 public:
  // Errors: invalid, if the folder cannot be used.
  static Result<std::unique_ptr<ObjectCache>> open(CacheOptions options);
  // SHA-256 in hexadecimal digits.
  static std::string digest_of(const std::string& text);

  struct Entry {
    Descriptor file;
    Validators validators;
    std::uint64_t bytes = 0;
    bool is_fresh = false;
  };
  // Empty: not in the cache. Marks the file as used.
  std::optional<Entry> find(const std::string& url);
  // Errors: out_of_memory.
  Result<PartialFile> begin();
  // Completes a file, which replaces any of the same URL. Errors: out_of_memory.
  Result<Descriptor> keep(const std::string& url, PartialFile part, const Validators& validators);
  // The host confirmed the state of the file.
  void confirm(const std::string& url);
  void remove(const std::string& url);

  // Space of all files on disk, also of those without a name.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  friend class OpenSpace;
  explicit ObjectCache(CacheOptions options);
  void scan();
  void evict(std::uint64_t bytes_max);
  [[nodiscard]] std::string path_of(const std::string& name) const;

  CacheOptions options_;
  mutable std::mutex mutex_;      // guards the members below
  std::uint64_t bytes_ = 0;       // at the last scan, and what was added since
  std::uint64_t open_bytes_ = 0;  // of files without a name
  std::unordered_map<std::string, std::chrono::steady_clock::time_point> confirmed_;
};

}  // namespace windsplat::data::fetch
