// Data after an upgrade -> the WebSocket edge and its session. Even first byte: raw bytes. Odd:
// messages, one per line, framed here.
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/daemon.hpp"

namespace {

using fuzz::expect;
using std::chrono::milliseconds;

constexpr std::string_view upgrade =
    "GET /v1/stream HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

// A zero mask keeps the text readable.
std::string frame_of(unsigned char first, std::string_view payload) {
  std::string out(1, static_cast<char>(first));
  const std::size_t size = payload.size();
  if (size < 126) {
    out += static_cast<char>(0x80 | size);
  } else {
    const int bytes = size < 65536 ? 2 : 8;
    out += static_cast<char>(0x80 | (bytes == 2 ? 126 : 127));
    for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>((size >> (8 * i)) & 0xff);
  }
  return out.append(4, '\0').append(payload);
}

std::string wire_of(std::string_view input) {
  if (input.empty()) return {};
  std::string_view rest = input.substr(1);
  if (input[0] % 2 == 0) return std::string(rest);
  std::string out;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    out += frame_of(0x81, rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return out;
}

void expect_close(std::string_view payload) {
  if (payload.empty()) return;
  expect(payload.size() >= 2, "a close frame has a code");
  const int code =
      (static_cast<unsigned char>(payload[0]) << 8) | static_cast<unsigned char>(payload[1]);
  // RFC 6455 does not define codes of 5000 and above; the server returns them unchanged.
  const bool sendable =
      (code >= 1000 && code <= 1003) || (code >= 1007 && code <= 1013) || code >= 3000;
  expect(sendable, "a close frame has a code that may be sent", std::to_string(code));
}

// Checks frames of a server (RFC 6455, 5.2). Returns whether one is a close.
bool expect_frames(std::string_view heard) {
  bool closed = false;
  while (heard.size() >= 2) {
    expect(!closed, "nothing follows a close");
    const auto byte = [heard](std::size_t i) { return static_cast<unsigned char>(heard[i]); };
    const int opcode = byte(0) & 0x0f;
    expect((byte(0) & 0x70) == 0 && (byte(0) & 0x80) != 0,
           "a frame is complete and has no extension");
    expect(opcode == 1 || opcode == 2 || (opcode >= 8 && opcode <= 10),
           "the opcode of a frame is known");
    expect((byte(1) & 0x80) == 0, "frames of a server are not masked");
    std::uint64_t length = byte(1) & 0x7f;
    const std::size_t more = length < 126 ? 0 : length == 126 ? 2 : 8;
    expect(opcode < 8 || more == 0, "a control frame is short");
    if (heard.size() < 2 + more) return closed;
    if (more > 0) length = 0;
    for (std::size_t i = 0; i < more; ++i) length = (length << 8) | byte(2 + i);
    if (heard.size() - 2 - more < length) return closed;  // truncated by the end
    const std::string_view payload = heard.substr(2 + more, length);
    if (opcode == 1) {
      expect(payload.size() > 2 && payload.front() == '{' && payload.back() == '}',
             "a text is an object", payload);
    }
    if (opcode == 2) expect(payload.starts_with("WSPL"), "a binary frame has its header", payload);
    if (opcode == 8) {
      closed = true;
      expect_close(payload);
    }
    heard.remove_prefix(2 + more + length);
  }
  return closed;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::uint64_t runs = 0;
  const std::string wire = wire_of(fuzz::text_of(data, size));
  fuzz::Peer peer;
  std::size_t head = 0;
  peer.talk(upgrade, milliseconds(10'000), [&head](const std::string& heard) {
    head = heard.find("\r\n\r\n");
    return head != std::string::npos;
  });
  if (!peer.heard().starts_with("HTTP/1.1 101 ")) {
    // Full for a moment while earlier sessions are released.
    expect(peer.heard().starts_with("HTTP/1.1 429 ") || peer.heard().starts_with("HTTP/1.1 503 "),
           "a stream is opened, or there are too many", peer.heard());
    fuzz::expect_answers(peer.heard(), peer.ended());
    return 0;
  }
  peer.talk(wire + frame_of(0x88, {}), milliseconds(20), [](const std::string&) { return true; });
  peer.half_close();
  // A server may wait two seconds for the client's close, but not here.
  bool closed = false;
  peer.talk({}, milliseconds(10'000), [&closed, head](const std::string& heard) {
    closed = expect_frames(std::string_view(heard).substr(head + 4));
    return closed;
  });
  expect(peer.ended() || closed, "the server must not wait for a client that has shut down");
  if (++runs % 256 == 0) fuzz::expect_alive();
  return 0;
}
