// The handler of SIGSYS calls these functions: no memory is allocated and no lock is taken.
#include "server/data/loader/by_parts.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <vector>

#include "server/data/files/files.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/window.hpp"

namespace windsplat::data::loader {

namespace {

// One descriptor of a file in parts.
struct OpenParts {
  std::uint64_t number = 0;  // 0: the file is whole
  Extent present;            // known to be
};

struct Table {
  int first = std::numeric_limits<int>::max();
  int socket = -1;
  std::vector<OpenParts> open;  // by number of the descriptor from `first` on
};

// A signal handler has no context argument.
Table& table() {
  static Table the_one;
  return the_one;
}

OpenParts* parts_of(int descriptor) {
  Table& all = table();
  if (descriptor < all.first) return nullptr;
  const auto at = static_cast<std::size_t>(descriptor - all.first);
  return at < all.open.size() && all.open[at].number != 0 ? &all.open[at] : nullptr;
}

// Has the daemon fetch what is missing. False: it could not.
bool ensure(OpenParts& parts, std::uint64_t offset, std::uint64_t count) {
  if (count == 0 || (offset >= parts.present.begin && offset <= parts.present.end &&
                     count <= parts.present.end - offset)) {
    return true;
  }
  const std::array<std::uint64_t, 3> question{parts.number, offset, count};
  std::array<char, sizeof question> payload{};
  std::memcpy(payload.data(), question.data(), payload.size());
  const int socket = table().socket;
  if (send_message(socket, Kind::ask_bytes, payload.data(), payload.size(), -1, {}) != Fate::done) {
    ::_exit(1);
  }
  Frame frame;
  do {
    if (receive_bytes(socket, reinterpret_cast<char*>(&frame), sizeof frame, nullptr, {}) !=
        Fate::done) {
      ::_exit(1);
    }
  } while (is_of_window(frame));
  if (frame.kind == static_cast<std::uint32_t>(Kind::no) && frame.bytes == 0) return false;
  std::array<std::uint64_t, 2> extent{};
  if (frame.kind != static_cast<std::uint32_t>(Kind::extent) || frame.bytes != sizeof extent ||
      receive_bytes(socket, reinterpret_cast<char*>(extent.data()), sizeof extent, nullptr, {}) !=
          Fate::done) {
    ::_exit(1);  // the channel to the daemon is out of sync
  }
  parts.present = {extent[0], extent[1]};
  return true;
}

// Bytes from an offset that the file has, `count` at most. Negative: an errno.
long bytes_from(int descriptor, off_t offset, std::size_t count) {
  struct stat status {};
  if (::syscall(SYS_fstat, descriptor, &status) != 0) return -errno;
  if (offset < 0) return -EINVAL;
  const off_t left = std::max<off_t>(0, status.st_size - offset);
  return static_cast<long>(std::min<std::uint64_t>(count, static_cast<std::uint64_t>(left)));
}

static_assert(sizeof(long) == sizeof(off_t), "the mark would be the upper half of the offset");

// The call itself, under a number that is not redirected; offset -1: at the position of the file.
long read_now(int descriptor, void* out, std::size_t count, off_t offset) {
  iovec part{out, count};
  const long got = ::syscall(SYS_preadv2, descriptor, &part, 1UL, static_cast<long>(offset),
                             mark_of_own_reads, 0);
  return got < 0 ? -errno : got;
}

long read_at(int descriptor, void* out, std::size_t count, off_t from, off_t offset) {
  OpenParts* const parts = parts_of(descriptor);
  if (parts == nullptr) return read_now(descriptor, out, count, offset);
  const long there = bytes_from(descriptor, from, count);
  if (there < 0) return there;
  const auto wanted = static_cast<std::size_t>(there);
  if (!ensure(*parts, static_cast<std::uint64_t>(from), wanted)) return -EIO;
  return read_now(descriptor, out, wanted, offset);
}

}  // namespace

int first_of_parts() { return table().first; }

void reserve_parts(int first, int end, int socket) {
  table() = {first, socket, std::vector<OpenParts>(static_cast<std::size_t>(end - first))};
}

int place(int descriptor, std::uint64_t number) {
  Table& all = table();
  int moved = descriptor;
  if (number != 0) {
    moved = ::fcntl(descriptor, F_DUPFD_CLOEXEC, all.first);
    ::close(descriptor);
  }
  if (moved >= all.first) all.open.at(static_cast<std::size_t>(moved - all.first)) = {number, {}};
  return moved;
}

int copy_of_parts(int descriptor) {
  Table& all = table();
  const OpenParts* const parts = parts_of(descriptor);
  const int copy = ::fcntl(descriptor, F_DUPFD_CLOEXEC, all.first);
  if (copy < 0) return -errno;
  all.open[static_cast<std::size_t>(copy - all.first)] = parts != nullptr ? *parts : OpenParts();
  return copy;
}

long read_part(int descriptor, void* out, std::size_t count) {
  const off_t at = parts_of(descriptor) == nullptr ? 0 : ::lseek(descriptor, 0, SEEK_CUR);
  return at < 0 ? -errno : read_at(descriptor, out, count, at, -1);
}

long read_part(int descriptor, void* out, std::size_t count, off_t offset) {
  return offset < 0 ? -EINVAL : read_at(descriptor, out, count, offset, offset);
}

}  // namespace windsplat::data::loader
