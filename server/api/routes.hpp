// The table of routes: every path and method of the API, what it takes and answers, and its
// handler.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/access/admission.hpp"
#include "server/api/operations/operation.hpp"
#include "server/api/server_options.hpp"
#include "server/http/body_sink.hpp"
#include "server/http/exchange.hpp"
#include "server/tasks/backend.hpp"

namespace windsplat::api {

// Values of the placeholders of a path, in order.
using PathValues = std::vector<std::string>;
// Replies once, now or later. Does not throw after the reply.
using Handler = std::function<void(const PathValues& values, const http::Request& request,
                                   const http::Reply& reply)>;

// Where a body goes that is not read as a whole, or why it is not received.
struct StreamedBody {
  std::shared_ptr<http::BodySink> sink;
  std::optional<http::Response> refusal;
};
// `bytes`: of the body that follows.
using OpenSink = std::function<StreamedBody(const PathValues& values, const http::Request& request,
                                            std::uint64_t bytes)>;

enum class Charge {
  none,
  picture,       // counts as a picture of the address, before the handler is called
  valid_picture  // like `picture`, but counted by the handler once the view is valid
};
enum class Place {
  base,  // below the base path
  root   // also available at the root, and answered under any load
};

struct Route {
  const char* method;   // GET includes HEAD
  const char* path;     // "{...}" stands for one segment
  Operation operation;  // what it takes and answers, also in the documents of the API
  Handler handler;
  Charge charge = Charge::none;
  Place place = Place::base;
  const char* name = path;  // name by which requests are logged and counted
  OpenSink open_sink =
      nullptr;  // called once the header is received; empty: the body is read whole
};

// What works on uploads: `disk` writes parts of them and removes them, so that none waits for an
// archive.
struct UploadThreads {
  tasks::TaskExecutor& disk;
  tasks::TaskExecutor& unpacking;
};

// The table, with each handler bound to the parts of the server that it uses. In the order of
// methods that Allow states. Documented in docs/user/api.md. `look_ups` resolve posted names,
// `view_io` changes saved views.
std::vector<Route> routes(const ServerOptions& options, const std::atomic<bool>& draining,
                          access::Admission& admission, tasks::Backend& backend,
                          tasks::TaskExecutor& look_ups, tasks::TaskExecutor& view_io,
                          const UploadThreads& uploads);

// Names by which requests are counted, besides the paths of routes().
inline constexpr const char* route_stream = "/v1/stream";
inline constexpr const char* route_login = "/login";
inline constexpr const char* route_page = "page";
inline constexpr const char* route_other = "other";  // unknown or unparsed path
}  // namespace windsplat::api
