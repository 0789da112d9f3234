// Dispatches by the table of routes; replies to unknown paths and methods.
#include "server/api/router.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/api/resources.hpp"
#include "server/api/routes.hpp"
#include "server/base/log.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {
namespace {

using Segments = std::vector<std::string>;

// The segments of a path as routes() states it.
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

// The routes of one path, and the values of its placeholders.
struct Resource {
  const char* name = route_other;
  std::vector<Route> routes;
  PathValues values;

  [[nodiscard]] std::string allow() const {
    std::string methods;
    for (const Route& route : routes) {
      methods += route.method;
      methods += route.method == std::string_view("GET") ? ", HEAD, " : ", ";
    }
    return methods + "OPTIONS";
  }
  [[nodiscard]] const Route* find(const std::string& method) const {
    for (const Route& route : routes) {
      if (method == route.method) return &route;
      if (method == "HEAD" && route.method == std::string_view("GET")) return &route;
    }
    return nullptr;
  }
};

// Files of the page. Links to them may have query parameters added by other sites.
std::optional<Resource> find_page(const Segments& path) {
  std::string file;
  for (const std::string& segment : path) file += (file.empty() ? "" : "/") + segment;
  if (path.empty()) file = "index.html";
  if (!has_page(file)) return std::nullopt;
  const auto get = [](Services& /*services*/, const PathValues& values,
                      const http::Request& request,
                      const http::Reply& reply) { reply(get_page(request, values[0])); };
  return Resource{route_page, {{"GET", "", get, Query::taken}}, {std::move(file)}};
}

std::optional<Resource> find_resource(const http::Request& request) {
  Resource found;
  for (const Route& route : routes()) {
    if (route.place == Place::base && !request.below_base) continue;
    PathValues values;
    if (!matches(route.path, request.path, values)) continue;
    found.name = route.name;
    found.routes.push_back(route);
    found.values = std::move(values);
  }
  if (!found.routes.empty()) return found;
  if (!request.below_base) return std::nullopt;
  return find_page(request.path);
}

http::Response method_not_allowed(const std::string& method, const std::string& allow) {
  http::Response response = http::problem_response(
      405, "Method Not Allowed", method + " is not allowed here; allowed methods: " + allow);
  response.headers.emplace_back("Allow", allow);
  return response;
}

// Redirects "/a" to "/a/": relative links of the page need the slash.
bool lacks_slash(const Services& services, const http::Request& request) {
  return request.below_base && request.path.empty() && !request.ends_in_slash &&
         services.options.base_path != "/";
}

std::optional<http::Response> refused_by_quota(Services& services, const Route& route,
                                               const http::Request& request) {
  if (route.charge != Charge::picture) return std::nullopt;
  return services.admission.picture(request.address);
}

void answer(Services& services, const http::Request& request,
            const std::optional<Resource>& resource, const http::Reply& reply) {
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
  } else if (lacks_slash(services, request)) {
    reply({308, "", {{"Location", services.options.base_path}}, {}});
  } else if (route->query == Query::refused && !request.query.empty()) {
    const auto unknown = http::QueryReader(request.query).finish();
    reply(http::problem_response(unknown.error()));
  } else if (auto refusal = refused_by_quota(services, *route, request)) {
    reply(std::move(*refusal));
  } else {
    route->handler(services, resource->values, request, reply);
  }
}

}  // namespace

bool names_health(const http::Request& request) {
  return request.path.size() == 1 &&
         std::any_of(routes().begin(), routes().end(), [&](const Route& route) {
           return route.place == Place::root && route.path + 1 == request.path[0];
         });
}

bool names_stream(const http::Request& request) {
  return request.below_base && request.path == Segments{"v1", "stream"};
}

const char* route(Services& services, const http::Request& request, const http::Reply& reply) {
  const auto resource = find_resource(request);
  if (services.draining && !names_health(request)) {
    reply(http::problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
  } else {
    answer(services, request, resource, reply);
  }
  return resource ? resource->name : route_other;
}

}  // namespace windsplat::api
