// Limits, no capabilities, then Landlock where the kernel has it, then a list of the system calls
// that are left.
#include "server/data/loader/confine.hpp"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <system_error>
#include <utility>

#include "server/data/loader/by_name.hpp"

namespace windsplat::data::loader {

namespace {

#if defined(__x86_64__)
constexpr std::uint32_t this_machine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t this_machine = AUDIT_ARCH_AARCH64;
#endif

#ifdef WINDSPLAT_SANITIZED
constexpr bool memory_is_shadowed = true;  // terabytes of it, which count as taken
#else
constexpr bool memory_is_shadowed = false;
#endif

Error not_confined(const char* by) {
  return make_error(ErrorKind::internal, std::string("a loader cannot be confined by ") + by +
                                             ": " + std::generic_category().message(errno));
}

bool limit(__rlimit_resource which, std::uint64_t most, std::uint64_t at_first) {
  rlimit now{};
  if (::getrlimit(which, &now) != 0) return false;
  const rlim_t bound = std::min<rlim_t>(most, now.rlim_max);
  const rlimit wanted{std::min<rlim_t>(at_first, bound), bound};
  return ::setrlimit(which, &wanted) == 0;
}
bool limit(__rlimit_resource which, std::uint64_t most) { return limit(which, most, most); }

Result<void> set_limits(const Confinement& how) {
  // Private memory; what is shared is given by the daemon and bounded there.
  const bool memory = memory_is_shadowed ||
                      limit(RLIMIT_DATA, how.memory_bytes + room_of_libraries,
                            std::min(how.opening_bytes, how.memory_bytes) + room_of_libraries);
  if (!memory || !limit(RLIMIT_NOFILE, how.files) || !limit(RLIMIT_FSIZE, 0) ||
      !limit(RLIMIT_CORE, 0) || !limit(RLIMIT_NPROC, 0)) {
    return not_confined("limits");
  }
  return {};
}

// Started as root a loader would keep root's privileges. The bounding set can only be emptied by
// who may (CAP_SETPCAP); for others nothing is left that it could bring back, with no_new_privs
// set.
Result<void> drop_capabilities() {
  for (unsigned long capability = 0; ::prctl(PR_CAPBSET_READ, capability, 0, 0, 0) >= 0;
       ++capability) {
    if (::prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) != 0 && errno != EPERM) {
      return not_confined("capabilities");
    }
  }
  if (::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0) != 0 && errno != EINVAL) {
    return not_confined("capabilities");
  }
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> held{};
  if (::syscall(SYS_capget, &header, held.data()) != 0) return not_confined("capabilities");
  const bool holds_any = std::any_of(held.begin(), held.end(), [](const auto& set) {
    return (set.effective | set.permitted | set.inheritable) != 0;
  });
  if (!holds_any) return {};  // a service manager's filter may refuse capset
  held = {};
  if (::syscall(SYS_capset, &header, held.data()) != 0) return not_confined("capabilities");
  return {};
}

// No rule at all: no file may be reached by name. A kernel without it leaves that to the filter.
void forbid_paths() {
#ifdef SYS_landlock_create_ruleset
  const long version =
      ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return;
  landlock_ruleset_attr rules{};
  rules.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1U) - 1;  // what version 1 knows
  const long set = ::syscall(SYS_landlock_create_ruleset, &rules, sizeof rules, 0);
  if (set < 0) return;
  ::syscall(SYS_landlock_restrict_self, static_cast<int>(set), 0);
  ::close(static_cast<int>(set));
#endif
}

