// The parts of the server, constructed and ended in order of dependency. Only the server has access
// to all of them; sessions and handlers are given those that they use.
#pragma once

#include <atomic>
#include <memory>

#include "server/access/admission.hpp"
#include "server/api/router.hpp"
#include "server/api/server_options.hpp"
#include "server/http/request_id.hpp"
#include "server/metrics/metrics.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/task_executor.hpp"
#include "server/transport/connections.hpp"
#include "server/transport/http/http_session.hpp"
#include "server/transport/websocket/websocket_session.hpp"

namespace windsplat::transport {

struct ServerParts {
  ServerParts(api::ServerOptions server_options, std::shared_ptr<data::Store> store,
              std::shared_ptr<ThreadPool> threads);
  ~ServerParts() { end(); }
  ServerParts(const ServerParts&) = delete;
  ServerParts& operator=(const ServerParts&) = delete;

  // Ends the threads of the executors: no reply is called after it returns.
  void end();

  Connections connections;
  api::ServerOptions options;  // base_path normalised, views set
  metrics::Metrics metrics;    // before the members that count
  access::Admission admission;
  std::atomic<bool> draining{false};
  tasks::Backend backend;
  tasks::TaskExecutor look_ups{tasks::look_up_settings};
  tasks::TaskExecutor view_io{tasks::view_io_settings};
  tasks::TaskExecutor upload_io{tasks::upload_io_settings};
  tasks::TaskExecutor unpacking{tasks::unpack_settings};
  tasks::TaskExecutor file_checks{tasks::file_check_settings};
  tasks::TaskExecutor packing{tasks::packing_settings};
  http::RequestIds request_ids;  // used by the io thread only
  const api::Router router;
  const StreamContext streams{options, backend, admission, draining, connections};
  const HttpContext http{options,  router,      admission, metrics, request_ids,
                         draining, connections, streams,   packing};
};

}  // namespace windsplat::transport
