// Bytes of a connection -> the HTTP edge of a server in this process. Responses must be valid HTTP,
// and the server must survive.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/limits.hpp"
#include "tests/fuzz/support/check.hpp"
#include "tests/fuzz/support/daemon.hpp"

namespace {

using std::chrono::milliseconds;

constexpr std::string_view last_name = "the-last-one";

// Number of bytes missing in the body of the first request: they are added, so that another request
// can follow. An estimate: errors only cost time.
std::size_t lacking(std::string_view input) {
  const std::size_t end = input.find("\r\n\r\n");
  const std::size_t at = input.find("Content-Length: ");
  if (end == std::string_view::npos || at > end) return 0;
  std::size_t length = 0;
  std::from_chars(input.data() + at + 16, input.data() + end, length);
  const std::size_t there = input.size() - end - 4;
  if (length > windsplat::protocol::limits::http_body_bytes_max || length <= there) return 0;
  return length - there;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::uint64_t runs = 0;
  std::string bytes(fuzz::text_of(data, size));
  const bool has_end = bytes.find("\r\n\r\n") != std::string::npos;
  if (has_end) {
    bytes.append(lacking(bytes), ' ');
    bytes += "GET /livez HTTP/1.1\r\nHost: localhost\r\nX-Request-Id: ";
    bytes += last_name;
    bytes += "\r\nConnection: close\r\n\r\n";
  }
  fuzz::Peer peer;
  if (has_end) {
    // A request that renders longer than this is abandoned, which the server must handle.
    peer.talk(bytes, milliseconds(200), [](const std::string&) { return false; });
  } else {
    peer.talk(bytes, milliseconds(20), [](const std::string&) { return true; });
    peer.half_close();
    peer.talk({}, milliseconds(10'000), [](const std::string&) { return false; });
    fuzz::expect(peer.ended(), "the server must not wait for a client that has shut down");
  }
  const std::size_t answers = fuzz::expect_answers(peer.heard(), peer.ended());
  if (peer.ended() && has_end)
    fuzz::expect(answers > 0, "a request with a complete header gets a response");
  if (++runs % 256 == 0) fuzz::expect_alive();
  return 0;
}
