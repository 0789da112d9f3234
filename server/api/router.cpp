// Dispatches by path segments and method; replies to unknown paths and methods.
#include "server/api/router.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "server/api/resources.hpp"
#include "server/api/routes.hpp"
#include "server/base/log.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::net {
namespace {

using Handler = std::function<void(const Request&, Reply)>;

// A matched resource with its handlers by method.
struct Resource {
  const char* name = route_other;  // one of route_names
  Handler get = nullptr;           // HEAD too
  Handler post = nullptr;
  Handler put = nullptr;
  Handler patch = nullptr;
  Handler remove = nullptr;
  bool takes_query = false;

  [[nodiscard]] std::string allow() const {
    std::string methods = get ? "GET, HEAD, " : "";
    if (post) methods += "POST, ";
    if (put) methods += "PUT, ";
    if (patch) methods += "PATCH, ";
    if (remove) methods += "DELETE, ";
    return methods + "OPTIONS";
  }
  [[nodiscard]] const Handler* handler(const std::string& method) const {
    const Handler* found = nullptr;
    if (method == "GET" || method == "HEAD") found = &get;
    if (method == "POST") found = &post;
    if (method == "PUT") found = &put;
    if (method == "PATCH") found = &patch;
    if (method == "DELETE") found = &remove;
    return found != nullptr && *found ? found : nullptr;
  }
};

using Segments = std::vector<std::string>;

template <class Make>
Handler now(Make make) {
  return [make = std::move(make)](const Request& request, const Reply& reply) {
    reply(make(request));
  };
}

Handler later(Services& services, void (*answer)(Services&, const Request&, Reply)) {
  return [&services, answer](const Request& request, Reply reply) {
    answer(services, request, std::move(reply));
  };
}

// Cheap queries are refused to the same addresses as pictures.
Handler require_quota(Services& services, Handler handler) {
  return [&services, handler = std::move(handler)](const Request& request, Reply reply) {
    auto refusal = services.admission.picture(request.address);
    refusal ? reply(std::move(*refusal)) : handler(request, std::move(reply));
  };
}

template <class Make>
Resource at_once(const char* name, Make make) {
  return {name, now(std::move(make))};
}

std::optional<Resource> find_health(Services& services, const Segments& path) {
  if (path.size() != 1) return std::nullopt;
  if (path[0] == "livez") return at_once("/livez", [](const Request&) { return get_livez(); });
  if (path[0] == "readyz") {
    return at_once("/readyz", [&services](const Request&) { return get_readyz(services); });
  }
  if (path[0] == "metrics") {
    return at_once("/metrics", [&services](const Request&) { return get_metrics(services); });
  }
  return std::nullopt;
}

Resource dataset_resource(Services& services, const std::string& id) {
  Resource dataset{"/v1/datasets/{id}"};
  dataset.get = [&services, id](const Request& request, Reply reply) {
    const auto unknown = QueryReader(request.query).finish();
    if (!unknown) {
      reply(problem_response(unknown.error()));
    } else {
      get_dataset(services, id, request, std::move(reply));
    }
  };
  dataset.remove = now(
      [&services, id](const Request& request) { return delete_dataset(services, id, request); });
  dataset.takes_query = true;
  return dataset;
}

// /v1/datasets/{id}/fields/{field}/...
std::optional<Resource> find_field(Services& services, const Segments& path) {
  using Get = void (*)(Services&, const std::string&, const std::string&, const Request&, Reply);
  if (path.size() != 6 || path[3] != "fields") return std::nullopt;
  struct Kind {
    std::string_view last;
    const char* name;
    Get get;
  };
  static constexpr std::array<Kind, 3> kinds{
      Kind{"histogram", "/v1/datasets/{id}/fields/{field}/histogram", get_histogram},
      Kind{"series", "/v1/datasets/{id}/fields/{field}/series", get_series},
      Kind{"range", "/v1/datasets/{id}/fields/{field}/range", get_range}};
  const auto* const kind = std::find_if(kinds.begin(), kinds.end(),
                                        [&](const Kind& known) { return known.last == path[5]; });
  if (kind == kinds.end()) return std::nullopt;
  Resource field{kind->name};
  field.get = require_quota(services, [&services, get = kind->get, id = path[2], name = path[4]](
                                          const Request& request, Reply reply) {
    get(services, id, name, request, std::move(reply));
  });
  field.takes_query = true;
  return field;
}

std::optional<Resource> find_dataset(Services& services, const Segments& path) {
  const std::string& id = path[2];
  if (path.size() == 3) return dataset_resource(services, id);
  if (path.size() != 4) return find_field(services, path);
  Resource resource;
  resource.takes_query = true;
  if (path[3] == "probe") {
    resource.name = "/v1/datasets/{id}/probe";
    resource.get = require_quota(services, [&services, id](const Request& request, Reply reply) {
      get_probe(services, id, request, std::move(reply));
    });
    return resource;
  }
  const auto format = format_of_suffix(path[3]);
  if (!format) return std::nullopt;
  resource.name = "/v1/datasets/{id}/frame";
  resource.get = [&services, id, format](const Request& request, Reply reply) {
    get_frame(services, id, *format, request, std::move(reply));
  };
  return resource;
}

Resource datasets_resource(Services& services) {
  Resource datasets =
      at_once("/v1/datasets", [&services](const Request&) { return get_datasets(services); });
  datasets.post = later(services, post_dataset);
  return datasets;
}

std::optional<Resource> find_jobs(Services& services, const Segments& path) {
  if (path.size() == 2) {
    return at_once("/v1/jobs", [&services](const Request&) { return get_jobs(services); });
  }
  if (path.size() != 3) return std::nullopt;
  const std::string& id = path[2];
  Resource job{"/v1/jobs/{id}"};
  job.get = now([&services, id](const Request&) { return get_job(services, id); });
  job.remove = now([&services, id](const Request&) { return delete_job(services, id); });
  return job;
}

Resource view_resource(Services& services, const std::string& id) {
  using Answer = void (*)(Services&, const std::string&, const Request&, Reply);
  const auto of_view = [&services, &id](Answer answer) {
    return [&services, id, answer](const Request& request, Reply reply) {
      answer(services, id, request, std::move(reply));
    };
  };
  Resource view{"/v1/views/{id}"};
  view.get =
      now([&services, id](const Request& request) { return get_view(services, id, request); });
  view.put = of_view(put_view);
  view.patch = of_view(patch_view);
  view.remove = of_view(delete_view);
  return view;
}

// Saved views are not listed: knowledge of an id grants write access.
std::optional<Resource> find_posted(Services& services, const std::string& name) {
  struct Kind {
    std::string_view last;
    const char* name;
    void (*post)(Services&, const Request&, Reply);
  };
  static constexpr std::array<Kind, 4> kinds{Kind{"frames", "/v1/frames", post_frame},
                                             Kind{"forecasts", "/v1/forecasts", post_forecast},
                                             Kind{"references", "/v1/references", post_reference},
                                             Kind{"views", "/v1/views", post_saved_view}};
  const auto* const kind = std::find_if(kinds.begin(), kinds.end(),
                                        [&](const Kind& known) { return known.last == name; });
  if (kind == kinds.end()) return std::nullopt;
  Resource posted{kind->name};
  posted.post = later(services, kind->post);
  return posted;
}

std::optional<Resource> find_api(Services& services, const Segments& path) {
  if (path.size() == 1) {
    return at_once("/v1", [&services](const Request&) { return get_service(services); });
  }
  const std::string& name = path[1];
  if (name == "datasets" && path.size() > 2) return find_dataset(services, path);
  if (name == "jobs") return find_jobs(services, path);
  if (name == "views" && path.size() == 3) return view_resource(services, path[2]);
  if (name == "references" && path.size() == 3) {
    return at_once("/v1/references/{id}", [&services, picture = path[2]](const Request& request) {
      return get_reference(services, picture, request);
    });
  }
  if (path.size() != 2) return std::nullopt;
  if (name == "datasets") return datasets_resource(services);
  if (name == "colormaps") {
    return at_once("/v1/colormaps", [](const Request&) { return get_color_maps(); });
  }
  if (name == "presets") {
    return at_once("/v1/presets", [](const Request&) { return get_presets(); });
  }
  if (name == "stream") {
    return at_once(route_stream, [](const Request&) {
      Response response = problem_response(426, "Upgrade Required",
                                           "this resource is a WebSocket: send an upgrade request");
      response.headers.emplace_back("Upgrade", "websocket");
      return response;
    });
  }
  return find_posted(services, name);
}

std::optional<Resource> find_page(const Segments& path) {
  std::string name;
  for (const std::string& segment : path) name += (name.empty() ? "" : "/") + segment;
  if (!has_page(name)) return std::nullopt;
  // Links to the page may have query parameters added by other sites.
  Resource page{route_page};
  page.get = now([name](const Request& request) { return get_page(request, name); });
  page.takes_query = true;
  return page;
}

std::optional<Resource> find_resource(Services& services, const Request& request) {
  const Segments& path = request.path;
  if (auto health = find_health(services, path)) return health;
  if (!request.below_base) return std::nullopt;
  if (path.empty()) return find_page({"index.html"});
  if (path[0] == "v1") return find_api(services, path);
  if (path == Segments{"view.schema.json"}) {
    return at_once("/view.schema.json", get_view_schema);
  }
  return find_page(path);
}

Response method_not_allowed(const std::string& method, const std::string& allow) {
  Response response = problem_response(405, "Method Not Allowed",
                                       method + " is not allowed here; allowed methods: " + allow);
  response.headers.emplace_back("Allow", allow);
  return response;
}

// Redirects "/a" to "/a/": relative links of the page need the slash.
bool lacks_slash(const Services& services, const Request& request) {
  return request.below_base && request.path.empty() && !request.ends_in_slash &&
         services.options.base_path != "/";
}

void answer(Services& services, const Request& request, const std::optional<Resource>& resource,
            const Reply& reply) {
  if (request.method == "OPTIONS" && !request.below_base && request.path == Segments{"*"}) {
    reply({204, "", {{"Allow", "GET, HEAD, POST, PUT, PATCH, DELETE, OPTIONS"}}, {}});
    return;
  }
  if (!resource) {
    reply(problem_response(make_error(ErrorKind::not_found, "unknown path")));
    return;
  }
  const std::string allow = resource->allow();
  const Handler* handler = resource->handler(request.method);
  if (request.method == "OPTIONS") {
    reply({204, "", {{"Allow", allow}}, {}});
  } else if (handler == nullptr) {
    reply(method_not_allowed(request.method, allow));
  } else if (lacks_slash(services, request)) {
    reply({308, "", {{"Location", services.options.base_path}}, {}});
  } else if (!resource->takes_query && !request.query.empty()) {
    const auto unknown = QueryReader(request.query).finish();
    reply(problem_response(unknown.error()));
  } else {
    (*handler)(request, reply);
  }
}

}  // namespace

bool names_health(const Request& request) {
  const Segments& path = request.path;
  return path.size() == 1 && (path[0] == "livez" || path[0] == "readyz" || path[0] == "metrics");
}

bool names_stream(const Request& request) {
  return request.below_base && request.path == Segments{"v1", "stream"};
}

const char* route(Services& services, const Request& request, const Reply& reply) {
  const auto resource = find_resource(services, request);
  if (services.draining && !names_health(request)) {
    reply(problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
  } else {
    answer(services, request, resource, reply);
  }
  return resource ? resource->name : route_other;
}

}  // namespace windsplat::net
