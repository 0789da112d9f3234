// Shared services of the API resources.
#pragma once

#include <atomic>
#include <memory>

#include "server/access/admission.hpp"
#include "server/api/server_options.hpp"
#include "server/http/request_id.hpp"
#include "server/metrics/metrics.hpp"
#include "server/work/backend.hpp"

namespace windsplat::api {

// Outlives all connections; owned by the server.
struct Services {
  Services(ServerOptions server_options, std::shared_ptr<data::Store> store,
           std::shared_ptr<ThreadPool> threads);
  ~Services() { end(); }
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  // Ends the service threads: no reply is called after it returns.
  void end();

  ServerOptions options;     // base_path normalised
  metrics::Metrics metrics;  // before the members that count
  access::Admission admission;
  http::RequestIds request_ids;  // used by the io thread only
  std::atomic<bool> draining{false};
  work::Backend backend;
  work::TaskExecutor locator;     // resolves posted names: a slow disk delays no other service
  work::TaskExecutor view_io;     // changes saved views, also on disk
  work::TaskExecutor file_watch;  // checks files for changes and reopens them
};

}  // namespace windsplat::api
