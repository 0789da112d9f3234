// The file of a listening UNIX socket.
#pragma once

#include <sys/types.h>

#include <string>

#include "server/base/error.hpp"

namespace windsplat::transport {

// Bytes of the path of a UNIX socket (unix(7)), without the final zero.
inline constexpr std::size_t unix_path_bytes_max = 107;

// The URL of a server at a UNIX socket: http+unix://, the path with escaped slashes as the host,
// and the base path.
std::string unix_url(const std::string& path, const std::string& base_path);

// Removes the file of a socket that was left behind by a process that has ended: nobody answers
// there. Errors: internal: another process listens there, or the file is no socket.
Result<void> remove_stale_socket(const std::string& path);

// Removes the file at destruction, unless another one has taken its place.
class UnixSocketFile {
 public:
  UnixSocketFile() = default;
  ~UnixSocketFile() { remove(); }
  UnixSocketFile(const UnixSocketFile&) = delete;
  UnixSocketFile& operator=(const UnixSocketFile&) = delete;

  // Call after bind(): owns the file from here on, and gives it the mode.
  Result<void> own(const std::string& path, unsigned mode);
  void remove();
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;  // empty: none
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

}  // namespace windsplat::transport
