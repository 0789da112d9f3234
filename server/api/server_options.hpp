// What the daemon's network side is started with.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/access/auth.hpp"
#include "server/access/limits.hpp"
#include "server/views/saved_views.hpp"

namespace windsplat::net {

struct TlsContext;

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

}  // namespace windsplat::net
