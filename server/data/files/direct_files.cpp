// Opens files directly in this process, restricted to their location.
#include <dirent.h>
#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "server/data/files/descriptor.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data {

namespace {

constexpr std::size_t entries_max = 1'000'000;
constexpr std::size_t companions_max = 256;

std::string last_part(const std::string& name) { return name.substr(name.find_last_of('/') + 1); }

Error is_fetched(const Location& location) {
  return make_error(
      ErrorKind::invalid,
      in_quotes(location.members.empty() ? location.folder : location.members.front().path) +
          " is a URL; files are fetched only from the hosts of --data-host");
}

Error not_opened(const std::string& name, int reason) {
  const bool absent = reason == ENOENT || reason == ENOTDIR;
  const bool outside = reason == EXDEV || reason == ELOOP;
  const bool not_companion = reason == ENOTSUP;
  return make_error(
      absent ? ErrorKind::not_found : ErrorKind::bad_data,
      in_quotes(name) + ": " +
          (absent          ? std::string("no such file")
           : outside       ? std::string("lies outside the dataset's folder")
           : not_companion ? std::string("is another file; only files whose name ends in "
                                         ".nhdr, .json, .ctl, .dx, .pvd, .foam, .case, .encas, "
                                         ".pvti, .pvtr, .pvts, .pvtu, .vtm, .vtmb, .vtpd or .vtpc "
                                         "may refer to others")
                           : std::generic_category().message(reason)));
}

int open_in(int folder, const std::string& name, std::uint64_t flags, std::uint64_t resolve) {
  open_how how{};
  how.flags = flags;
  how.resolve = resolve;
  return static_cast<int>(::syscall(SYS_openat2, folder, name.c_str(), &how, sizeof how));
}

class DirectFiles final : public Files {
 public:
  explicit DirectFiles(Location location) : location_(std::move(location)) {
    if (location_.fetched) return;
    // Links were resolved when the dataset was located; a later link may lead elsewhere.
    folder_.reset(
        open_in(AT_FDCWD, location_.folder, O_PATH | O_DIRECTORY | O_CLOEXEC, RESOLVE_NO_SYMLINKS));
  }
  [[nodiscard]] const Location& location() const override { return location_; }

  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    if (location_.fetched) return is_fetched(location_);
    // O_NONBLOCK: opening a pipe must not wait for a writer; adopt() rejects pipes.
    const int descriptor = open_any(name, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (descriptor < 0) {
      const int reason = errno;
      if (reason == ENOENT && is_dangling(name)) {
        return make_error(ErrorKind::bad_data, in_quotes(name) + ": dangling link");
      }
      return not_opened(name, reason);
    }
    remember(name, descriptor);
    auto file = InputFile::adopt(descriptor, last_part(name));
    if (file) count_opened(name, (*file)->size());
    return file;
  }

  [[nodiscard]] std::vector<Companion> companions() const override { return companions_; }

  Result<std::vector<std::string>> list(const std::string& folder) override {
    if (location_.fetched) return is_fetched(location_);
    const int descriptor =
        open_any(folder.empty() ? "." : folder, O_RDONLY | O_CLOEXEC | O_DIRECTORY);
    if (descriptor < 0) return not_opened(folder, errno);
    DIR* directory = ::fdopendir(descriptor);
    if (directory == nullptr) {
      const int reason = errno;
      ::close(descriptor);
      return not_opened(folder, reason);
    }
    std::vector<std::string> out;
    while (const dirent* entry = ::readdir(directory)) {
      std::string found = entry->d_name;
      if (found == "." || found == "..") continue;
      struct stat status {};
      if (::fstatat(descriptor, found.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0 &&
          S_ISDIR(status.st_mode)) {
        found += '/';
      }
      out.push_back(std::move(found));
      if (out.size() > entries_max) break;
    }
    ::closedir(directory);
    if (out.size() > entries_max) {
      return make_error(ErrorKind::bad_data, in_quotes(folder) + " has more than " +
                                                 std::to_string(entries_max) + " entries");
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  bool exists(const std::string& name) override {
    if (location_.fetched) return false;
    const int descriptor = open_any(name, O_PATH | O_CLOEXEC);
    if (descriptor >= 0) ::close(descriptor);
    return descriptor >= 0;
  }

 private:
  // Whether a name that cannot be opened, or a folder above it, is a dangling link. Distinguishes
  // lost files from files that were never written.
  [[nodiscard]] bool is_dangling(std::string name) {
    for (;;) {
      const Descriptor found(open_any(name, O_PATH | O_NOFOLLOW | O_CLOEXEC));
      struct stat status {};
      if (found) {
        return ::fstat(found.number(), &status) == 0 && S_ISLNK(status.st_mode) && !exists(name);
      }
      const auto above = name.rfind('/');
      if (above == std::string::npos || above == 0) return false;
      name.resize(above);
    }
  }

  // -1, with errno set, if opening fails.
  [[nodiscard]] int open_any(const std::string& name, std::uint64_t flags) const {
    if (const auto member = find_member(name); member != location_.members.end()) {
      return open_in(AT_FDCWD, member->path, flags, RESOLVE_NO_SYMLINKS);
    }
    if (!location_.companions && location_.kind != Location::Kind::folder) {
      errno = ENOTSUP;  // permits access only to the folder; no file is opened through it
      return -1;
    }
    if (name.find('\0') != std::string::npos || name.empty() || name.front() == '/') {
      errno = EXDEV;
      return -1;
    }
    return open_in(folder_.number(), name, flags, RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS);
  }

  [[nodiscard]] std::vector<Location::Member>::const_iterator find_member(
      const std::string& name) const {
    return std::find_if(location_.members.begin(), location_.members.end(),
                        [&](const Location::Member& known) { return known.name == name; });
  }

  void remember(const std::string& name, int descriptor) {
    struct stat status {};
    if (companions_.size() >= companions_max || find_member(name) != location_.members.end() ||
        ::fstat(descriptor, &status) != 0) {
      return;
    }
    companions_.push_back({location_.folder + '/' + name, stamp_of(status)});
  }

  Location location_;
  Descriptor folder_;
  std::vector<Companion> companions_;
};

}  // namespace

std::shared_ptr<Files> direct_files(Location location) {
  return std::make_shared<DirectFiles>(std::move(location));
}

}  // namespace windsplat::data
