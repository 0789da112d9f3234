// A loader that sends the messages of an input, started instead of `windsplat load`. The input is
// next to the program; fuzz_loader_call.cpp describes its form.
#include <sys/auxv.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "server/data/loader/channel.hpp"
#include "server/data/loader/process.hpp"

namespace {

using namespace windsplat::data::loader;

constexpr std::string_view turn_mark = "\n#!turn\n";
constexpr unsigned char raw = 0x80;

bool send_all(const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t sent = ::send(socket_of_loader, at, size, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    at += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

// Reads a whole message; returns the descriptor received with it, or -1. False: the daemon has
// disconnected.
bool hear(int& descriptor) {
  Frame frame;
  iovec part{&frame, sizeof frame};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  if (::recvmsg(socket_of_loader, &message, MSG_WAITALL) != sizeof frame) return false;
  descriptor = -1;
  if (const cmsghdr* head = CMSG_FIRSTHDR(&message)) {
    std::memcpy(&descriptor, CMSG_DATA(head), sizeof descriptor);
  }
  std::array<char, 4096> rest{};
  while (frame.bytes > 0) {
    const ssize_t got =
        ::recv(socket_of_loader, rest.data(), std::min<std::uint64_t>(rest.size(), frame.bytes), 0);
    if (got <= 0) return false;
    frame.bytes -= static_cast<std::uint64_t>(got);
  }
  return true;
}

// Fills the memory by repeating the first bytes of the turn.
void fill(int memory, std::string_view turn) {
  struct stat status {};
  std::array<char, 64> pattern{};
  if (turn.empty() || ::fstat(memory, &status) != 0) return;
  for (std::size_t i = 0; i < pattern.size(); ++i) pattern[i] = turn[i % turn.size()];
  for (off_t at = 0; at < std::min<off_t>(status.st_size, 4096);
       at += static_cast<off_t>(pattern.size())) {
    const auto left = static_cast<std::size_t>(status.st_size - at);
    if (::pwrite(memory, pattern.data(), std::min(pattern.size(), left), at) < 0) return;
  }
}

}  // namespace

int main() {
  // The name of the program, which identifies the input.
  const auto* name = reinterpret_cast<const char*>(::getauxval(AT_EXECFN));
  std::ifstream file(std::string(name) + ".in", std::ios::binary);
  const std::string input((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::string_view rest = input;
  bool waits = true;
  while (!rest.empty()) {
    int descriptor = -1;
    if (waits && !hear(descriptor)) return 0;
    const std::size_t end = std::min(rest.find(turn_mark), rest.size());
    const std::string_view turn = rest.substr(0, end);
    rest.remove_prefix(std::min(end + turn_mark.size(), rest.size()));
    if (descriptor >= 0) fill(descriptor, turn);
    if (turn.empty()) continue;
    const auto kind = static_cast<unsigned char>(turn[0]);
    const Frame frame{kind, 0, turn.size() - 1};
    if (kind < raw && !send_all(&frame, sizeof frame)) return 0;
    if (!send_all(turn.data() + 1, turn.size() - 1)) return 0;
    waits = kind != static_cast<unsigned char>(Kind::progress);
  }
  return 0;
}
