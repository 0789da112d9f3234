// The daemon's network side: listeners, HTTP and WebSocket sessions, one renderer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/access/auth.hpp"
#include "server/api/server_options.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/store.hpp"
#include "server/transport/tls.hpp"

namespace windsplat::transport {

// Settings that can change while the server runs.
struct Access {
  std::vector<std::string> allow_origins;
  std::shared_ptr<const access::Token> token;
  std::shared_ptr<TlsContext> tls;  // for new connections; may be null only if it was null before
  bool known_hosts_only = false;
  std::vector<std::string> allow_hosts;
};

class Server {
 public:
  Server(api::ServerOptions options, std::shared_ptr<data::Store> store,
         std::shared_ptr<ThreadPool> pool);
  ~Server();

  // Binds all places of the options. Errors name the place.
  Result<void> listen();
  [[nodiscard]] std::uint16_t port() const;  // of the first TCP place; 0 if there is none
  [[nodiscard]] std::string url() const;     // of the first place, with the base path
  [[nodiscard]] std::vector<std::string> urls() const;  // of each

  void run();  // serves until drained; blocks
  // May be called from any thread. /readyz fails, streams close with 1001, current frames end or
  // are cancelled, and run() returns within 10 s.
  void drain();
  // May be called from any thread. Streams authorised by the previous token are closed.
  void change(Access access);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::transport
