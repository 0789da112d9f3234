// sendmsg and recvmsg until all bytes are transferred or the deadline passes.
#include "server/data/loader/channel.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>

namespace windsplat::data::loader {

namespace {

// done: the socket call can be retried.
Fate wait_for(int socket, short events, const Deadline& deadline) {
  int timeout_ms = -1;
  if (deadline) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(*deadline - Clock::now());
    if (left.count() <= 0) return Fate::late;
    timeout_ms =
        static_cast<int>(std::min<std::int64_t>(left.count(), std::numeric_limits<int>::max() / 2));
  }
  pollfd event{socket, events, 0};
  const int ready = ::poll(&event, 1, timeout_ms);
  if (ready < 0 && errno != EINTR) return Fate::broken;
  return ready == 0 ? Fate::late : Fate::done;
}

struct alignas(cmsghdr) Control {
  std::array<char, CMSG_SPACE(sizeof(int))> bytes{};
};

Fate send_bytes(int socket, const char* from, std::size_t bytes, int descriptor,
                const Deadline& deadline) {
  while (bytes > 0) {
    iovec part{const_cast<char*>(from), bytes};  // NOLINT: sendmsg does not write
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    Control control;
    if (descriptor >= 0) {
      message.msg_control = control.bytes.data();
      message.msg_controllen = control.bytes.size();
      cmsghdr* header = CMSG_FIRSTHDR(&message);
      header->cmsg_level = SOL_SOCKET;
      header->cmsg_type = SCM_RIGHTS;
      header->cmsg_len = CMSG_LEN(sizeof descriptor);
      std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
    }
    const ssize_t went = ::sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (went < 0 && errno == EINTR) continue;
    if (went < 0 && errno == EAGAIN) {
      if (const Fate fate = wait_for(socket, POLLOUT, deadline); fate != Fate::done) return fate;
      continue;
    }
    if (went < 0) return errno == EPIPE || errno == ECONNRESET ? Fate::closed : Fate::broken;
    from += went;
    bytes -= static_cast<std::size_t>(went);
    descriptor = -1;
  }
  return Fate::done;
}

void take_descriptor(msghdr& message, Descriptor* place) {
  for (cmsghdr* at = CMSG_FIRSTHDR(&message); at != nullptr; at = CMSG_NXTHDR(&message, at)) {
    if (at->cmsg_level != SOL_SOCKET || at->cmsg_type != SCM_RIGHTS) continue;
    int number = -1;
    std::memcpy(&number, CMSG_DATA(at), sizeof number);
    Descriptor taken(number);
    if (place != nullptr) *place = std::move(taken);
  }
}

}  // namespace

Fate wait_for_message(int socket, const Deadline& deadline) {
  return wait_for(socket, POLLIN, deadline);
}

Fate send_message(int socket, Kind kind, const char* payload, std::size_t bytes, int descriptor,
                  const Deadline& deadline) {
  const Frame frame{static_cast<std::uint32_t>(kind), 0, bytes};
  std::array<char, sizeof frame> head{};
  std::memcpy(head.data(), &frame, sizeof frame);
  const Fate fate = send_bytes(socket, head.data(), head.size(), descriptor, deadline);
  return fate == Fate::done ? send_bytes(socket, payload, bytes, -1, deadline) : fate;
}

Fate receive_bytes(int socket, char* out, std::size_t bytes, Descriptor* descriptor,
                   const Deadline& deadline) {
  while (bytes > 0) {
    // Checked before every part: sending single bytes does not extend the deadline.
    if (deadline && Clock::now() >= *deadline) return Fate::late;
    iovec part{out, bytes};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    Control control;
    if (descriptor != nullptr) {  // otherwise the kernel closes the received descriptor
      message.msg_control = control.bytes.data();
      message.msg_controllen = control.bytes.size();
    }
    const ssize_t got = ::recvmsg(socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EAGAIN) {
      if (const Fate fate = wait_for(socket, POLLIN, deadline); fate != Fate::done) return fate;
      continue;
    }
    if (got < 0) return errno == ECONNRESET ? Fate::closed : Fate::broken;
    if (got == 0) return Fate::closed;
    take_descriptor(message, descriptor);
    out += got;
    bytes -= static_cast<std::size_t>(got);
  }
  return Fate::done;
}

Fate receive_message(int socket, Message& out, std::size_t bytes_max, Descriptors descriptors,
                     const Deadline& deadline) {
  constexpr std::size_t part_bytes = std::size_t{1} << 20;
  Frame frame;
  std::array<char, sizeof frame> head{};
  Descriptor* place = descriptors == Descriptors::taken ? &out.descriptor : nullptr;
  if (const Fate fate = receive_bytes(socket, head.data(), head.size(), place, deadline);
      fate != Fate::done) {
    return fate;
  }
  std::memcpy(&frame, head.data(), sizeof frame);
  if (frame.kind < static_cast<std::uint32_t>(Kind::open) ||
      frame.kind > static_cast<std::uint32_t>(Kind::unpacked) || frame.zero != 0 ||
      frame.bytes > bytes_max) {
    return Fate::broken;
  }
  out.kind = static_cast<Kind>(frame.kind);
  out.payload.clear();
  while (out.payload.size() < frame.bytes) {
    const std::size_t at = out.payload.size();
    const std::size_t part =
        std::min<std::size_t>(part_bytes, static_cast<std::size_t>(frame.bytes) - at);
    out.payload.resize(at + part);
    if (const Fate fate = receive_bytes(socket, out.payload.data() + at, part, nullptr, deadline);
        fate != Fate::done) {
      return fate;
    }
  }
  return Fate::done;
}

}  // namespace windsplat::data::loader
