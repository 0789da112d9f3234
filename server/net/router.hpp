// Request -> the resource it names. Resources answer at once or, after a job of the renderer,
// later.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "server/base/thread_pool.hpp"
#include "server/frame/frame.hpp"
#include "server/net/admission.hpp"
#include "server/net/catalogue.hpp"
#include "server/net/exchange.hpp"
#include "server/net/jobs.hpp"
#include "server/net/known_ranges.hpp"
#include "server/net/load_service.hpp"
#include "server/net/metrics.hpp"
#include "server/net/references.hpp"
#include "server/net/render_costs.hpp"
#include "server/net/render_service.hpp"
#include "server/net/request_id.hpp"
#include "server/net/server.hpp"
#include "server/quality/tables.hpp"

namespace windsplat::net {

// What resources work with. Lives as long as the server.
struct Services {
  Services(ServerOptions server_options, std::shared_ptr<data::Store> store,
           std::shared_ptr<ThreadPool> threads);

  ServerOptions options;  // base_path normal
  Catalogue catalogue;
  Metrics metrics;  // before whatever counts
  Admission admission;
  RequestIds request_ids;  // of the io thread alone
  std::shared_ptr<ThreadPool> pool;
  frame::Workspace frames;  // of the renderer's thread alone
  quality::Tables quality;
  std::atomic<bool> draining{false};
  KnownRanges ranges;
  RenderCosts costs;
  References references;
  Jobs jobs;               // their threads use the catalogue, and the renderer: ended before it
  LoadService locator;     // looks up posted names: a slow disk keeps no one else waiting
  LoadService keeper;      // changes saved views, on disk too
  LoadService watcher;     // looks for files that changed, and opens them anew
  RenderService renderer;  // its thread uses the others
  LoadService loads;       // its threads use them too, the renderer among them: ended first
  // Ends the threads that answer: after it no reply is called any more.
  void end();
  ~Services() { end(); }
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;
};

// Whether the view can be drawn (Catalogue::check), and is no more than a picture may be. Loads
// nothing.
Result<Catalogue::Checked> check_picture(Services& services, const protocol::View& view);
// The same; the value is the number of steps of its dataset.
Result<int> check_view(Services& services, const protocol::View& view);

// Whether the path is one that is answered however much there is to do: /livez, /readyz, /metrics.
bool names_health(const Request& request);
// Whether the path is the stream's.
bool names_stream(const Request& request);

// Calls `reply` once: now, or later from the renderer's thread. Never throws past a reply. The
// value is the resource's name (routes.hpp).
const char* route(Services& services, const Request& request, const Reply& reply);

}  // namespace windsplat::net
