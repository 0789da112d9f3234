// What the resources of the API work with.
#pragma once

#include <atomic>
#include <memory>

#include "server/access/admission.hpp"
#include "server/api/server_options.hpp"
#include "server/http/request_id.hpp"
#include "server/metrics/metrics.hpp"
#include "server/work/backend.hpp"

namespace windsplat::net {

// Lives as long as the server.
struct Services {
  Services(ServerOptions server_options, std::shared_ptr<data::Store> store,
           std::shared_ptr<ThreadPool> threads);
  ~Services() { end(); }
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  // Ends the threads that answer: after it no reply is called any more.
  void end();

  ServerOptions options;  // base_path normal
  Metrics metrics;        // before whatever counts
  Admission admission;
  RequestIds request_ids;  // of the io thread alone
  std::atomic<bool> draining{false};
  Backend backend;
  LoadService locator;     // looks up posted names: a slow disk keeps no one else waiting
  LoadService view_io;     // changes saved views, on disk too
  LoadService file_watch;  // looks for files that changed, and opens them anew
};

}  // namespace windsplat::net
