// Offered TLS versions and groups, and limits on computation for unauthenticated clients.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <deque>
#include <functional>
#include <memory>

#include "server/access/auth.hpp"
#include "server/transport/tls.hpp"
#include "tests/integration/certificate.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using windsplat::access::Limits;
using windsplat::access::Token;
using windsplat::api::ServerOptions;

ServerOptions over_tls(const Limits& limits = {}) {
  const Certificate made = make_certificate("handshake");
  auto tls = windsplat::transport::make_tls(made.chain, made.key);
  EXPECT_TRUE(tls) << (tls ? "" : tls.error().message);
  ServerOptions options;
  options.limits = limits;
  if (tls) options.tls = *tls;
  return options;
}

// A blocking client from a loopback address with configurable offers.
class Client {
 public:
  using Setup = std::function<void(SSL_CTX*)>;

  explicit Client(std::uint16_t port, const Setup& setup = nullptr, SSL_SESSION* resumed = nullptr,
                  const char* from = "127.0.0.1")
      : context_(SSL_CTX_new(TLS_client_method()), SSL_CTX_free),
        handle_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
    const timeval patience{60, 0};
    ::setsockopt(handle_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    ::inet_pton(AF_INET, from, &own.sin_addr);
    sockaddr_in peer = own;
    peer.sin_port = htons(port);
    peer.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::bind(handle_, reinterpret_cast<const sockaddr*>(&own), sizeof own);
    ::connect(handle_, reinterpret_cast<const sockaddr*>(&peer), sizeof peer);
    if (setup) setup(context_.get());
    ssl_.reset(SSL_new(context_.get()));
    SSL_set_fd(ssl_.get(), handle_);
    if (resumed != nullptr) SSL_set_session(ssl_.get(), resumed);
    shaken_ = SSL_connect(ssl_.get()) == 1;
  }
  ~Client() {
    ssl_.reset();
    ::close(handle_);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] bool shaken() const { return shaken_; }
  [[nodiscard]] SSL* ssl() const { return ssl_.get(); }

  // The response to a GET, and with TLS 1.3 the tickets before it.
  std::string get(const std::string& target, const std::string& fields = "") {
    const std::string ask =
        "GET " + target + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n" + fields + "\r\n";
    if (SSL_write(ssl_.get(), ask.data(), static_cast<int>(ask.size())) <= 0) return "";
    std::string answer;
    std::array<char, 65536> part{};
    for (int got = 0; (got = SSL_read(ssl_.get(), part.data(), part.size())) > 0;) {
      answer.append(part.data(), static_cast<std::size_t>(got));
    }
    return answer;
  }

 private:
  std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context_;
  std::unique_ptr<SSL, decltype(&SSL_free)> ssl_{nullptr, SSL_free};
  int handle_;
  bool shaken_ = false;
};

Client::Setup offering(const char* groups, int version = TLS1_3_VERSION) {
  return [groups, version](SSL_CTX* context) {
    SSL_CTX_set1_groups_list(context, groups);
    SSL_CTX_set_max_proto_version(context, version);
  };
}

TEST(TlsGroups, ThatAreExpensiveAreRefused) {
  TestServer server(over_tls());
  for (const char* groups : {"X25519", "P-256", "ffdhe2048:P-256", "P-384:X25519"}) {
    EXPECT_TRUE(Client(server.port(), offering(groups)).shaken()) << groups;
  }
  // The certificate's own group, P-256, must be among them.
  for (const char* groups : {"X25519:P-256", "P-256", "P-384:P-256"}) {
    EXPECT_TRUE(Client(server.port(), offering(groups, TLS1_2_VERSION)).shaken()) << groups;
  }
  for (const char* groups : {"ffdhe2048", "ffdhe8192", "P-384", "P-521", "X448"}) {
    EXPECT_FALSE(Client(server.port(), offering(groups)).shaken()) << groups;
  }
  for (const char* groups : {"P-384", "P-521", "X448"}) {
    EXPECT_FALSE(Client(server.port(), offering(groups, TLS1_2_VERSION)).shaken()) << groups;
  }
}

TEST(TlsSessions, AreResumedWithoutEarlyData) {
  TestServer server(over_tls());
  static SSL_SESSION* ticket = nullptr;
  const auto keep = [](SSL_CTX* context) {
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_CLIENT);
    SSL_CTX_sess_set_new_cb(context, [](SSL* /*ssl*/, SSL_SESSION* session) {
      SSL_SESSION_free(ticket);
      ticket = session;
      return 1;
    });
  };
  Client first(server.port(), keep);  // closing it would invalidate the ticket
  ASSERT_THAT(first.get("/livez"), HasSubstr(" 200 "));
  ASSERT_NE(ticket, nullptr);
  EXPECT_EQ(SSL_SESSION_get_max_early_data(ticket), 0U);
  Client again(server.port(), nullptr, ticket);
  EXPECT_TRUE(again.shaken());
  EXPECT_EQ(SSL_session_reused(again.ssl()), 1);
  EXPECT_THAT(again.get("/livez"), HasSubstr(" 200 "));
  SSL_SESSION_free(std::exchange(ticket, nullptr));
}

TEST(TlsSessions, AskForNoCertificateOfTheClient) {
  TestServer server(over_tls());
  static int asked = 0;
  Client client(server.port(), [](SSL_CTX* context) {
    SSL_CTX_set_client_cert_cb(context, [](SSL* /*ssl*/, X509** /*own*/, EVP_PKEY** /*key*/) {
      ++asked;
      return 0;
    });
  });
  EXPECT_TRUE(client.shaken());
  EXPECT_EQ(asked, 0);
}

