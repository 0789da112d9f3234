// Opens without blocking and checks the file type before reading.
#include "server/cli/settings_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace windsplat::cli {
namespace {

Error file_error(ErrorKind kind, const std::string& path, const std::string& what) {
  std::string message = "'";
  message += printable(path);
  message += "' " + what;
  return make_error(kind, std::move(message));
}

Error read_error(const char* what, const std::string& path) {
  return file_error(ErrorKind::not_found, path,
                    what + (": " + std::generic_category().message(errno)));
}

// Reads to the end, or to one byte beyond the limit.
Result<std::string> read_descriptor(int file, const std::string& path, std::size_t bytes_max) {
  struct stat facts {};
  if (::fstat(file, &facts) != 0) return read_error("cannot be read", path);
  if (!S_ISREG(facts.st_mode)) {
    return file_error(ErrorKind::invalid, path, "is not a regular file");
  }
  std::string text(bytes_max + 1, '\0');  // allocated once: leaves no copies of a secret
  std::size_t bytes = 0;
  while (bytes < text.size()) {
    const ssize_t got = ::read(file, text.data() + bytes, text.size() - bytes);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return read_error("cannot be read", path);
    if (got == 0) break;
    bytes += static_cast<std::size_t>(got);
  }
  text.resize(bytes);
  return text;
}

}  // namespace

Result<std::string> read_settings_file(const std::string& path, std::size_t bytes_max) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (file < 0) return read_error("cannot be opened", path);
  auto text = read_descriptor(file, path, bytes_max);
  ::close(file);
  if (text && text->size() > bytes_max) {
    return file_error(ErrorKind::too_large, path,
                      "has more than " + std::to_string(bytes_max) + " bytes");
  }
  return text;
}

}  // namespace windsplat::cli
