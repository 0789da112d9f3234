// One Server on a thread, plain sockets, and the grammar of responses.
#include "tests/fuzz/support/daemon.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "server/base/log.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/store.hpp"
#include "server/transport/server.hpp"
#include "tests/fuzz/support/check.hpp"

namespace fuzz {
namespace {

using namespace windsplat;
using std::chrono::milliseconds;

constexpr milliseconds end_of_life{20'000};

// Never destroyed: it serves until the process ends.
transport::Server& server() {
  static transport::Server* const the_one = [] {
    log::configure(log::Format::text, log::Level::off);
    auto store = std::make_shared<data::Store>(std::uint64_t{512} << 20);
    expect(store->add("climate:8x6x4").has_value(), "the sample exists");
    api::ServerOptions options;
    options.listen.front().port = 0;
    options.local_hosts_only = true;
    auto* made = new transport::Server(std::move(options), std::move(store),
                                       std::make_shared<ThreadPool>(1));
    expect(made->listen().has_value(), "a free port");
    std::thread([made] {
      made->run();
      expect(false, "the server must run until the end");
    }).detach();
    return made;
  }();
  return *the_one;
}

// A separate source address for each connection, from 127.0.0.2, so that no address tuple is reused
// soon.
sockaddr_in next_source() {
  static std::uint32_t count = 0;
  sockaddr_in source{};
  source.sin_family = AF_INET;
  source.sin_addr.s_addr = htonl(0x7f000002U + count++ % 0xfffffU);
  return source;
}

// 0, or errno. A signal that interrupts connect(2), like the fuzzer's alarm every 13 s, does not
// stop it: SO_ERROR is valid once the socket is writable (POSIX).
int connect_to(int socket, const sockaddr_in& to) {
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) return 0;
  if (errno != EINTR) return errno;
  pollfd about{socket, POLLOUT, 0};
  int ready = 0;
  do {
    ready = ::poll(&about, 1, static_cast<int>(end_of_life.count()));
  } while (ready < 0 && errno == EINTR);
  if (ready == 0) return ETIMEDOUT;
  int failed = 0;
  socklen_t size = sizeof failed;
  const bool told = ready > 0 && ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &failed, &size) == 0;
  return told ? failed : errno;
}

bool is_token(std::string_view name) {
  constexpr std::string_view marks = "!#$%&'*+-.^_`|~";
  return !name.empty() && std::all_of(name.begin(), name.end(), [marks](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
           marks.find(c) != std::string_view::npos;
  });
}

struct Head {
  int status = 0;
  std::size_t length = 0;
  bool has_length = false;
  std::string_view type;
};

Head read_head(std::string_view head) {
  Head out;
  expect(head.size() >= 13 && head.starts_with("HTTP/1.1 ") && head[12] == ' ',
         "a response begins with its status", head);
  const auto read = std::from_chars(head.data() + 9, head.data() + 12, out.status);
  expect(read.ec == std::errc() && out.status >= 100 && out.status < 600,
         "a status has three digits", head);
  const std::size_t line_end = std::min(head.find("\r\n"), head.size());
  std::string_view rest = head.substr(std::min(line_end + 2, head.size()));
  while (!rest.empty()) {
    const std::size_t end = rest.find("\r\n");
    const std::string_view line = rest.substr(0, end);
    const std::size_t colon = line.find(": ");
    expect(colon != std::string_view::npos && is_token(line.substr(0, colon)),
           "a header field has a name", line);
    const std::string_view name = line.substr(0, colon);
    const std::string_view value = line.substr(colon + 2);
    expect(std::none_of(value.begin(), value.end(),
                        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }),
           "a header field has no control characters", line);
    if (name == "Content-Length") {
      expect(!out.has_length, "a response has one Content-Length", head);
      out.has_length = true;
      std::from_chars(value.data(), value.data() + value.size(), out.length);
    }
    if (name == "Content-Type") out.type = value;
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 2);
  }
  return out;
}

void expect_problem(const Head& head, std::string_view body, std::string_view all) {
  expect(head.status != 500, "no request may cause an internal error", all);
  if (head.status < 400 || head.type == "text/plain") return;
  expect(head.type == "application/problem+json", "a refusal has a problem document", all);
  if (body.empty()) return;  // response to HEAD
  expect(body.front() == '{' && body.back() == '}' &&
             body.find("\"status\":" + std::to_string(head.status)) != std::string_view::npos,
         "a problem document is an object that repeats the status", all);
}

}  // namespace

Peer::Peer() {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(server().port());
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  expect(socket_ >= 0, "a socket");
  const linger at_once{1, 0};
  const int yes = 1;
  ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  const sockaddr_in from = next_source();
  expect(::bind(socket_, reinterpret_cast<const sockaddr*>(&from), sizeof from) == 0,
         "an address of loopback");
  const int failed = connect_to(socket_, to);
  expect(failed == 0, "the server accepts connections", std::to_string(failed));
}

Peer::~Peer() { ::close(socket_); }

void Peer::half_close() { ::shutdown(socket_, SHUT_WR); }

void Peer::talk(std::string_view bytes, milliseconds patience,
                const std::function<bool(const std::string&)>& done) {
  std::array<char, std::size_t{64} * 1024> part{};
  while (!ended_) {
    if (bytes.empty() && done(heard_)) return;
    pollfd about{socket_, static_cast<short>(POLLIN | (bytes.empty() ? 0 : POLLOUT)), 0};
    const int ready = ::poll(&about, 1, static_cast<int>(patience.count()));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return;
    if (!bytes.empty() && (about.revents & POLLOUT) != 0) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
      // Data sent before the close are still read.
      if (sent < 0 && errno != EAGAIN && errno != EINTR) bytes = {};
    }
    if ((about.revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
      const ssize_t got = ::recv(socket_, part.data(), part.size(), MSG_DONTWAIT);
      if (got > 0) heard_.append(part.data(), static_cast<std::size_t>(got));
      if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) ended_ = true;
    }
  }
}

std::size_t expect_answers(std::string_view heard, bool whole) {
  std::size_t count = 0;
  while (!heard.empty()) {
    const std::size_t end = heard.find("\r\n\r\n");
    if (end == std::string_view::npos) {
      expect(!whole, "a response header is complete", heard);
      return count;
    }
    const Head head = read_head(heard.substr(0, end));
    ++count;
    std::string_view body = heard.substr(end + 4);
    const bool has_body = head.status >= 200 && head.status != 204 && head.status != 304;
    expect(!has_body || head.has_length, "a response with a body has a Content-Length", heard);
    // Responses to HEAD have none.
    const bool left_out = body.empty() || body.starts_with("HTTP/1.1 ");
    const std::size_t length = has_body && !left_out ? head.length : 0;
    if (length > body.size()) {
      expect(!whole, "a response body has the declared length", heard.substr(0, end));
      return count;
    }
    expect_problem(head, body.substr(0, length), heard.substr(0, end + 4 + length));
    heard = body.substr(length);
  }
  return count;
}

void expect_alive() {
  Peer peer;
  peer.talk("GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n", end_of_life,
            [](const std::string&) { return false; });
  expect(peer.heard().starts_with("HTTP/1.1 200 "), "the server is alive", peer.heard());
}

}  // namespace fuzz
