// The daemon's network side: one listener, HTTP and WebSocket sessions, one renderer.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/store.hpp"
#include "server/net/auth.hpp"
#include "server/net/limits.hpp"
#include "server/net/tls.hpp"
#include "server/views/saved_views.hpp"

namespace windsplat::net {

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: any free port; port() tells which
  std::string base_path = "/";
  // Answer only requests whose Host is a loopback name or the host of an allowed origin: a web page
  // whose name was made to resolve to this machine then gets nothing.
  bool local_hosts_only = false;
  // The same where others reach the server, by its addresses, too.
  bool known_hosts_only = false;
  std::vector<std::string> allow_hosts;  // further names for both, without a port
  // The folder below which POST /v1/datasets opens files, absolute; empty: none.
  std::string data_root;
  std::shared_ptr<views::SavedViews> views;  // null: kept in memory alone
  int sessions_max = 64;
  Limits limits;
  int idle_timeout_s = 300;
  // Further requests for pictures are refused while those that wait will take longer than this.
  double requests_waiting_ms_max = 30'000;
  std::vector<std::string> allow_origins;  // beyond the server's own
  std::shared_ptr<const Token> token;      // null: nobody is asked for one
  std::shared_ptr<TlsContext> tls;         // null: plain TCP
  // Of a drain: when what is still drawn is given up, and when connections are ended.
  std::chrono::milliseconds drain_cancel_after{6000};
  std::chrono::milliseconds drain_abort_after{8000};
};

// What can be changed while the server runs.
struct Access {
  std::vector<std::string> allow_origins;
  std::shared_ptr<const Token> token;
  std::shared_ptr<TlsContext> tls;  // of connections that come; null only where it was before
  bool known_hosts_only = false;
  std::vector<std::string> allow_hosts;
};

class Server {
 public:
  Server(ServerOptions options, std::shared_ptr<data::Store> store,
         std::shared_ptr<ThreadPool> pool);
  ~Server();

  Result<void> listen();  // binds; errors name address and port
  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string url() const;  // to open in a browser, with the base path

  void run();  // serves until drained; blocks
  // Any thread: /readyz fails, streams close with 1001, frames in work end or are given up, and
  // run() returns within 10 s.
  void drain();
  // Any thread. Another token ends the streams that were opened before.
  void change(Access access);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// GET of an http:// or https:// URL, for `healthcheck`: the status code. The certificate is checked
// against `ca`, certificates in PEM, the server's own among them or one that leads to it; empty:
// those of the system.
Result<int> http_status(const std::string& url, int timeout_s, const std::string& ca = "");

}  // namespace windsplat::net
