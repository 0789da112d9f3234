// Runs wherever a library opens a file, possibly while the allocator's lock is held: it must not
// allocate memory or take locks.
#include "server/data/loader/by_name.hpp"

#include <fcntl.h>
#include <seccomp.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <string_view>
#include <utility>

#include "server/data/loader/by_parts.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/window.hpp"

namespace windsplat::data::loader {

namespace {

constexpr std::string_view own_files = "/proc/self/fd/";

struct Asking {
  int socket = -1;
  std::vector<std::string> folders;  // every entry ends in '/'
};

// A signal handler has no context argument.
Asking& asking() {
  static Asking all;
  return all;
}

bool is_regular(int descriptor) {
  struct stat status {};
  return ::syscall(SYS_fstat, descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

// The number of "/proc/self/fd/N"; -1 if the path differs or is not a regular file.
int own_file(std::string_view path) {
  if (!path.starts_with(own_files)) return -1;
  int number = -1;
  const char* end = path.data() + path.size();
  const auto [stop, fault] = std::from_chars(path.data() + own_files.size(), end, number);
  return fault == std::errc() && stop == end && number >= 0 && is_regular(number) ? number : -1;
}

bool is_libraries(std::string_view path) {
  if (asking().socket < 0) return false;
  for (const std::string& folder : asking().folders) {
    if (path.starts_with(folder)) return true;
  }
  return false;
}

// A descriptor, or a negative errno.
long ask_for(std::string_view path) {
  const int socket = asking().socket;
  if (send_message(socket, Kind::ask_library, path.data(), path.size(), -1, {}) != Fate::done) {
    return -EIO;
  }
  Descriptor came;
  Frame frame;
  do {
    if (receive_bytes(socket, reinterpret_cast<char*>(&frame), sizeof frame, &came, {}) !=
            Fate::done ||
        frame.bytes != 0) {
      ::_exit(1);  // the channel to the daemon is out of sync
    }
  } while (is_of_window(frame));
  return came ? came.give() : -ENOENT;
}

// A new descriptor for the file of this name, or a negative errno.
long open_named(const char* name, int flags) {
  if (name == nullptr) return -EFAULT;
  const std::string_view path(name);
  const bool writes = (flags & O_ACCMODE) != O_RDONLY || (flags & (O_CREAT | O_TRUNC)) != 0;
  if (writes || (flags & O_DIRECTORY) != 0) return -EACCES;
  if (const int number = own_file(path); number >= 0) {
    if (number >= first_of_parts()) {
      const int copy = copy_of_parts(number);
      if (copy >= 0) ::lseek(copy, 0, SEEK_SET);
      return copy;
    }
    const int copy = ::fcntl(number, F_DUPFD_CLOEXEC, 0);
    if (copy < 0) return -errno;
    // A duplicate shares its file offset with the original, which InputFile does not use.
    ::lseek(copy, 0, SEEK_SET);
    return copy;
  }
  return is_libraries(path) ? ask_for(path) : -EACCES;
}

// Whether a folder of a library is this one or lies below it.
bool leads_to_libraries(std::string_view path) {
  for (const std::string& folder : asking().folders) {
    if (folder.starts_with(path) && folder[path.size()] == '/') return true;
  }
  return false;
}

long look_at(const char* name, struct stat* out) {
  if (name != nullptr && *name != '\0' && leads_to_libraries(name)) {
    // SQLite looks for links among the folders of a database.
    *out = {};
    out->st_mode = S_IFDIR | S_IRUSR | S_IXUSR;
    return 0;
  }
  const long opened = open_named(name, O_RDONLY);
  if (opened < 0) return opened;
  const Descriptor file(static_cast<int>(opened));
  return ::syscall(SYS_fstat, file.number(), out) == 0 ? 0 : -errno;
}

long may_read(const char* name, int mode) {
  if ((mode & (W_OK | X_OK)) != 0) return -EACCES;
  const long opened = open_named(name, O_RDONLY);
  if (opened < 0) return opened;
  const Descriptor closes(static_cast<int>(opened));
  return 0;
}

using Arguments = std::array<std::uint64_t, 4>;

const char* name_at(const Arguments& given, std::size_t i) {
  return reinterpret_cast<const char*>(given.at(i));  // NOLINT: a call's arguments are numbers
}

void* memory_at(const Arguments& given, std::size_t i) {
  return reinterpret_cast<void*>(given.at(i));  // NOLINT: as above
}

long answer(int call, const Arguments& given) {
  const auto number = [&](std::size_t i) { return static_cast<int>(given.at(i)); };
  const auto status_at = [&](std::size_t i) {
    return reinterpret_cast<struct stat*>(given.at(i));  // NOLINT: as above
  };
  switch (call) {
    case SCMP_SYS(openat):
      return open_named(name_at(given, 1), number(2));
    case SCMP_SYS(newfstatat):
      if (const char* name = name_at(given, 1);
          (number(3) & AT_EMPTY_PATH) != 0 && (name == nullptr || *name == '\0')) {
        return ::syscall(SYS_fstat, number(0), status_at(2)) == 0 ? 0 : -errno;
      }
      return look_at(name_at(given, 1), status_at(2));
    case SCMP_SYS(faccessat):
    case SCMP_SYS(faccessat2):
      return may_read(name_at(given, 1), number(2));
    case SCMP_SYS(open):
      return open_named(name_at(given, 0), number(1));
    case SCMP_SYS(stat):
    case SCMP_SYS(lstat):
      return look_at(name_at(given, 0), status_at(1));
    case SCMP_SYS(access):
      return may_read(name_at(given, 0), number(1));
    case SCMP_SYS(read):
      return read_part(number(0), memory_at(given, 1), given[2]);
    case SCMP_SYS(pread64):
      return read_part(number(0), memory_at(given, 1), given[2], static_cast<off_t>(given[3]));
    default:
      return -EACCES;
  }
}

void on_call(int /*signal*/, siginfo_t* about, void* context) {
  const int kept = errno;
  auto& machine = static_cast<ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  const auto value = [&](int which) { return static_cast<std::uint64_t>(machine.gregs[which]); };
  const Arguments given{value(REG_RDI), value(REG_RSI), value(REG_RDX), value(REG_R10)};
  machine.gregs[REG_RAX] = answer(about->si_syscall, given);
#elif defined(__aarch64__)
  const Arguments given{machine.regs[0], machine.regs[1], machine.regs[2], machine.regs[3]};
  machine.regs[0] = static_cast<std::uint64_t>(answer(about->si_syscall, given));
#else
#error "system call arguments are unknown for this processor architecture: loaders are unsupported"
#endif
  errno = kept;
}

}  // namespace

const std::vector<int>& calls_by_name() {
  static const std::vector<int> all{SCMP_SYS(openat),    SCMP_SYS(openat2),    SCMP_SYS(newfstatat),
                                    SCMP_SYS(faccessat), SCMP_SYS(faccessat2), SCMP_SYS(readlinkat),
                                    SCMP_SYS(statx),     SCMP_SYS(open),       SCMP_SYS(stat),
                                    SCMP_SYS(lstat),     SCMP_SYS(access),     SCMP_SYS(readlink)};
  return all;
}

Result<void> answer_calls_by_name(int socket, std::vector<std::string> library_folders) {
  for (std::string& folder : library_folders) folder += '/';
  asking() = {socket, std::move(library_folders)};
  struct sigaction action {};
  action.sa_sigaction = &on_call;
  action.sa_flags = SA_SIGINFO;
  sigfillset(&action.sa_mask);
  sigdelset(&action.sa_mask, SIGIO);
  if (::sigaction(SIGSYS, &action, nullptr) != 0) {
    return make_error(ErrorKind::internal, "cannot install the handler of SIGSYS");
  }
  return {};
}

}  // namespace windsplat::data::loader
