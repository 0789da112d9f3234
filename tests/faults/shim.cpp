// Preloaded into a program: makes chosen calls of system libraries fail, as directed by a page of
// memory shared with the test (tests/faults/shim.py): the n-th call, or the first from a place in
// the program that has not failed before. Calls of the dynamic loader itself never fail, nor does
// any call before main.
#include <dlfcn.h>
#include <elf.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(size_t bytes);
void* __libc_calloc(size_t count, size_t bytes);
void* __libc_realloc(void* old, size_t bytes);
void* __libc_memalign(size_t alignment, size_t bytes);
}

namespace {

// The order is that of shim.py.
enum Kind {
  k_malloc,
  k_send,
  k_recv,
  k_read,
  k_write,
  k_fsync,
  k_open,
  k_accept,
  k_socket,
  k_thread,
  k_mmap,
  k_random,
  k_count
};

struct Counter {
  std::atomic<std::int64_t> at;     // the number of calls until one fails: 1 is the next; 0: none
  std::atomic<std::int64_t> times;  // number of consecutive calls that fail; with sites: number of
                                    // places
  std::atomic<std::int64_t> sites;  // nonzero: only calls from places that have not failed yet
  std::atomic<std::int64_t> fault;  // the errno
  std::atomic<std::int64_t> seen;
  std::atomic<std::int64_t> failed;
  std::atomic<std::int64_t> known;  // places that have failed
  std::atomic<std::int64_t> depth;  // number of stack frames that identify a place
};

constexpr std::size_t sites_max = 1 << 16;

struct Control {
  std::atomic<std::int64_t> process;     // process that uses the page; 0: none yet
  std::atomic<std::int64_t> clock_jump;  // seconds added to the time of day
  std::array<Counter, k_count> kinds;
  std::array<std::atomic<std::uint64_t>, sites_max> sites;  // places of all kinds, by hash
};

Control* control = nullptr;
bool begun = false;  // main has started: failures of library initialisation cannot be handled
std::uintptr_t loader_begin = 0;
std::uintptr_t loader_end = 0;
__attribute__((tls_model("initial-exec"))) thread_local bool inside = false;

int note_loader(dl_phdr_info* module, std::size_t /*size*/, void* /*data*/) {
  if (std::strstr(module->dlpi_name, "ld-linux") == nullptr) return 0;
  for (int i = 0; i < module->dlpi_phnum; ++i) {
    const ElfW(Phdr)& part = module->dlpi_phdr[i];
    if (part.p_type != PT_LOAD) continue;
    const std::uintptr_t begin = module->dlpi_addr + part.p_vaddr;
    if (loader_begin == 0 || begin < loader_begin) loader_begin = begin;
    if (begin + part.p_memsz > loader_end) loader_end = begin + part.p_memsz;
  }
  return 1;
}

__attribute__((constructor)) void start() {
  const char* path = std::getenv("FAULTS_CONTROL");
  if (path == nullptr) return;
  const int file = ::open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* page = ::mmap(nullptr, sizeof(Control), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  if (page == MAP_FAILED) return;
  dl_iterate_phdr(note_loader, nullptr);
  std::array<void*, 4> frames{};
  backtrace(frames.data(), frames.size());  // loads what it needs at its first call
  auto* mapped = static_cast<Control*>(page);
  std::int64_t nobody = 0;
  // Applies to the first process only, not to its children.
  if (mapped->process.compare_exchange_strong(nobody, ::getpid())) control = mapped;
}

// True the first time that this call site, given by the addresses of the innermost callers, is
// seen.
bool is_new_site(Kind kind, Counter& counter) {
  constexpr int frames_max = 24;
  constexpr int own_frames = 3;
  std::array<void*, frames_max> frames{};
  const int wanted = own_frames + static_cast<int>(counter.depth.load());
  const int count = backtrace(frames.data(), wanted < frames_max ? wanted : frames_max);
  std::uint64_t hash = 14695981039346656037ULL + static_cast<std::uint64_t>(kind);
  for (int i = own_frames; i < count; ++i) {
    hash = (hash ^ reinterpret_cast<std::uintptr_t>(frames[static_cast<std::size_t>(i)])) *
           1099511628211ULL;
  }
  if (hash == 0) hash = 1;
  for (std::size_t i = 0; i < sites_max; ++i) {
    auto& place = control->sites[(hash + i) % sites_max];
    std::uint64_t held = place.load();
    if (held == hash) return false;
    if (held == 0 && place.compare_exchange_strong(held, hash)) {
      counter.known.fetch_add(1);
      return true;
    }
    if (held == hash) return false;
  }
  return false;
}

// FAULTS_TELL=1: logs the failing call by program addresses, for addr2line.
void tell_stack() {
  std::array<void*, 32> frames{};
  inside = true;
  backtrace_symbols_fd(frames.data(), backtrace(frames.data(), frames.size()), STDERR_FILENO);
  inside = false;
}

// Whether this call must fail; errno is then set.
bool fails(Kind kind, const void* caller) {
  if (!begun || control == nullptr || inside) return false;
  Counter& counter = control->kinds[kind];
  const auto from = reinterpret_cast<std::uintptr_t>(caller);
  if (from >= loader_begin && from < loader_end) return false;
  const std::int64_t number = counter.seen.fetch_add(1) + 1;
  bool chosen = false;
  if (counter.sites.load() != 0) {
    if (counter.failed.load() >= counter.times.load()) return false;
    inside = true;
    chosen = is_new_site(kind, counter);
    inside = false;
  } else if (const std::int64_t at = counter.at.load(); at > 0) {
    chosen = number >= at && number < at + counter.times.load();
  }
  if (!chosen) return false;
  counter.failed.fetch_add(1);
  static const bool tell = std::getenv("FAULTS_TELL") != nullptr;
  if (tell) tell_stack();
  errno = static_cast<int>(counter.fault.load());
  return true;
}

using Main = int(int, char**, char**);
Main* program_main = nullptr;

int main_begins(int count, char** words, char** variables) {
  begun = true;
  return program_main(count, words, variables);
}

template <class Function>
Function* next(const char* name) {
  inside = true;
  auto* found = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
  inside = false;
  return found;
}

// Disks and peers fail; events and signals, which are also read and written, do not.
bool is_file(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && (S_ISREG(status.st_mode) || S_ISSOCK(status.st_mode));
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): the names are those of the system
#define FAIL(kind, value) \
  if (fails(kind, __builtin_return_address(0))) return value
#define NEXT(name) static auto* const real = next<decltype(name)>(#name)

extern "C" {

void* malloc(size_t bytes) noexcept {
  FAIL(k_malloc, nullptr);
  return __libc_malloc(bytes);
}

void* calloc(size_t count, size_t bytes) noexcept {
  FAIL(k_malloc, nullptr);
  return __libc_calloc(count, bytes);
}

void* realloc(void* old, size_t bytes) noexcept {
  FAIL(k_malloc, nullptr);
  return __libc_realloc(old, bytes);
}

void* aligned_alloc(size_t alignment, size_t bytes) noexcept {
  FAIL(k_malloc, nullptr);
  return __libc_memalign(alignment, bytes);
}

void* memalign(size_t alignment, size_t bytes) noexcept {
  FAIL(k_malloc, nullptr);
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void** out, size_t alignment, size_t bytes) noexcept {
  FAIL(k_malloc, ENOMEM);
  *out = __libc_memalign(alignment, bytes);
  return *out == nullptr ? ENOMEM : 0;
}

ssize_t send(int socket, const void* data, size_t bytes, int flags) {
  NEXT(send);
  FAIL(k_send, -1);
  return real(socket, data, bytes, flags);
}

ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  NEXT(sendmsg);
  FAIL(k_send, -1);
  return real(socket, message, flags);
}

ssize_t recv(int socket, void* data, size_t bytes, int flags) {
  NEXT(recv);
  FAIL(k_recv, -1);
  return real(socket, data, bytes, flags);
}

ssize_t recvmsg(int socket, msghdr* message, int flags) {
  NEXT(recvmsg);
  FAIL(k_recv, -1);
  return real(socket, message, flags);
}

ssize_t read(int file, void* data, size_t bytes) {
  NEXT(read);
  if (is_file(file)) FAIL(k_read, -1);
  return real(file, data, bytes);
}

ssize_t pread(int file, void* data, size_t bytes, off_t at) {
  NEXT(pread);
  FAIL(k_read, -1);
  return real(file, data, bytes, at);
}

size_t fread(void* data, size_t size, size_t count, FILE* stream) {
  NEXT(fread);
  if (fails(k_read, __builtin_return_address(0))) {
    constexpr int error_seen = 0x20;  // the error flag of glibc that ferror() returns
    stream->_flags |= error_seen;
    return 0;
  }
  return real(data, size, count, stream);
}

ssize_t write(int file, const void* data, size_t bytes) {
  NEXT(write);
  if (is_file(file)) FAIL(k_write, -1);
  return real(file, data, bytes);
}

int fsync(int file) {
  NEXT(fsync);
  FAIL(k_fsync, -1);
  return real(file);
}

int open(const char* path, int flags, ...) {
  NEXT(open);
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  FAIL(k_open, -1);
  return real(path, flags, mode);
}

FILE* fopen(const char* path, const char* mode) {
  NEXT(fopen);
  FAIL(k_open, nullptr);
  return real(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  NEXT(fopen64);
  FAIL(k_open, nullptr);
  return real(path, mode);
}

ssize_t writev(int file, const iovec* parts, int count) {
  NEXT(writev);
  if (is_file(file)) FAIL(k_write, -1);
  return real(file, parts, count);
}

int rename(const char* from, const char* to) noexcept {
  NEXT(rename);
  FAIL(k_write, -1);
  return real(from, to);
}

int accept4(int socket, sockaddr* address, socklen_t* length, int flags) {
  NEXT(accept4);
  FAIL(k_accept, -1);
  return real(socket, address, length, flags);
}

int accept(int socket, sockaddr* address, socklen_t* length) {
  NEXT(accept);
  FAIL(k_accept, -1);
  return real(socket, address, length);
}

int socket(int domain, int type, int protocol) noexcept {
  NEXT(socket);
  FAIL(k_socket, -1);
  return real(domain, type, protocol);
}

int socketpair(int domain, int type, int protocol, int* pair) noexcept {
  NEXT(socketpair);
  FAIL(k_socket, -1);
  return real(domain, type, protocol, pair);
}

int pipe2(int* pair, int flags) noexcept {
  NEXT(pipe2);
  FAIL(k_socket, -1);
  return real(pair, flags);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                   void* argument) noexcept {
  NEXT(pthread_create);
  FAIL(k_thread, EAGAIN);
  return real(thread, attributes, body, argument);
}

void* mmap(void* where, size_t bytes, int access, int flags, int file, off_t at) noexcept {
  NEXT(mmap);
  FAIL(k_mmap, MAP_FAILED);
  return real(where, bytes, access, flags, file, at);
}

ssize_t getrandom(void* data, size_t bytes, unsigned flags) {
  NEXT(getrandom);
  FAIL(k_random, -1);
  return real(data, bytes, flags);
}

int __libc_start_main(Main* main, int count, char** words, void (*first)(), void (*last)(),
                      void (*loader_last)(), void* stack) {
  NEXT(__libc_start_main);
  program_main = main;
  return real(main_begins, count, words, first, last, loader_last, stack);
}

// Logs the place of an abort by program addresses, for addr2line.
void abort() noexcept {
  NEXT(abort);
  tell_stack();
  real();
  _exit(1);
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  NEXT(clock_gettime);
  const int result = real(clock, time);
  if (clock == CLOCK_REALTIME && control != nullptr) time->tv_sec += control->clock_jump.load();
  return result;
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
