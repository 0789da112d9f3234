// Writes a temporary file whose name contains the process id, then renames it.
#include "server/base/whole_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstddef>
#include <string>
#include <system_error>
#include <utility>

#include "server/base/disk_error.hpp"

namespace windsplat {
namespace {

namespace fs = std::filesystem;

constexpr mode_t mode_of_new_files = 0666;  // before umask

Error file_error(const char* what, const fs::path& path, int fault) {
  std::string message = what;
  message += " '";
  message += printable(path.native());
  message += '\'';
  return disk_error(fault, message);
}

// Returns 0 or the errno of the failed call.
int write_and_close(int file, std::string_view bytes, Sync sync = Sync::later) {
  int fault = 0;
  for (std::size_t done = 0; done < bytes.size() && fault == 0;) {
    const ssize_t wrote = ::write(file, bytes.data() + done, bytes.size() - done);
    if (wrote >= 0) {
      done += static_cast<std::size_t>(wrote);
    } else if (errno != EINTR) {
      fault = errno;
    }
  }
  if (fault == 0 && sync == Sync::now && ::fsync(file) != 0) fault = errno;
  if (::close(file) != 0 && fault == 0) fault = errno;
  return fault;
}

constexpr int links_max = 40;  // as in Linux

// Writes to a descriptor without reopening or truncating it, so that other output is kept.
Result<void> write_to_descriptor(int number, const fs::path& path, std::string_view bytes) {
  const int file = ::fcntl(number, F_DUPFD_CLOEXEC, 0);
  if (file < 0) return file_error("cannot write", path, errno);
  if (const int fault = write_and_close(file, bytes))
    return file_error("cannot write", path, fault);
  return {};
}

Result<void> write_in_place(const fs::path& path, std::string_view bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  if (file < 0) return file_error("cannot write", path, errno);
  if (const int fault = write_and_close(file, bytes))
    return file_error("cannot write", path, fault);
  return {};
}

// Creates a file, replacing one left by an earlier process with the same id.
int create(const fs::path& path) {
  constexpr int flags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW;
  const int file = ::open(path.c_str(), flags, mode_of_new_files);
  std::error_code ignored;
  if (file >= 0 || errno != EEXIST || !fs::is_regular_file(fs::symlink_status(path, ignored))) {
    return file;
  }
  fs::remove(path, ignored);
  return ::open(path.c_str(), flags, mode_of_new_files);
}

}  // namespace

int inherited_descriptor(fs::path path) {
  std::error_code fault;
  for (int i = 0; i < links_max; ++i) {
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (fs::equivalent(folder, "/proc/self/fd", fault)) {
      const std::string name = path.filename().native();
      int number = -1;
      const auto [end, bad] = std::from_chars(name.data(), name.data() + name.size(), number);
      return bad == std::errc() && end == name.data() + name.size() ? number : -1;
    }
    if (!fs::is_symlink(fs::symlink_status(path, fault))) return -1;
    path = folder / fs::read_symlink(path, fault);
  }
  return -1;
}

fs::path end_of_links(fs::path path) {
  std::error_code fault;
  for (int i = 0; i < links_max && fs::is_symlink(fs::symlink_status(path, fault)); ++i) {
    const fs::path target = fs::read_symlink(path, fault);
    if (fault) break;
    path = path.parent_path() / target;  // an absolute target replaces the path
  }
  return path;
}

fs::path part_of(const fs::path& target) {
  fs::path part = target;
  part += ".";
  part += std::to_string(::getpid());
  part += ".part";
  return part;
}

bool is_stream(const fs::path& path) {
  if (inherited_descriptor(path) >= 0) return true;
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::is_fifo(status) || fs::is_character_file(status) || fs::is_socket(status);
}

Result<void> write_whole_file(const fs::path& path, std::string_view bytes, Sync sync) {
  std::error_code ignored;
  if (const int number = inherited_descriptor(path); number >= 0) {
    return write_to_descriptor(number, path, bytes);
  }
  const fs::file_status status = fs::status(path, ignored);
  const bool replaces = fs::is_regular_file(status);
  if (fs::exists(status) && !replaces) return write_in_place(path, bytes);
  const fs::path target = end_of_links(path);
  if (fs::is_symlink(fs::symlink_status(target, ignored))) {
    return file_error("cannot write", path, ELOOP);
  }
  const fs::path part = part_of(target);
  const int file = create(part);
  if (file < 0) return file_error("cannot create", path, errno);
  if (replaces) fs::permissions(part, status.permissions(), ignored);
  int fault = write_and_close(file, bytes, sync);
  if (fault == 0 && ::rename(part.c_str(), target.c_str()) != 0) fault = errno;
  if (fault != 0) {
    fs::remove(part, ignored);
    return file_error("cannot write", path, fault);
  }
  if (sync == Sync::later) return {};
  return sync_folder(target.has_parent_path() ? target.parent_path() : fs::path("."));
}

Result<void> sync_folder(const fs::path& folder) {
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return file_error("cannot open", folder, errno);
  const int fault = ::fsync(handle) == 0 ? 0 : errno;
  ::close(handle);
  if (fault != 0) return file_error("cannot write", folder, fault);
  return {};
}

}  // namespace windsplat
