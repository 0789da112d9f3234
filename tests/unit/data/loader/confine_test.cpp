// Capabilities of a confined process: a fork of the test drops its privileges and reports the
// outcome of each attempt.
#include "server/data/loader/confine.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {
namespace {

struct Attempt {
  const char* what;
  int expected;  // errno; 0: success
  long (*act)(int file);
};

int own_name(int file, char* out, std::size_t size) {
  return std::snprintf(out, size, "/proc/self/fd/%d", file);
}

const std::vector<Attempt> on_names{
    // Files by name.
    {"open /etc/passwd", EACCES, [](int) -> long { return ::open("/etc/passwd", O_RDONLY); }},
    {"openat", EACCES, [](int) -> long { return ::openat(AT_FDCWD, "x", O_RDONLY); }},
    {"create", EACCES, [](int) -> long { return ::open("/tmp/x", O_RDWR | O_CREAT, 0600); }},
    {"open a folder", EACCES, [](int) -> long { return ::open("/", O_RDONLY | O_DIRECTORY); }},
    {"stat", EACCES,
     [](int) -> long {
       struct stat s {};
       return ::stat("/etc/passwd", &s);
     }},
    {"access", EACCES, [](int) -> long { return ::access("/etc/passwd", R_OK); }},
    {"readlink", EACCES,
     [](int) -> long {
       char out[64];
       return ::readlink("/proc/self/exe", out, sizeof out);
     }},
    {"openat2", EACCES,
     [](int) -> long { return ::syscall(SYS_openat2, AT_FDCWD, "/etc/passwd", nullptr, 0); }},
    {"unlink", EPERM, [](int) -> long { return ::unlink("/tmp/none"); }},
    {"rename", EPERM, [](int) -> long { return ::rename("/tmp/none", "/tmp/other"); }},
    {"mkdir", EPERM, [](int) -> long { return ::mkdir("/tmp/none", 0700); }},
    {"chdir", EPERM, [](int) -> long { return ::chdir("/"); }},
    {"open a pipe again", EACCES,
     [](int) -> long {
       char name[64];
       own_name(1, name, sizeof name);
       return ::open(name, O_RDONLY);
     }},
    {"open the given file for writing", EACCES,
     [](int file) -> long {
       char name[64];
       own_name(file, name, sizeof name);
       return ::open(name, O_RDWR);
     }},
};

const std::vector<Attempt> on_the_given_file{
    // The given file.
    {"open the given file again, from its beginning", 0,
     [](int file) -> long {
       char name[64];
       own_name(file, name, sizeof name);
       ::lseek(file, 3, SEEK_SET);
       const int again = ::open(name, O_RDONLY | O_CLOEXEC);
       char first = 0;
       if (again < 0 || ::read(again, &first, 1) != 1) return -1;
       ::close(again);
       errno = ENOMSG;
       return first == 'f' ? 0 : -1;
     }},
    {"size of the given file", 0,
     [](int file) -> long {
       struct stat s {};
       char name[64];
       own_name(file, name, sizeof name);
       if (::stat(name, &s) != 0 || s.st_size != 5) return -1;
       s.st_size = 0;
       errno = ENOMSG;
       return ::fstat(file, &s) == 0 && s.st_size == 5 ? 0 : -1;
     }},
    {"whether the given file may be read", 0,
     [](int file) -> long {
       char name[64];
       own_name(file, name, sizeof name);
       return ::access(name, R_OK);
     }},
};

// Numbers that are reserved for files in parts. Reads of them are redirected; what is not would
// return the zeros of bytes that were not fetched.
constexpr int first_in_parts = 64;  // as Confinement::files below
constexpr int in_parts = 70;
const std::vector<Attempt> on_a_file_in_parts{
    {"read a file in parts", 0,
     [](int) -> long {
       char text[4] = {};
       ::lseek(in_parts, 1, SEEK_SET);
       if (::read(in_parts, text, 2) != 2 || ::pread(in_parts, text + 2, 1, 0) != 1) return -1;
       errno = ENOMSG;
       return text[2] == 'f' && ::lseek(in_parts, 0, SEEK_CUR) == 3 ? 0 : -1;
     }},
    {"open a file in parts again", 0,
     [](int) -> long {
       char name[64];
       own_name(in_parts, name, sizeof name);
       const int again = ::open(name, O_RDONLY | O_CLOEXEC);
       errno = ENOMSG;
       return again >= first_in_parts ? ::close(again) : -1;
     }},
    {"copy a file in parts out of their numbers", EPERM,
     [](int) -> long { return ::dup(in_parts); }},
    {"copy it with a lowest number", EPERM,
     [](int) -> long { return ::fcntl(in_parts, F_DUPFD_CLOEXEC, 0); }},
    {"map a file in parts", EPERM,
     [](int) -> long {
       return ::mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE, in_parts, 0) == MAP_FAILED ? -1 : 0;
     }},
    {"scatter a file in parts", EPERM,
     [](int) -> long {
       char text[4];
       iovec part{text, sizeof text};
       return ::readv(in_parts, &part, 1);
     }},
    {"scatter a file in parts from an offset", EPERM,
     [](int) -> long {
       char text[4];
       iovec part{text, sizeof text};
       return ::preadv(in_parts, &part, 1, 0);
     }},
    {"scatter a file in parts with flags", EPERM,
     [](int) -> long {
       char text[4];
       iovec part{text, sizeof text};
       return ::preadv2(in_parts, &part, 1, 0, RWF_HIPRI);
     }},
};

