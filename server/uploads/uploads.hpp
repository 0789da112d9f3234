// Files that clients send: received into a private folder, within a quota, for a limited time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/uploads/content_digest.hpp"

namespace windsplat::uploads {

inline constexpr int keep_s_default = 3600;
inline constexpr int keep_s_max = 7 * 86400;

struct Options {
  std::filesystem::path folder;  // private; uploads are removed from it at both ends
  std::uint64_t bytes_max = 0;   // of all files, 8 KiB at least; one address may have half of it
};

struct Upload {
  std::string id;
  std::uint64_t bytes = 0;
  Sha256 digest{};
  std::time_t expires = 0;
};

// What is announced of an upload.
struct Announced {
  std::string id;
  std::uint64_t bytes = 0;
  int keep_s = keep_s_default;
  std::optional<Sha256> digest;
  std::string address;  // whose quota it takes
};

// Names of files: letters, digits, '-' and '_', in parts separated by single dots.
bool is_upload_id(std::string_view text);

class Incoming;

// Thread-safe. Ids that equal up to their first dot share a folder, so that a description and its
// data are companions.
class Uploads {
 public:
  // Creates the folder, readable only by its owner, without what a killed daemon left. Errors:
  // invalid (it cannot be created, or has other files).
  static Result<std::shared_ptr<Uploads>> open(Options options);
  // Removes the uploads of a daemon that was killed, and the folder unless it has other files. Does
  // nothing to folders that this class has not made. Errors: internal (disk).
  static Result<void> remove_leftovers(const std::filesystem::path& folder);
  ~Uploads();
  Uploads(const Uploads&) = delete;
  Uploads& operator=(const Uploads&) = delete;

  [[nodiscard]] std::uint64_t bytes_max() const;
  [[nodiscard]] std::uint64_t bytes_max_per_address() const;
  [[nodiscard]] const std::filesystem::path& folder() const;
  // Path of an upload below folder().
  [[nodiscard]] static std::string path_of(const std::string& id);

  // Takes the id, and room as bytes arrive; does not wait for a disk. Errors: invalid (id, no
  // bytes); too_large (for one address); conflict (an upload of that id exists); busy (too many at
  // a time); out_of_memory (more than what is left of the quota, or too many are kept).
  Result<std::shared_ptr<Incoming>> begin(const Announced& announced);
  // Errors: not_found.
  [[nodiscard]] Result<Upload> find(const std::string& id) const;

  // Notes that a dataset was opened from it. False: it is gone.
  bool opened(const std::string& id, const std::string& dataset);
  // Removes an upload; the value: the datasets opened from it. Errors: not_found.
  Result<std::vector<std::string>> remove(const std::string& id);
  // The same for those that have expired.
  std::vector<std::string> expire(std::time_t now);

 private:
  friend class Incoming;
  struct State;
  explicit Uploads(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

// One upload that is being received, by one thread at a time. Unless it is finished, nothing of it
// remains.
class Incoming {
 public:
  ~Incoming();
  Incoming(const Incoming&) = delete;
  Incoming& operator=(const Incoming&) = delete;

  // Whether finish() unpacks it.
  [[nodiscard]] bool is_archive() const;
  // The same for all uploads that an address sends at a time.
  [[nodiscard]] const std::shared_ptr<const void>& address_key() const { return address_key_; }

  // Errors: out_of_memory (quota, disk full), internal (disk); nothing of it remains then.
  Result<void> write(std::span<const std::byte> bytes);
  // Makes it visible, or discards it. Errors: invalid (another digest than announced); cancelled;
  // those of write(); of a ZIP archive, which is unpacked, bad_data.
  Result<Upload> finish(const CancelToken& cancel);

 private:
  friend class Uploads;
  Incoming(std::shared_ptr<Uploads::State> state, Announced announced, std::filesystem::path path,
           std::shared_ptr<const void> address_key);

  Result<void> open_file();
  Result<void> store(std::span<const std::byte> bytes);
  Result<Upload> publish(const CancelToken& cancel);
  void discard();

  const std::shared_ptr<Uploads::State> state_;
  const Announced announced_;
  const std::filesystem::path path_;
  const std::shared_ptr<const void> address_key_;
  int file_ = -1;       // from the first byte on
  bool ended_ = false;  // finished or discarded
  std::uint64_t written_ = 0;
  Hasher hasher_;
};

}  // namespace windsplat::uploads
