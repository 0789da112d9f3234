// Sets resource limits, drops all capabilities, then applies Landlock if the kernel has it, and a
// filter of system calls.
#include "server/data/loader/confine.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <initializer_list>
#include <memory>
#include <system_error>
#include <utility>

#include "server/data/loader/by_name.hpp"
#include "server/data/loader/by_parts.hpp"

namespace windsplat::data::loader {

namespace {

#ifdef WINDSPLAT_SANITIZED
constexpr bool memory_is_shadowed = true;  // The sanitizer's shadow memory takes terabytes of
                                           // address space, which count as used.
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
  // Private memory only; shared memory is provided and limited by the daemon.
  const bool memory = memory_is_shadowed ||
                      limit(RLIMIT_DATA, how.memory_bytes + room_of_libraries,
                            std::min(how.opening_bytes, how.memory_bytes) + room_of_libraries);
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return not_confined("limits");
  const std::uint64_t half = std::min<std::uint64_t>(how.files, files.rlim_max / 2);
  reserve_parts(static_cast<int>(half), static_cast<int>(2 * half), how.socket);
  if (!memory || !limit(RLIMIT_NOFILE, 2 * half) || !limit(RLIMIT_FSIZE, 0) ||
      !limit(RLIMIT_CORE, 0) || !limit(RLIMIT_NPROC, 0)) {
    return not_confined("limits");
  }
  return {};
}

// A loader started as root would keep root's privileges. Only a process with CAP_SETPCAP can empty
// the bounding set; without it, the set has no effect, because no_new_privs is set.
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
  if (!holds_any) return {};  // the filter of a service manager may reject capset
  held = {};
  if (::syscall(SYS_capset, &header, held.data()) != 0) return not_confined("capabilities");
  return {};
}

// An empty Landlock ruleset: no file can be opened by name. Without Landlock, the filter does this.
void forbid_paths() {
#ifdef SYS_landlock_create_ruleset
  const long version =
      ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return;
  landlock_ruleset_attr rules{};
  rules.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1U) - 1;  // access rights of version 1
  const long set = ::syscall(SYS_landlock_create_ruleset, &rules, sizeof rules, 0);
  if (set < 0) return;
  ::syscall(SYS_landlock_restrict_self, static_cast<int>(set), 0);
  ::close(static_cast<int>(set));
#endif
}

struct ReleaseFilter {
  void operator()(void* filter) const { seccomp_release(filter); }
};