const std::vector<Attempt> on_the_world{
    // Network and processes.
    {"socket", EPERM, [](int) -> long { return ::socket(AF_INET, SOCK_STREAM, 0); }},
    {"local socket", EPERM, [](int) -> long { return ::socket(AF_UNIX, SOCK_STREAM, 0); }},
    {"connect", EPERM, [](int) -> long { return ::connect(0, nullptr, 0); }},
    {"execve", EPERM,
     [](int) -> long {
       char name[] = "/bin/true";
       char* words[] = {name, nullptr};
       return ::execve(name, words, words + 1);
     }},
    {"fork", EPERM, [](int) -> long { return ::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }},
    {"clone3", EPERM, [](int) -> long { return ::syscall(SYS_clone3, nullptr, 0); }},
    {"kill the parent", EPERM, [](int) -> long { return ::kill(::getppid(), 0); }},
    {"kill itself", EPERM, [](int) -> long { return ::kill(::getpid(), 0); }},
    {"signal another's thread", EPERM, [](int) -> long { return ::syscall(SYS_tgkill, 1, 1, 0); }},
    {"signal by an owner", EPERM, [](int file) -> long { return ::fcntl(file, F_SETOWN, 1); }},
    {"ptrace", EPERM, [](int) -> long { return ::ptrace(PTRACE_ATTACH, 1, nullptr, nullptr); }},
    {"read another's memory", EPERM,
     [](int) -> long { return ::syscall(SYS_process_vm_readv, 1, nullptr, 0, nullptr, 0, 0); }},
    {"prctl", EPERM, [](int) -> long { return ::prctl(PR_SET_DUMPABLE, 1, 0, 0, 0); }},
    {"raise a limit", EPERM,
     [](int) -> long {
       const rlimit none{RLIM_INFINITY, RLIM_INFINITY};
       return ::setrlimit(RLIMIT_DATA, &none);
     }},
    {"io_uring", EPERM, [](int) -> long { return ::syscall(SYS_io_uring_setup, 1, nullptr); }},
    {"bpf", EPERM, [](int) -> long { return ::syscall(SYS_bpf, 0, nullptr, 0); }},
    {"mount", EPERM, [](int) -> long { return ::syscall(SYS_mount, 0, 0, 0, 0, 0); }},
    {"terminal", ENOTTY, [](int) -> long { return ::isatty(0) == 1 ? 0 : -1; }},
};