TEST(TlsHandshakes, BeyondTheTimeOfAnAddressAreNotStarted) {
  Limits limits;
  limits.handshake_ms_per_address = 2;
  TestServer server(over_tls(limits));
  Client file_watch(server.port(), nullptr, nullptr, "127.0.0.2");
  ASSERT_TRUE(file_watch.shaken());
  int shaken = 0;
  // The clock of the thread may be coarse, so that some handshakes seem to take no time.
  while (shaken < 5000 && Client(server.port()).shaken()) ++shaken;
  EXPECT_GT(shaken, 0) << "the burst of ten seconds";
  EXPECT_LT(shaken, 5000);
  const std::string metrics = file_watch.get("/metrics");
  EXPECT_THAT(metrics, HasSubstr("windsplat_refused_total{limit=\"handshakes\"} 1\n"));
  EXPECT_THAT(metrics, testing::Not(HasSubstr("windsplat_tls_handshake_seconds_total 0\n")));
  EXPECT_TRUE(Client(server.port(), nullptr, nullptr, "127.0.0.2").shaken());
}

TEST(TlsHandshakes, OfOtherAddressesLeaveTimeForLocalHealthChecks) {
  Limits limits;
  limits.handshake_ms = 0.01;  // a further handshake is repaid within a minute
  limits.handshake_ms_per_address = 1000;
  testing::internal::CaptureStderr();
  TestServer server(over_tls(limits));
  int shaken = 0;
  while (shaken < 5000 && Client(server.port(), nullptr, nullptr, "127.0.0.2").shaken()) ++shaken;
  int healthy = 0;
  int others = 0;
  for (int n = 0; n < 5; ++n) {
    healthy += get(Place(server.port(), true), "/livez").status == 200 ? 1 : 0;
    others += Client(server.port(), nullptr, nullptr, "127.0.0.3").shaken() ? 1 : 0;
  }
  server.stop();
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_LT(shaken, 5000);
  EXPECT_EQ(healthy, 5);
  EXPECT_LT(others, 5) << "they wait for the debt of the first address";
  EXPECT_THAT(log, HasSubstr("exceeded their processor time"));
  EXPECT_THAT(log, HasSubstr("connections=1 seconds=0 address=127.0.0.2"));
}

// HTTP reports authenticated addresses to the quota: their handshakes are counted separately.
TEST(TlsHandshakes, OfAuthenticatedAddressesDoNotCompeteWithOthers) {
  Limits limits;
  limits.handshake_ms = 0.001;  // a further handshake is repaid within ten minutes
  limits.handshake_ms_per_address = 1000;
  ServerOptions options = over_tls(limits);
  options.token = std::make_shared<const Token>(Token::parse("a-token-of-this-test").value());
  TestServer server(options);
  const auto from = [&](const char* address) {
    return std::make_unique<Client>(server.port(), nullptr, nullptr, address);
  };
  ASSERT_THAT(from("127.0.0.2")->get("/v1", "Authorization: Bearer a-token-of-this-test\r\n"),
              HasSubstr(" 200 "));
  int shaken = 0;
  while (shaken < 5000 && from("127.0.0.3")->shaken()) ++shaken;
  EXPECT_LT(shaken, 5000);
  EXPECT_TRUE(from("127.0.0.2")->shaken());
  int others = 0;
  for (int n = 0; n < 5; ++n) others += from("127.0.0.4")->shaken() ? 1 : 0;
  EXPECT_LT(others, 5) << "they wait for the debt of the first address";
}

TEST(PlainHttp, AtTheTlsPortIsChargedToItsAddress) {
  Limits limits;
  limits.bytes_per_address = 1;  // ten at once
  TestServer server(over_tls(limits));
  EXPECT_EQ(raw(server.port(), "GET /livez HTTP/1.1\r\nHost: x\r\n\r\n").status, 400);
  const Answer picture =
      get(Place(server.port(), true), "/v1/datasets/small/frame.jpg?width=64&height=48");
  EXPECT_EQ(picture.status, 429);
  EXPECT_THAT(picture.body, HasSubstr("bytes a second"));
}

// OpenSSL accepts a ClientHello of 131 kB and waits for all of it.
TEST(TlsHandshakes, WithMuchInputAreClosedBeforeIdleOnes) {
  TestServer server(over_tls());
  Socket silent(server.port());
  Socket large(server.port());
  std::string hello("\x01\x01\xf0\x00\x03\x03", 6);
  hello.resize(60'000);
  for (std::size_t at = 0; at < hello.size(); at += 10'000) {
    large.send(std::string("\x16\x03\x01\x27\x10", 5) + hello.substr(at, 10'000));
  }
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(large.closed_by_peer(20'000));
  const auto waited = std::chrono::steady_clock::now() - begin;
  EXPECT_TRUE(silent.closed_by_peer(20'000));
  EXPECT_LT(waited, (std::chrono::steady_clock::now() - begin) / 2);
}

// A handshake is ended by its client, its deadline or the server.
TEST(TlsHandshakes, MayBeAbortedAtAnyTime) {
  for (int n = 0; n < 24; ++n) {
    TestServer server(over_tls());
    std::deque<Socket> half;
    for (int k = 0; k < 8; ++k) {
      half.emplace_back(server.port());
      if (k % 2 == 0) half.back().send(std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc", 9));
      if (k % 3 == 0) half.pop_back();
    }
    std::thread shaking([port = server.port()] { Client{port}; });
    if (n % 2 == 0) {
      EXPECT_EQ(get(Place(server.port(), true), "/livez").status, 200);
    }
    if (n != 11) half.clear();  // a drain waits for their deadline
    if (n % 3 == 0) shaking.join();
    server.stop();
    if (n % 3 != 0) shaking.join();
  }
}

}  // namespace
}  // namespace server_test
