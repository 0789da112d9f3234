// The daemon's network side: one listener, HTTP and WebSocket sessions, one renderer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/store.hpp"

namespace windsplat::net {

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: any free port; port() tells which
  std::string base_path = "/";
  // Answer only requests whose Host is a loopback name or the host of an allowed origin: a web page
  // whose name was made to resolve to this machine then gets nothing.
  bool local_hosts_only = false;
  int sessions_max = 64;
  int idle_timeout_s = 300;
  std::vector<std::string> allow_origins;  // beyond the server's own
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

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// GET of an http:// URL, for `healthcheck`: the status code.
Result<int> http_status(const std::string& url, int timeout_s);

}  // namespace windsplat::net
