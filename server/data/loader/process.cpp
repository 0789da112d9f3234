// Starts a process with posix_spawn, a socket and a pipe, and reaps it with waitpid.
#include "server/data/loader/process.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "server/base/spawn.hpp"
#include "server/data/cf/grid/crs_wkt.hpp"
#include "server/data/loader/confine.hpp"

namespace windsplat::data::loader {

namespace {

#ifdef WINDSPLAT_SANITIZED
constexpr bool messages_are_shown = true;  // options of the sanitizer
#else
constexpr bool messages_are_shown = false;
#endif

Error not_started(int reason) {
  return make_error(ErrorKind::internal,
                    "a loader cannot be started: " + std::generic_category().message(reason));
}

// Above the descriptor numbers that the loader uses.
Descriptor moved_up(Descriptor from) {
  constexpr int first_free = 16;
  return Descriptor(::fcntl(from.number(), F_DUPFD_CLOEXEC, first_free));
}

// Opened once, so that loaders still start if /dev/null disappears while the daemon runs (replaced
// by a program that runs as root, or hidden by a mount). Errors: internal.
Result<int> null_device() {
  static std::mutex mutex;
  static Descriptor device;
  const std::lock_guard lock(mutex);
  if (device) return device.number();
  Descriptor opened(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (!opened) {
    const int reason = errno;
    return make_error(ErrorKind::internal, not_started(reason).message + " ('/dev/null')");
  }
  device = moved_up(std::move(opened));
  if (!device) return not_started(EMFILE);
  return device.number();
}

// Libraries must not search for files by variables of the user's environment: PROJ_DATA is the
// folder that was found and may be read.
std::vector<std::string> environment_of_loader() {
  std::vector<std::string> out{"HDF5_USE_FILE_LOCKING=FALSE"};
  static const std::string database = cf::projection_database_folder();
  if (!database.empty()) out.push_back("PROJ_DATA=" + database);
  for (const char* name : {"ASAN_OPTIONS", "UBSAN_OPTIONS", "TSAN_OPTIONS", "LSAN_OPTIONS"}) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): no thread sets any
    if (value != nullptr) {
      std::string variable = name;
      variable += '=';
      variable += value;
      out.push_back(std::move(variable));
    }
  }
  return out;
}

int start_loader(const std::string& program, int null, int socket, int life, pid_t& id) {
  std::vector<PassedDescriptor> passed{
      {null, 0}, {null, 1}, {socket, socket_of_loader}, {life, life_of_loader}};
  if (!messages_are_shown) passed.push_back({null, 2});
  return spawn(program, {"windsplat", "load"}, environment_of_loader(), passed, life_of_loader + 1,
               id);
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return "was terminated by signal " + std::to_string(WTERMSIG(status));
  return "ended with code " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

Result<void> Process::start(const std::string& program) {
  end();
  std::array<int, 2> pair{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    return not_started(errno);
  }
  Descriptor ours(pair[0]);
  const Descriptor theirs = moved_up(Descriptor(pair[1]));
  if (::pipe2(pair.data(), O_CLOEXEC) != 0) return not_started(errno);
  const Descriptor life = moved_up(Descriptor(pair[0]));
  Descriptor life_held(pair[1]);
  if (!theirs || !life) return not_started(EMFILE);
  const auto null = null_device();
  if (!null) return null.error();
  pid_t id = -1;
  if (const int fault = start_loader(program, *null, theirs.number(), life.number(), id);
      fault != 0) {
    return not_started(fault);
  }
  const std::lock_guard lock(mutex_);
  id_ = id;
  socket_ = std::move(ours);
  life_ = std::move(life_held);
  return {};
}

void Process::kill() {
  const std::lock_guard lock(mutex_);
  if (id_ > 0) ::kill(id_, SIGKILL);
}

std::string Process::end(std::chrono::milliseconds patience) {
  const std::optional<int> status = reap(patience);
  return status ? how_it_ended(*status) : std::string();
}

std::optional<int> Process::reap(std::chrono::milliseconds patience) noexcept {
  const pid_t id = this->id();
  std::optional<int> ended;
  if (id > 0) {
    // Waits without reaping, so that the process id stays reserved until end().
    siginfo_t about{};
    const auto late = std::chrono::steady_clock::now() + patience;
    while (::waitid(P_PID, static_cast<id_t>(id), &about, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           about.si_pid == 0 && std::chrono::steady_clock::now() < late) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (about.si_pid == 0) kill();
    while (::waitid(P_PID, static_cast<id_t>(id), &about, WEXITED | WNOWAIT) != 0 &&
           errno == EINTR) {
    }
    const std::lock_guard lock(mutex_);
    int status = 0;
    while (::waitpid(id, &status, 0) < 0 && errno == EINTR) {
    }
    ended = status;
    id_ = -1;
  }
  socket_.reset();
  life_.reset();
  return ended;
}

std::chrono::nanoseconds Process::cpu_time() const {
  const pid_t id = this->id();
  clockid_t clock{};
  timespec used{};
  if (id < 0 || ::clock_getcpuclockid(id, &clock) != 0 || ::clock_gettime(clock, &used) != 0) {
    return {};
  }
  return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
}

std::uint64_t Process::private_bytes() const {
  const pid_t id = this->id();
  if (id < 0) return 0;
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "/proc/%d/statm", static_cast<int>(id));
  const Descriptor file(::open(name.data(), O_RDONLY | O_CLOEXEC));
  std::array<char, 128> text{};
  if (!file || ::read(file.number(), text.data(), text.size() - 1) <= 0) return 0;
  char* at = text.data();
  static_cast<void>(std::strtoull(at, &at, 10));  // mapped address space
  const std::uint64_t resident = std::strtoull(at, &at, 10);
  const std::uint64_t shared = std::strtoull(at, &at, 10);
  return (resident - std::min(shared, resident)) * static_cast<std::uint64_t>(::getpagesize());
}

void Process::allow_cpu(std::chrono::seconds more) {
  const pid_t id = this->id();
  if (id < 0) return;
  const auto used = std::chrono::floor<std::chrono::seconds>(cpu_time());
  rlimit bound{};
  if (::prlimit(id, RLIMIT_CPU, nullptr, &bound) != 0) return;
  bound.rlim_cur = std::min<rlim_t>(static_cast<rlim_t>((used + more).count()), bound.rlim_max);
  ::prlimit(id, RLIMIT_CPU, &bound, nullptr);
}

void Process::allow_memory(std::uint64_t bytes) {
  const pid_t id = this->id();
  rlimit bound{};
  // No limit was set under a sanitizer: its shadow memory takes terabytes.
  if (id < 0 || ::prlimit(id, RLIMIT_DATA, nullptr, &bound) != 0 ||
      bound.rlim_max == RLIM_INFINITY) {
    return;
  }
  bound.rlim_cur = std::min<rlim_t>(bytes + room_of_libraries, bound.rlim_max);
  ::prlimit(id, RLIMIT_DATA, &bound, nullptr);
}

bool Process::runs() const {
  const std::lock_guard lock(mutex_);
  siginfo_t about{};
  return id_ > 0 &&
         ::waitid(P_PID, static_cast<id_t>(id_), &about, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         about.si_pid == 0;
}

pid_t Process::id() const {
  const std::lock_guard lock(mutex_);
  return id_;
}

}  // namespace windsplat::data::loader
