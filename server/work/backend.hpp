// What pictures and answers about data are made with: the datasets, the renderer, the threads that
// load, and what is known of earlier frames. Knows nothing of HTTP or sockets.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/base/thread_pool.hpp"
#include "server/frame/cost.hpp"
#include "server/frame/frame.hpp"
#include "server/metrics/metrics.hpp"
#include "server/quality/tables.hpp"
#include "server/work/catalogue.hpp"
#include "server/work/cost_history.hpp"
#include "server/work/jobs.hpp"
#include "server/work/known_ranges.hpp"
#include "server/work/load_service.hpp"
#include "server/work/references.hpp"
#include "server/work/render_service.hpp"

namespace windsplat::net {

struct BackendOptions {
  double requests_waiting_ms_max = 30'000;  // see RenderService::Options
  double wait_ms = 0;                       // of requests of other addresses
  // Called on the renderer's thread: what a picture took, for the address that pays for it.
  std::function<void(const std::string& payer, std::int64_t us)> charge;
  // Whether a picture may cost that much.
  std::function<Result<void>(const frame::Cost& cost)> check_cost;
};

// Lives as long as the server.
struct Backend {
  // Requests for pictures and descriptions that may wait at a time.
  static constexpr std::size_t requests_waiting_max = 16;

  Backend(std::shared_ptr<data::Store> store, std::shared_ptr<ThreadPool> threads,
          Metrics& metrics_of_server, BackendOptions options);

  // Whether the view can be drawn (Catalogue::check), and costs no more than a picture may. Loads
  // nothing.
  Result<Catalogue::Checked> check(const protocol::View& view);

  // Ends the threads that answer: after it no reply is called any more.
  void end();

  Catalogue catalogue;
  Metrics& metrics;
  std::shared_ptr<ThreadPool> pool;
  frame::Workspace frames;  // of the renderer's thread alone
  quality::Tables quality;
  KnownRanges ranges;
  RenderCosts costs;
  References references;
  Jobs jobs;               // their threads use the catalogue and the renderer: ended before it
  RenderService renderer;  // its thread uses the others
  LoadService loads;       // its threads use them too, the renderer among them: ended first

 private:
  std::function<Result<void>(const frame::Cost& cost)> check_cost_;
};

}  // namespace windsplat::net
