// Datasets, renderer, loading threads and history: everything that draws pictures and answers
// queries of data. Independent of HTTP and sockets.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/base/thread_pool.hpp"
#include "server/frame/cost.hpp"
#include "server/frame/frame.hpp"
#include "server/image/video_streams.hpp"
#include "server/metrics/metrics.hpp"
#include "server/quality/tables.hpp"
#include "server/tasks/animation/animations.hpp"
#include "server/tasks/catalogue.hpp"
#include "server/tasks/jobs.hpp"
#include "server/tasks/known_ranges.hpp"
#include "server/tasks/references.hpp"
#include "server/tasks/render_service.hpp"
#include "server/tasks/request_times.hpp"
#include "server/tasks/task_executor.hpp"

namespace windsplat::tasks {

struct BackendOptions {
  double requests_waiting_ms_max = 30'000;  // see RenderService::Options
  double wait_ms = 0;                       // delay by requests of other addresses
  // Called on the renderer's thread with the time of a picture and of sampling its section, and
  // the address charged.
  std::function<void(const std::string& payer, std::int64_t us)> charge;
  // Limit on the cost of a picture.
  std::function<Result<void>(const frame::Cost& cost)> check_cost;
  // Of the grounds that the renderer keeps between frames.
  std::uint64_t ground_bytes = std::uint64_t{64} << 20;
};

// Outlives all connections; owned by the server.
struct Backend {
  Backend(std::shared_ptr<data::Store> store, std::shared_ptr<ThreadPool> threads,
          metrics::Metrics& metrics_of_server, BackendOptions options);

  // Checks whether the view can be drawn (Catalogue::check) within the cost limit. Loads nothing.
  Result<Catalogue::Checked> check(const protocol::View& view);

  // Ends the threads of the executors: no reply is called after it returns.
  void end();

  Catalogue catalogue;
  metrics::Metrics& metrics;
  std::shared_ptr<ThreadPool> pool;
  image::VideoStreams video;
  frame::Workspace frames;  // used by the renderer's thread only
  quality::Tables quality;
  KnownRanges ranges;
  RequestTimes request_times;
  References references;
  Animations animations;
  Jobs jobs;               // use the catalogue and the renderer: ended before them
  RenderService renderer;  // uses the members above
  TaskExecutor loads;      // use the members above, including the renderer: ended first

 private:
  std::function<Result<void>(const frame::Cost& cost)> check_cost_;
};

}  // namespace windsplat::tasks