const std::vector<Attempt> on_memory{
    // Memory.
    {"private memory", EPERM, [](int) -> long { return ::memfd_create("x", 0); }},
    {"code", EPERM,
     [](int) -> long {
       return ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) ==
                      MAP_FAILED
                  ? -1
                  : 0;
     }},
    {"memory that grows automatically", EPERM,
     [](int) -> long {
       return ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE,
                     MAP_PRIVATE | MAP_ANONYMOUS | MAP_GROWSDOWN, -1, 0) == MAP_FAILED
                  ? -1
                  : 0;
     }},
    {"shared memory without a file", EPERM,
     [](int) -> long {
       return ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0) ==
                      MAP_FAILED
                  ? -1
                  : 0;
     }},
    {"executable data", EPERM,
     [](int) -> long {
       void* page =
           ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
       return page == MAP_FAILED ? 0 : ::mprotect(page, 4096, PROT_READ | PROT_EXEC);
     }},
    {"a little memory", 0,
     [](int) -> long {
       void* block = std::malloc(std::size_t{1} << 20);
       const bool there = block != nullptr;
       std::free(block);
       return there ? 0 : -1;
     }},
};

#ifndef WINDSPLAT_SANITIZED
const std::vector<Attempt> on_much_memory{
    {"more memory than allowed", ENOMEM,
     [](int) -> long {
       return ::mmap(nullptr, std::size_t{1} << 30, PROT_READ | PROT_WRITE,
                     MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED
                  ? -1
                  : 0;
     }},
};
#else
const std::vector<Attempt> on_much_memory;
#endif

std::vector<Attempt> all_attempts() {
  std::vector<Attempt> out;
  for (const auto* some : {&on_names, &on_the_given_file, &on_a_file_in_parts, &on_the_world,
                           &on_memory, &on_much_memory}) {
    out.insert(out.end(), some->begin(), some->end());
  }
  return out;
}
const std::vector<Attempt> attempts = all_attempts();

// Runs all attempts in a confined child process. Returns the errno of each, 0 if it succeeded.
std::vector<int> outcomes(const std::string& path) {
  int ends[2];
  EXPECT_EQ(::pipe(ends), 0);
  const int file = ::open(path.c_str(), O_RDONLY);
  EXPECT_GE(file, 0);
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], 1);
    ::dup2(file, in_parts);
    Confinement how;
    how.memory_bytes = std::uint64_t{256} << 20;
    how.files = first_in_parts;
    if (!confine(how)) ::_exit(2);
    for (const Attempt& attempt : attempts) {
      errno = 0;
      const int fault = attempt.act(file) < 0 ? errno : 0;
      if (::write(1, &fault, sizeof fault) != sizeof fault) ::_exit(3);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  ::close(file);
  std::vector<int> out;
  int fault = 0;
  while (::read(ends[0], &fault, sizeof fault) == sizeof fault) out.push_back(fault);
  ::close(ends[0]);
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  return out;
}

TEST(LoaderConfinement, AllowsOnlyReadingAndComputing) {
  const test::Folder folder;
  const std::string path = folder / "given";
  std::ofstream(path) << "first";
  const std::vector<int> found = outcomes(path);
  ASSERT_EQ(found.size(), attempts.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i], attempts[i].expected) << attempts[i].what;
  }
}

#ifdef __x86_64__
// No rule covers the call numbers of x32.
TEST(LoaderConfinement, SystemCallOfAnotherAbiTerminatesTheProcess) {
  constexpr long x32 = 0x40000000;
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    Confinement how;
    how.memory_bytes = std::uint64_t{256} << 20;
    how.files = 64;
    if (!confine(how)) ::_exit(2);
    ::syscall(x32 | SYS_getpid);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status)) << status;
  EXPECT_EQ(WTERMSIG(status), SIGSYS);
}
#endif

}  // namespace
}  // namespace windsplat::data::loader
