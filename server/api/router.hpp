// Maps requests to resources. Resources reply at once or, after a render job, later.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/access/admission.hpp"
#include "server/api/routes.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::api {

// The name by which preflights (http/cors.hpp) are counted, of whatever path.
inline constexpr const char* route_preflight = "preflight";

// Whether the path identifies the stream.
bool names_stream(const http::Request& request);

class Router {
 public:
  // While `draining` only health is answered. The references outlive the router.
  Router(std::vector<Route> routes, const ServerOptions& options, access::Admission& admission,
         const std::atomic<bool>& draining);

  // Whether the path is answered under any load: /livez, /readyz, /metrics.
  [[nodiscard]] bool names_health(const http::Request& request) const;
  // The route name (routes.hpp), whether or not the request is refused.
  [[nodiscard]] const char* name_of(const http::Request& request) const;
  // Calls `reply` once: now, or later from the renderer's thread. Does not throw after the reply.
  void route(const http::Request& request, const http::Reply& reply) const;
  // Where the body of the request goes, of which only the header has been received; neither sink
  // nor refusal: it is read as a whole. A long body is refused here if the method is not allowed.
  [[nodiscard]] StreamedBody stream_body(const http::Request& request, std::uint64_t bytes) const;
  // All values of name_of(), without repetition: a bounded set.
  [[nodiscard]] std::vector<const char*> route_names() const;

 private:
  struct Resource;
  [[nodiscard]] std::optional<Resource> find(const http::Request& request) const;
  void answer(const http::Request& request, const std::optional<Resource>& resource,
              const http::Reply& reply) const;

  const std::vector<Route> routes_;
  const Route page_;  // files of the page
  const std::string& base_path_;
  access::Admission& admission_;
  const std::atomic<bool>& draining_;
};

}  // namespace windsplat::api
