// Decoded path and method -> resource; what fits no resource is answered here.
#include "server/net/router.hpp"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "server/base/log.hpp"
#include "server/net/problem.hpp"
#include "server/net/resources.hpp"
#include "server/net/target.hpp"

namespace windsplat::net {
namespace {

// Requests for pictures and descriptions that may wait at a time.
constexpr std::size_t requests_waiting_max = 16;

// A resource that was found: what it is, and how it answers.
struct Resource {
  bool takes_post = false;
  bool takes_query = false;
  std::function<void(const Request&, Reply)> answer;
};

using Segments = std::vector<std::string>;

Resource at_once(std::function<Response(const Request&)> make) {
  return {false, false, [make = std::move(make)](const Request& request, const Reply& reply) {
            reply(make(request));
          }};
}

std::optional<Resource> find_health(Services& services, const Segments& path) {
  if (path.size() != 1) return std::nullopt;
  if (path[0] == "livez") return at_once([](const Request&) { return get_livez(); });
  if (path[0] == "readyz") {
    return at_once([&services](const Request&) { return get_readyz(services); });
  }
  return std::nullopt;
}

std::optional<Resource> find_dataset(Services& services, const Segments& path) {
  const std::string& id = path[2];
  if (path.size() == 3) {
    return Resource{false, false, [&services, id](const Request& request, Reply reply) {
                      get_dataset(services, id, request, std::move(reply));
                    }};
  }
  const auto format = format_of_suffix(path[3]);
  if (path.size() != 4 || !format) return std::nullopt;
  return Resource{false, true, [&services, id, format](const Request& request, Reply reply) {
                    get_frame(services, id, *format, request, std::move(reply));
                  }};
}

std::optional<Resource> find_api(Services& services, const Segments& path) {
  if (path.size() == 1) {
    return at_once([&services](const Request&) { return get_service(services); });
  }
  const std::string& name = path[1];
  if (name == "datasets" && path.size() > 2) return find_dataset(services, path);
  if (path.size() != 2) return std::nullopt;
  if (name == "datasets") {
    return at_once([&services](const Request&) { return get_datasets(services); });
  }
  if (name == "colormaps") return at_once([](const Request&) { return get_color_maps(); });
  if (name == "presets") return at_once([](const Request&) { return get_presets(); });
  if (name == "stream") {
    return at_once([](const Request&) {
      Response response =
          problem_response(426, "Upgrade Required", "this is a WebSocket: connect to it as one");
      response.headers.emplace_back("Upgrade", "websocket");
      return response;
    });
  }
  return std::nullopt;
}

// GET of a picture is the only thing that /v1/frames does not do.
Resource frames_resource(Services& services) {
  return {true, false, [&services](const Request& request, Reply reply) {
            post_frame(services, request, std::move(reply));
          }};
}

std::optional<Resource> find_page(const Segments& path) {
  std::string name;
  for (const std::string& segment : path) name += (name.empty() ? "" : "/") + segment;
  if (!has_page(name)) return std::nullopt;
  // A link to the page may bear a query that is none of ours.
  Resource page = at_once([name](const Request& request) { return get_page(request, name); });
  page.takes_query = true;
  return page;
}

std::optional<Resource> find_resource(Services& services, const Request& request) {
  const Segments& path = request.path;
  if (auto health = find_health(services, path)) return health;
  if (!request.below_base) return std::nullopt;
  if (path.empty()) return find_page({"index.html"});
  if (path[0] == "v1") {
    if (path == Segments{"v1", "frames"}) return frames_resource(services);
    return find_api(services, path);
  }
  if (path == Segments{"view.schema.json"}) return at_once(get_view_schema);
  return find_page(path);
}

Response method_not_allowed(const std::string& method, const std::string& allow) {
  Response response = problem_response(405, "Method Not Allowed",
                                       method + " does nothing here; what does is " + allow);
  response.headers.emplace_back("Allow", allow);
  return response;
}

// "/a" for a page at "/a/": its relative links need the slash.
bool lacks_slash(const Services& services, const Request& request) {
  return request.below_base && request.path.empty() && !request.ends_in_slash &&
         services.options.base_path != "/";
}

void answer(Services& services, const Request& request, const Reply& reply) {
  if (request.method == "OPTIONS" && !request.below_base && request.path == Segments{"*"}) {
    reply({204, "", {{"Allow", "GET, HEAD, POST, OPTIONS"}}, {}});
    return;
  }
  const auto resource = find_resource(services, request);
  if (!resource) {
    reply(problem_response(make_error(ErrorKind::not_found, "there is nothing at this path")));
    return;
  }
  const std::string allow = resource->takes_post ? "POST, OPTIONS" : "GET, HEAD, OPTIONS";
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (request.method == "OPTIONS") {
    reply({204, "", {{"Allow", allow}}, {}});
  } else if (resource->takes_post ? request.method != "POST" : !reads) {
    reply(method_not_allowed(request.method, allow));
  } else if (lacks_slash(services, request)) {
    reply({308, "", {{"Location", services.options.base_path}}, {}});
  } else if (!resource->takes_query && !request.query.empty()) {
    const auto unknown = QueryReader(request.query).finish();
    reply(problem_response(unknown.error()));
  } else {
    resource->answer(request, reply);
  }
}

}  // namespace

Services::Services(ServerOptions server_options, std::shared_ptr<data::Store> store,
                   std::shared_ptr<ThreadPool> threads)
    : options(std::move(server_options)),
      catalogue(std::move(store)),
      pool(std::move(threads)),
      renderer(requests_waiting_max) {
  options.base_path = normal_base_path(options.base_path);
}

bool names_stream(const Request& request) {
  return request.below_base && request.path == Segments{"v1", "stream"};
}

void route(Services& services, const Request& request, const Reply& reply) {
  const bool health =
      request.path.size() == 1 && (request.path[0] == "livez" || request.path[0] == "readyz");
  if (services.draining && !health) {
    reply(problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
    return;
  }
  answer(services, request, reply);
}

}  // namespace windsplat::net
