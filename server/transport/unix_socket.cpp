#include "server/transport/unix_socket.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>

namespace windsplat::transport {
namespace {

Error socket_error(const std::string& path, const std::string& what) {
  return make_error(ErrorKind::internal, "cannot listen on unix:" + printable(path) + ": " + what);
}

std::string text_of_errno() { return std::generic_category().message(errno); }

// Whether a process accepts connections at the path. A full queue is one that is listened to.
bool is_answered(const std::string& path) {
  const int handle = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (handle < 0) return true;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  const bool refused =
      ::connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
      errno == ECONNREFUSED;
  ::close(handle);
  return !refused;
}

}  // namespace

std::string unix_url(const std::string& path, const std::string& base_path) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~";
  std::string url = "http+unix://";
  for (const char c : path) {
    if (plain.find(c) != std::string_view::npos) {
      url += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    url += '%';
    url += digits[byte >> 4U];
    url += digits[byte & 15U];
  }
  return url + base_path;
}

Result<void> remove_stale_socket(const std::string& path) {
  if (path.size() > unix_path_bytes_max) {
    return socket_error(
        path, "the path is longer than " + std::to_string(unix_path_bytes_max) + " bytes");
  }
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0) return {};  // bind() reports other faults
  if (!S_ISSOCK(facts.st_mode)) return socket_error(path, "the file exists and is no socket");
  if (is_answered(path)) return socket_error(path, "another process listens there");
  if (::unlink(path.c_str()) != 0) return socket_error(path, text_of_errno());
  return {};
}

Result<void> UnixSocketFile::own(const std::string& path, unsigned mode) {
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0) return socket_error(path, text_of_errno());
  path_ = path;
  device_ = facts.st_dev;
  inode_ = facts.st_ino;
  if (::chmod(path.c_str(), mode) != 0) return socket_error(path, text_of_errno());
  return {};
}

void UnixSocketFile::remove() {
  struct stat facts {};
  const bool same = !path_.empty() && ::lstat(path_.c_str(), &facts) == 0 &&
                    facts.st_dev == device_ && facts.st_ino == inode_;
  if (same) ::unlink(path_.c_str());
  path_.clear();
}

}  // namespace windsplat::transport
