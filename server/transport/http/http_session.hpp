// One HTTP connection: bytes -> checked Request -> router -> response bytes, one request at a time,
// until it is closed or upgraded to a stream.
#pragma once

#include <atomic>

#include "server/access/admission.hpp"
#include "server/api/router.hpp"
#include "server/api/server_options.hpp"
#include "server/http/request_id.hpp"
#include "server/metrics/metrics.hpp"
#include "server/tasks/task_executor.hpp"
#include "server/transport/connections.hpp"

namespace windsplat::transport {

class Wire;
struct StreamContext;

// What the HTTP sessions of a server share; outlives them.
struct HttpContext {
  const api::ServerOptions& options;
  const api::Router& router;
  access::Admission& admission;
  metrics::Metrics& metrics;
  http::RequestIds& request_ids;
  const std::atomic<bool>& draining;
  Connections& connections;
  const StreamContext& streams;  // of connections that are upgraded
  tasks::TaskExecutor& packing;  // of large answers
};

// `late`: accepted during a drain, which does not wait for it.
void start_http_session(const HttpContext& context, Wire wire, access::Visitor visitor, bool late);
// Responds to a plain HTTP request on a TLS port.
void refuse_plain_http(const HttpContext& context, Wire wire, access::Visitor visitor, bool late);

}  // namespace windsplat::transport