// Adds rules to a filter until one fails.
class Filter {
 public:
  Filter() : filter_(seccomp_init(SCMP_ACT_ERRNO(EPERM))), fault_(filter_ ? 0 : -ENOMEM) {
    set(SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
    set(SCMP_FLTATR_CTL_TSYNC, 1);
    set(SCMP_FLTATR_API_SYSRAWRC, 1);  // report the errno of the kernel instead of ECANCELED
  }

  // Adds a rule that applies if all conditions hold. A call that this architecture lacks has a
  // number that no kernel uses.
  void add(std::uint32_t action, int call, std::initializer_list<scmp_arg_cmp> conditions = {}) {
    if (fault_ != 0) return;
    fault_ = seccomp_rule_add_array(filter_.get(), action, call,
                                    static_cast<unsigned>(conditions.size()), conditions.begin());
  }
  // 0 or a negative errno.
  int install() { return fault_ != 0 ? fault_ : seccomp_load(filter_.get()); }

 private:
  void set(scmp_filter_attr which, std::uint32_t value) {
    if (fault_ == 0) fault_ = seccomp_attr_set(filter_.get(), which, value);
  }

  std::unique_ptr<void, ReleaseFilter> filter_;
  int fault_;
};

scmp_arg_cmp has_bits(unsigned argument, scmp_datum_t mask, scmp_datum_t value) {
  return {argument, SCMP_CMP_MASKED_EQ, mask, value};
}
// Compares an int argument: the kernel ignores the upper half of the register, which callers need
// not clear.
scmp_arg_cmp equals(unsigned argument, int value) {
  return has_bits(argument, 0xffffffff, static_cast<std::uint32_t>(value));
}

// 0 or a negative errno.
int forbid_calls() {
  Filter filter;
  for (const int call :
       {SCMP_SYS(lseek), SCMP_SYS(fstat), SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(brk),
        SCMP_SYS(madvise), SCMP_SYS(futex), SCMP_SYS(clock_gettime), SCMP_SYS(clock_nanosleep),
        SCMP_SYS(nanosleep), SCMP_SYS(gettimeofday), SCMP_SYS(getrandom), SCMP_SYS(rt_sigaction),
        SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn), SCMP_SYS(sigaltstack),
        SCMP_SYS(restart_syscall), SCMP_SYS(exit), SCMP_SYS(exit_group),
#ifdef WINDSPLAT_SANITIZED
        // Sanitizers probe through a pipe whether memory can be read.
        SCMP_SYS(pipe2), SCMP_SYS(pipe),
#endif
        SCMP_SYS(sendmsg), SCMP_SYS(recvmsg), SCMP_SYS(ppoll), SCMP_SYS(poll), SCMP_SYS(write),
        SCMP_SYS(writev), SCMP_SYS(close), SCMP_SYS(getpid), SCMP_SYS(gettid),
        SCMP_SYS(sched_yield), SCMP_SYS(sched_getaffinity), SCMP_SYS(sysinfo), SCMP_SYS(getrusage),
        SCMP_SYS(fadvise64), SCMP_SYS(time)}) {
    filter.add(SCMP_ACT_ALLOW, call);
  }
  for (const int call : calls_by_name()) filter.add(SCMP_ACT_TRAP, call);
  // Bytes of files in parts may have to be fetched first; what is not redirected would read zeros.
  // An argument with garbage in its upper half is redirected, and read like any other.
  const auto parts = static_cast<scmp_datum_t>(first_of_parts());
  const scmp_arg_cmp is_whole{0, SCMP_CMP_LT, parts, 0};
  const scmp_arg_cmp is_in_parts{0, SCMP_CMP_GE, parts, 0};
  for (const int call : {SCMP_SYS(read), SCMP_SYS(pread64)}) {
    filter.add(SCMP_ACT_ALLOW, call, {is_whole});
    filter.add(SCMP_ACT_TRAP, call, {is_in_parts});
  }
  for (const int call : {SCMP_SYS(readv), SCMP_SYS(preadv), SCMP_SYS(dup)}) {
    filter.add(SCMP_ACT_ALLOW, call, {is_whole});
  }
  filter.add(SCMP_ACT_ALLOW, SCMP_SYS(preadv2), {{4, SCMP_CMP_EQ, mark_of_own_reads, 0}});
  // Mappings must not be executable, nor escape the memory limit: neither shared and anonymous nor
  // growing automatically.
  constexpr int kinds = MAP_SHARED | MAP_ANONYMOUS | MAP_GROWSDOWN;
  for (const int kind : {0, MAP_SHARED}) {
    filter.add(SCMP_ACT_ALLOW, SCMP_SYS(mmap),
               {has_bits(2, PROT_EXEC, 0), has_bits(3, kinds, kind), {4, SCMP_CMP_LT, parts, 0}});
  }
  filter.add(SCMP_ACT_ALLOW, SCMP_SYS(mmap),
             {has_bits(2, PROT_EXEC, 0), has_bits(3, kinds, MAP_ANONYMOUS)});
  filter.add(SCMP_ACT_ALLOW, SCMP_SYS(mprotect), {has_bits(2, PROT_EXEC, 0)});
  for (const int command : {F_GETFD, F_SETFD, F_GETFL}) {
    filter.add(SCMP_ACT_ALLOW, SCMP_SYS(fcntl), {equals(1, command)});
  }
  for (const int command : {F_DUPFD, F_DUPFD_CLOEXEC}) {
    filter.add(SCMP_ACT_ALLOW, SCMP_SYS(fcntl), {is_whole, equals(1, command)});
    filter.add(SCMP_ACT_ALLOW, SCMP_SYS(fcntl),
               {is_in_parts, equals(1, command), {2, SCMP_CMP_GE, parts, 0}});
  }
  // Signals that abort() sends to its own process.
  filter.add(SCMP_ACT_ALLOW, SCMP_SYS(tgkill), {equals(0, ::getpid())});
  filter.add(SCMP_ACT_ERRNO(ENOTTY), SCMP_SYS(ioctl));
  filter.add(SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(flock));
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
  if (const int fault = forbid_calls(); fault != 0) {
    errno = -fault;
    return not_confined("seccomp");
  }
  return {};
}

}  // namespace windsplat::data::loader
