// pread behind RAII.
#include "server/data/files/input_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace windsplat::data {

Result<std::shared_ptr<const InputFile>> InputFile::adopt(int descriptor, std::string name,
                                                          FileParts parts) {
  const std::shared_ptr<InputFile> file(
      new InputFile(descriptor, std::move(name), std::move(parts)));
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    return file->fault(S_ISDIR(status.st_mode) ? "is a directory, not a file"
                                               : "is not a regular file");
  }
  file->stamp_ = {static_cast<std::uint64_t>(status.st_size), status.st_mtim.tv_sec,
                  status.st_mtim.tv_nsec};
  if (file->size() == 0) return file->fault("is empty");
  return std::shared_ptr<const InputFile>(file);
}

InputFile::~InputFile() { ::close(descriptor_); }

Result<void> InputFile::read(std::uint64_t offset, void* out, std::size_t count) const {
  auto* to = static_cast<char*>(out);
  while (count > 0) {
    const ssize_t got = ::pread(descriptor_, to, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return fault("cannot be read: " + std::generic_category().message(errno));
    if (got == 0) return fault("is truncated: it ends at byte " + std::to_string(offset));
    to += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return {};
}

Result<std::string> InputFile::head(std::size_t bytes_max) const {
  std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(size(), bytes_max)), '\0');
  if (auto done = read(0, text.data(), text.size()); !done) return done.error();
  return text;
}

std::string InputFile::identity() const {
  if (!parts_.state.empty()) {
    return name_ + '\n' + std::to_string(stamp_.bytes) + '\n' + parts_.state;
  }
  return name_ + '\n' + std::to_string(stamp_.bytes) + '\n' + std::to_string(stamp_.seconds) + '.' +
         std::to_string(stamp_.nanoseconds);
}

Result<void> InputFile::check_unchanged() const {
  if (parts_.number != 0) return {};  // checked with every part; storing parts changes its times
  struct stat status {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  const Stamp now{static_cast<std::uint64_t>(status.st_size), status.st_mtim.tv_sec,
                  status.st_mtim.tv_nsec};
  if (!known || !(now == stamp_)) return fault("has changed since it was opened; open it again");
  return {};
}

std::string InputFile::library_path() const {
  return "/proc/self/fd/" + std::to_string(descriptor_);
}

Error InputFile::fault(const std::string& what) const {
  return make_error(ErrorKind::bad_data, in_quotes(name_) + " " + what);
}

}  // namespace windsplat::data
