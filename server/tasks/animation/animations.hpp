// Finished animations: files without a name, kept for a while and within limits on their number and
// bytes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "protocol/measurements.hpp"
#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"

namespace windsplat::tasks {

// The content of a file in memory, as the system keeps it: pages are read when they are used. The
// file has no name, so that nothing else changes it.
class MappedFile {
 public:
  // Errors: internal.
  static Result<std::shared_ptr<const MappedFile>> of(const data::Descriptor& file);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  explicit MappedFile(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::span<const std::uint8_t> bytes_;
};

// Thread-safe.
class Animations {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr double render_s_max = 3600;  // of all pictures of one: expected, and passed
  static constexpr std::int64_t kept_bytes_max = std::int64_t{1} << 30;  // of all
  static constexpr std::size_t kept_max = 256;  // each is a mapping and a file
  static constexpr std::chrono::seconds lasts{3600};

  struct Kept {
    protocol::AnimationDescription description;
    std::string file_name;  // suggested to those who save it
    std::shared_ptr<const MappedFile> file;
  };

  // The oldest ones make room. Files that are being sent exist until that ends. Here and below,
  // removed files are released after the lock, for which the network thread waits.
  void keep(Kept kept, Clock::time_point now = Clock::now());
  [[nodiscard]] std::optional<Kept> find(const std::string& id,
                                         Clock::time_point now = Clock::now());
  // False: there is none of that id.
  bool remove(const std::string& id);
  // Removes those whose time is over. Call it periodically.
  void expire(Clock::time_point now = Clock::now());

 private:
  struct Entry {
    Kept kept;
    Clock::time_point until;
  };
  using Entries = std::list<Entry>;
  // Moves out those for which `unwanted` holds. Requires the mutex.
  template <class Unwanted>
  [[nodiscard]] Entries take(const Unwanted& unwanted);

  std::mutex mutex_;
  Entries entries_;  // oldest first
};

}  // namespace windsplat::tasks
