// Options of the daemon's network side.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/messages.hpp"
#include "server/access/auth.hpp"
#include "server/access/limits.hpp"
#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/uploads/uploads.hpp"
#include "server/views/saved_views.hpp"

namespace windsplat::transport {
struct TlsContext;
}  // namespace windsplat::transport

namespace windsplat::api {

// Where the server listens: an address and port, or a UNIX socket.
struct ListenPlace {
  std::string address = "127.0.0.1";  // IPv4 or IPv6, without brackets; unused with `path`
  std::uint16_t port = 8080;          // 0: any free port
  std::string path = {};              // of a UNIX socket, absolute; empty: TCP
  unsigned mode = 0660;               // of the socket's file
  bool may_lack = false;              // one of several addresses of a name: skipped if this machine
                                      // lacks it
  int socket = -1;                    // listens already at the above; owned by the server
};

struct ServerOptions {
  std::vector<ListenPlace> listen{ListenPlace{}};
  std::string base_path = "/";
  // Answer only requests whose Host is a loopback name or the host of an allowed origin, as a
  // protection against DNS rebinding.
  bool local_hosts_only = false;
  // Allow IP addresses as Host, too, when other machines reach the server.
  bool known_hosts_only = false;
  std::vector<std::string> allow_hosts;  // additional names for both, without a port
  // The folder below which POST /v1/datasets opens files, absolute; empty: none.
  std::string data_root;
  bool fixed_entries = false;  // clients may not open other entries of listed datasets
  // Locates a URL that it opens too; empty: none. Errors: invalid, also if its host is not
  // permitted.
  std::function<Result<data::Location>(const std::string&)> locate_url;
  std::shared_ptr<views::SavedViews> views;   // null: in memory only
  std::shared_ptr<uploads::Uploads> uploads;  // null: none are accepted
  int sessions_max = 64;
  access::Limits limits;
  int idle_timeout_s = 300;
  // Limit on the waiting time of requests for pictures, milliseconds; further ones are refused.
  double requests_waiting_ms_max = 30'000;
  // Of the grounds that the renderer keeps between frames.
  std::uint64_t ground_bytes = std::uint64_t{64} << 20;
  std::vector<std::string> allow_origins;  // besides the origin of the server
  // Other origins whose pages may show the embedded view in a frame (http/framing.hpp).
  std::vector<std::string> embedders;
  std::shared_ptr<const access::Token> token;  // null: no authentication
  std::shared_ptr<transport::TlsContext> tls;  // null: plain TCP
  // Phases of a drain: when rendering is cancelled, and when connections are closed.
  std::chrono::milliseconds drain_cancel_after{6000};
  std::chrono::milliseconds drain_abort_after{8000};
  // Called on the network thread at this interval while it works; zero: never.
  std::chrono::milliseconds alive_every{0};
  std::function<void()> alive;

  // As published to clients.
  [[nodiscard]] protocol::ServerLimits published_limits() const {
    protocol::ServerLimits out{.image_pixels_max = limits.pixels_max_reported()};
    if (!uploads) return out;
    out.upload_bytes_max = uploads->bytes_max_per_address();
    out.uploads_bytes_max = uploads->bytes_max();
    return out;
  }
};

}  // namespace windsplat::api
