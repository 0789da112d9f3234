// Dispatches by the table of routes; replies to unknown paths and methods.
#include "server/api/router.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/limits.hpp"
#include "server/api/resources.hpp"
#include "server/base/log.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {
namespace {

using Segments = std::vector<std::string>;

// The segments of a path as written in routes().
std::vector<std::string_view> segments_of(std::string_view path) {
  std::vector<std::string_view> segments;
  for (std::size_t at = 1; at <= path.size();) {
    const std::size_t end = std::min(path.find('/', at), path.size());
    segments.push_back(path.substr(at, end - at));
    at = end + 1;
  }
  return segments;
}

bool matches(std::string_view path, const Segments& given, PathValues& values) {
  const auto segments = segments_of(path);
  if (segments.size() != given.size()) return false;
  values.clear();
  for (std::size_t n = 0; n < given.size(); ++n) {
    if (segments[n].starts_with('{')) {
      values.push_back(given[n]);
    } else if (segments[n] != given[n]) {
      return false;
    }
  }
  return true;
}

// Files of the page. Links to them may have query parameters added by other sites.
Route page_route(const ServerOptions& options) {
  return {"GET", "", Operation{.any_query = true},
          [&options](const PathValues& values, const http::Request& request,
                     const http::Reply& reply) { reply(get_page(options, values[0], request)); }};
}

std::string page_file(const Segments& path) {
  std::string file;
  for (const std::string& segment : path) file += (file.empty() ? "" : "/") + segment;
  return path.empty() ? "index.html" : file;
}

http::Response method_not_allowed(const std::string& method, const std::string& allow) {
  http::Response response = http::problem_response(
      405, "Method Not Allowed", method + " is not allowed here; allowed methods: " + allow);
  response.headers.emplace_back("Allow", allow);
  return response;
}

// Redirects "/a" to "/a/": relative links of the page need the slash.
bool lacks_slash(const std::string& base_path, const http::Request& request) {
  return request.below_base && request.path.empty() && !request.ends_in_slash && base_path != "/";
}

std::optional<http::Response> refused_by_quota(access::Admission& admission, const Route& route,
                                               const http::Request& request) {
  if (route.charge != Charge::picture) return std::nullopt;
  return admission.picture(request.address);
}

}  // namespace

// The routes of one path, and the values of its placeholders.
struct Router::Resource {
  const char* name = route_other;
  std::vector<const Route*> routes;
  PathValues values;

  [[nodiscard]] std::string allow() const {
    std::string methods;
    for (const Route* route : routes) {
      methods += route->method;
      methods += route->method == std::string_view("GET") ? ", HEAD, " : ", ";
    }
    return methods + "OPTIONS";
  }
  [[nodiscard]] const Route* find(const std::string& method) const {
    for (const Route* route : routes) {
      if (method == route->method) return route;
      if (method == "HEAD" && route->method == std::string_view("GET")) return route;
    }
    return nullptr;
  }
};

Router::Router(std::vector<Route> routes, const ServerOptions& options,
               access::Admission& admission, const std::atomic<bool>& draining)
    : routes_(std::move(routes)),
      page_(page_route(options)),
      base_path_(options.base_path),
      admission_(admission),
      draining_(draining) {}

std::optional<Router::Resource> Router::find(const http::Request& request) const {
  Resource found;
  for (const Route& route : routes_) {
    if (route.place == Place::base && !request.below_base) continue;
    PathValues values;
    if (!matches(route.path, request.path, values)) continue;
    found.name = route.name;
    found.routes.push_back(&route);
    found.values = std::move(values);
  }
  if (!found.routes.empty()) return found;
  std::string file = page_file(request.path);
  if (!request.below_base || !has_page(file)) return std::nullopt;
  return Resource{route_page, {&page_}, {std::move(file)}};
}

void Router::answer(const http::Request& request, const std::optional<Resource>& resource,
                    const http::Reply& reply) const {
  if (request.method == "OPTIONS" && !request.below_base && request.path == Segments{"*"}) {
    reply({204, "", {{"Allow", "GET, HEAD, POST, PUT, PATCH, DELETE, OPTIONS"}}, {}});
    return;
  }
  if (!resource) {
    reply(http::problem_response(make_error(ErrorKind::not_found, "unknown path")));
    return;
  }
  const std::string allow = resource->allow();
  const Route* const route = resource->find(request.method);
  if (request.method == "OPTIONS") {
    reply({204, "", {{"Allow", allow}}, {}});
  } else if (route == nullptr) {
    reply(method_not_allowed(request.method, allow));
  } else if (lacks_slash(base_path_, request)) {
    reply({308, "", {{"Location", base_path_}}, {}});
  } else if (const auto known = check_query(route->operation, request.query); !known) {
    reply(http::problem_response(known.error()));
  } else if (auto refusal = refused_by_quota(admission_, *route, request)) {
    reply(std::move(*refusal));
  } else {
    route->handler(resource->values, request, reply);
  }
}

bool Router::names_health(const http::Request& request) const {
  return request.path.size() == 1 &&
         std::any_of(routes_.begin(), routes_.end(), [&](const Route& route) {
           return route.place == Place::root && route.path + 1 == request.path[0];
         });
}

bool names_stream(const http::Request& request) {
  return request.below_base && request.path == Segments{"v1", "stream"};
}

const char* Router::name_of(const http::Request& request) const {
  const auto resource = find(request);
  return resource ? resource->name : route_other;
}

void Router::route(const http::Request& request, const http::Reply& reply) const {
  const auto resource = find(request);
  if (draining_ && !names_health(request)) {
    reply(http::problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
  } else {
    answer(request, resource, reply);
  }
}

StreamedBody Router::stream_body(const http::Request& request, std::uint64_t bytes) const {
  const auto resource = find(request);
  const Route* const route = resource ? resource->find(request.method) : nullptr;
  if (resource && route == nullptr && request.method != "OPTIONS" &&
      bytes > protocol::limits::http_body_bytes_max) {
    return {nullptr, method_not_allowed(request.method, resource->allow())};
  }
  if (route == nullptr || !route->open_sink) return {};
  if (draining_) {
    return {nullptr,
            http::problem_response(make_error(ErrorKind::draining, "the server is shutting down"))};
  }
  return route->open_sink(resource->values, request, bytes);
}

std::vector<const char*> Router::route_names() const {
  std::vector<const char*> names{route_login, route_page, route_preflight, route_other};
  for (const Route& route : routes_) {
    if (std::strcmp(names.back(), route.name) != 0) names.push_back(route.name);
  }
  return names;
}

}  // namespace windsplat::api
