// Runs work in a fork and returns its coverage counters to the parent; the sanitizer report shows
// whether a library caused a crash.
#include "tests/fuzz/support/apart.hpp"

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "tests/fuzz/support/check.hpp"

// The sections that contain the compiler's coverage counters.
extern "C" std::uint8_t __start___sancov_cntrs[];
extern "C" std::uint8_t __stop___sancov_cntrs[];
extern "C" void __sanitizer_set_death_callback(void (*callback)());

// An assertion of a library is treated as a crash: it prints a stack.
extern "C" const char* __asan_default_options() {
  return "handle_abort=2:allocator_may_return_null=1:max_allocation_size_mb=2048";
}

namespace fuzz {
namespace {

constexpr int calm_end = 0;
constexpr std::array<std::string_view, 8> libraries{"/libnetcdf", "/libhdf5", "/libeccodes",
                                                    "/libaec",    "/libsz",   "/libopenjp2",
                                                    "/libjasper", "/libcurl"};
constexpr std::array<std::string_view, 4> passed_over{"/libc.so", "/libm.so", "/libc-",
                                                      "/ld-linux"};

struct Counts {
  std::uint64_t runs = 0;
  std::uint64_t library_faults = 0;
  std::uint64_t late = 0;
};

Counts& counts() {
  static Counts all;
  return all;
}

void tell_counts() {
  std::fprintf(stderr, "apart: %llu runs, %llu ended by a crash in a library, %llu timed out\n",
               static_cast<unsigned long long>(counts().runs),
               static_cast<unsigned long long>(counts().library_faults),
               static_cast<unsigned long long>(counts().late));
}

// The first frame of the report outside the sanitizer, the C library and `abort`.
bool is_library_fault(std::string_view report) {
  std::size_t at = report.find("    #0 ");
  while (at != std::string_view::npos) {
    const std::string_view line = report.substr(at, report.find('\n', at) - at);
    const auto names = [line](std::string_view name) {
      return line.find(name) != std::string_view::npos;
    };
    if (std::any_of(libraries.begin(), libraries.end(), names)) return true;
    const bool next = std::any_of(passed_over.begin(), passed_over.end(), names) ||
                      names("__interceptor_") || names("__asan_") || names("__sanitizer") ||
                      names("asan_interceptors");
    if (!next) return false;
    at = report.find("    #", at + 1);
  }
  return false;
}

std::string read_all(int descriptor) {
  std::string out;
  std::array<char, 4096> part{};
  for (;;) {
    const ssize_t got = ::read(descriptor, part.data(), part.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return out;
    out.append(part.data(), static_cast<std::size_t>(got));
  }
}

}  // namespace

void apart(const std::function<void()>& work, unsigned seconds) {
  static const std::size_t bytes =
      static_cast<std::size_t>(__stop___sancov_cntrs - __start___sancov_cntrs);
  static void* const shared = [] {
    std::atexit(tell_counts);
    return ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  }();
  expect(shared != MAP_FAILED, "memory to share");
  std::array<int, 2> report{-1, -1};
  expect(::pipe(report.data()) == 0, "a pipe");
  std::memcpy(shared, __start___sancov_cntrs, bytes);
  const pid_t child = ::fork();
  expect(child >= 0, "a process");
  if (child == 0) {
    __sanitizer_set_death_callback(nullptr);  // the parent keeps the input
    ::dup2(report[1], 2);
    ::signal(SIGALRM, SIG_DFL);
    ::alarm(seconds);
    work();
    std::memcpy(shared, __start___sancov_cntrs, bytes);
    ::_exit(calm_end);
  }
  ::close(report[1]);
  const std::string told = read_all(report[0]);
  ::close(report[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::memcpy(__start___sancov_cntrs, shared, bytes);
  ++counts().runs;
  if (WIFEXITED(status) && WEXITSTATUS(status) == calm_end) return;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    ++counts().late;
  } else if (is_library_fault(told)) {
    ++counts().library_faults;
  } else {
    std::fwrite(told.data(), 1, told.size(), stderr);
    expect(false, "a child process must end normally", "status " + std::to_string(status));
  }
}

}  // namespace fuzz
