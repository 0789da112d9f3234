// Request -> the resource it names. Resources answer at once or, after a job of the renderer,
// later.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "server/base/thread_pool.hpp"
#include "server/frame/frame.hpp"
#include "server/net/catalogue.hpp"
#include "server/net/exchange.hpp"
#include "server/net/render_service.hpp"
#include "server/net/server.hpp"

namespace windsplat::net {

// What resources work with. Lives as long as the server.
struct Services {
  Services(ServerOptions server_options, std::shared_ptr<data::Store> store,
           std::shared_ptr<ThreadPool> threads);

  ServerOptions options;  // base_path normal
  Catalogue catalogue;
  std::shared_ptr<ThreadPool> pool;
  frame::Workspace frames;  // of the renderer's thread alone
  std::atomic<bool> draining{false};
  RenderService renderer;  // last: its thread uses the others
};

// Whether the path is the stream's.
bool names_stream(const Request& request);

// Calls `reply` once: now, or later from the renderer's thread. Never throws past a reply.
void route(Services& services, const Request& request, const Reply& reply);

}  // namespace windsplat::net