// The filter, instruction by instruction. The number of the call is in the accumulator until a rule
// for that call loads something else; every such rule ends in returns.
class Filter {
 public:
  Filter() {
    load(offsetof(seccomp_data, arch));
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, this_machine, 1, 0));
    answer(SECCOMP_RET_KILL_PROCESS);
    load(offsetof(seccomp_data, nr));
  }

  void allow(int call) { on(call, SECCOMP_RET_ALLOW); }
  void refuse(int call, int with) { on(call, SECCOMP_RET_ERRNO | static_cast<unsigned>(with)); }
  void hand_over(int call) { on(call, SECCOMP_RET_TRAP); }

  // Unless all bits of `mask` that an argument has make up `value`.
  void allow_unless_masked(int call, unsigned argument, std::uint32_t mask, std::uint32_t value) {
    skip_unless(call, 5);
    load(offset_of(argument));
    code_.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, mask));
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1));
    answer(SECCOMP_RET_ERRNO | EPERM);
    answer(SECCOMP_RET_ALLOW);
  }

  // A mapping: never code, and no memory that no limit counts: what is shared without a file, and
  // what grows by itself.
  void allow_mappings() {
    skip_unless(SYS_mmap, 8);
    load(offset_of(2));
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, PROT_EXEC, 5, 0));
    load(offset_of(3));
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, MAP_GROWSDOWN, 3, 0));
    code_.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, MAP_SHARED | MAP_ANONYMOUS));
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, MAP_SHARED | MAP_ANONYMOUS, 1, 0));
    answer(SECCOMP_RET_ALLOW);
    answer(SECCOMP_RET_ERRNO | EPERM);
  }

  void allow_if_any(int call, unsigned argument, const std::vector<std::uint32_t>& values) {
    skip_unless(call, static_cast<unsigned>(2 + 2 * values.size()));
    load(offset_of(argument));
    for (const std::uint32_t value : values) {
      code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1));
      answer(SECCOMP_RET_ALLOW);
    }
    answer(SECCOMP_RET_ERRNO | EPERM);
  }

  bool install() {
    answer(SECCOMP_RET_ERRNO | EPERM);
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program) ==
           0;
  }

 private:
  static unsigned offset_of(unsigned argument) {  // its lower half, on a little-endian machine
    return static_cast<unsigned>(offsetof(seccomp_data, args) + argument * sizeof(std::uint64_t));
  }
  void load(std::size_t offset) {
    code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offset)));
  }
  void answer(unsigned what) { code_.push_back(BPF_STMT(BPF_RET | BPF_K, what)); }
  void skip_unless(int call, unsigned instructions) {
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(call), 0,
                             static_cast<unsigned char>(instructions)));
  }
  void on(int call, unsigned what) {
    skip_unless(call, 1);
    answer(what);
  }

  std::vector<sock_filter> code_;
};

bool forbid_calls() {
  Filter filter;
  for (const int call :
       {SYS_read, SYS_pread64, SYS_readv, SYS_preadv, SYS_lseek, SYS_fstat, SYS_munmap, SYS_mremap,
        SYS_brk, SYS_madvise, SYS_futex, SYS_clock_gettime, SYS_clock_nanosleep, SYS_nanosleep,
        SYS_gettimeofday, SYS_getrandom, SYS_rt_sigaction, SYS_rt_sigprocmask, SYS_rt_sigreturn,
        SYS_sigaltstack, SYS_restart_syscall, SYS_exit, SYS_exit_group,
#ifdef WINDSPLAT_SANITIZED
        // By a pipe the sanitizers find out whether memory can be read.
        SYS_pipe2,
#ifdef SYS_pipe
        SYS_pipe,
#endif
#endif
        SYS_sendmsg, SYS_recvmsg, SYS_ppoll, SYS_write, SYS_writev, SYS_close, SYS_dup, SYS_getpid,
        SYS_gettid, SYS_sched_yield, SYS_sched_getaffinity, SYS_sysinfo, SYS_getrusage,
        SYS_fadvise64,
#ifdef __x86_64__
        SYS_poll, SYS_time
#endif
       }) {
    filter.allow(call);
  }
  for (const int call : calls_by_name()) filter.hand_over(call);
  filter.allow_mappings();
  filter.allow_unless_masked(SYS_mprotect, 2, PROT_EXEC, PROT_EXEC);
  filter.allow_if_any(SYS_fcntl, 1, {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL});
  // What abort() sends to itself.
  filter.allow_if_any(SYS_tgkill, 0, {static_cast<std::uint32_t>(::getpid())});
  filter.refuse(SYS_ioctl, ENOTTY);
  filter.refuse(SYS_flock, ENOSYS);
  return filter.install();
}

}  // namespace

Result<void> confine(Confinement how) {
  if (auto done = answer_calls_by_name(how.socket, std::move(how.library_folders)); !done) {
    return done;
  }
  if (auto done = set_limits(how); !done) return done;
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return not_confined("privileges");
  if (auto done = drop_capabilities(); !done) return done;
  forbid_paths();
  if (!forbid_calls()) return not_confined("seccomp");
  return {};
}

}  // namespace windsplat::data::loader
