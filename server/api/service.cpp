// Service index, health, metrics, colormaps and presets.
#include <memory>
#include <utility>

#include "protocol/codec.hpp"
#include "server/api/embedded_schemas.hpp"
#include "server/api/resources.hpp"
#include "server/data/model/digest.hpp"
#include "server/http/gzip.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/presets.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::api {
namespace {

constexpr int legend_colors = 64;

// A page of an origin that is not allowed cannot read the answer, but learns that there is one, so
// that it can tell a server that is down from one that refuses the page.
http::Response health(int status, const char* state) {
  http::Response response;
  response.status = status;
  response.content_type = "application/json";
  response.headers = {{"Cache-Control", "no-store"},
                      {"Cross-Origin-Resource-Policy", "cross-origin"}};
  response.body = http::Body::of(protocol::encode_health(state));
  return response;
}

}  // namespace

http::Response json_response(std::string json) {
  http::Response response;
  response.content_type = "application/json";
  response.headers = {{"Cache-Control", "no-store"}};
  response.body = http::Body::of(std::move(json));
  return response;
}

bool is_json(std::string_view content_type) {
  return http::equal_without_case(http::split_list(content_type, ';')[0], "application/json");
}

bool is_merge_patch(std::string_view content_type) {
  return http::equal_without_case(http::split_list(content_type, ';')[0],
                                  "application/merge-patch+json");
}

void run_later(tasks::TaskExecutor& executor, const http::Request& request, http::Reply reply,
               const char* what, const data::Dataset* of, std::function<http::Response()> make) {
  const auto answer = std::make_shared<const http::Reply>(std::move(reply));
  const CancelToken cancel = request.cancel;
  const auto run = [what, make = std::move(make), cancel, answer, id = request.id] {
    auto response = tasks::run_guarded<http::Response>(what, cancel, make, id);
    (*answer)(response ? std::move(*response) : http::problem_response(response.error()));
  };
  const auto queued = executor.submit(
      {cancel, run, false, of == nullptr ? nullptr : of->shared_info(), request.address});
  if (!queued) (*answer)(http::problem_response(queued.error()));
}

std::string etag_of(std::string_view text) {
  const std::string first = data::digest_of(text);
  // The second half is computed from the first, so that a collision of the first does not imply one
  // of the second.
  return '"' + first + data::digest_of(first + std::string(text)) + '"';
}

http::Response tagged_response(const http::Request& request, std::string_view content_type,
                               std::string_view content) {
  http::Response response;
  const std::string etag = etag_of(content);
  // The coding is chosen when the answer is sent; the tag of a 304 is that of the client's form.
  const auto known =
      http::known_etag(request.header("If-None-Match"), request.header("Accept-Encoding"), etag);
  response.headers = {
      {"Cache-Control", "no-cache"}, {"ETag", known.value_or(etag)}, {"Vary", "Accept-Encoding"}};
  if (known) {
    response.status = 304;
    return response;
  }
  response.content_type = content_type;
  response.body = http::Body::of(std::string(content));
  return response;
}

http::Response get_livez() { return health(200, "live"); }

http::Response get_readyz(const std::atomic<bool>& draining) {
  return draining ? health(503, "draining") : health(200, "ready");
}

http::Response get_metrics(const metrics::Metrics& metrics, const tasks::Catalogue& catalogue) {
  http::Response response;
  response.content_type = "text/plain; version=0.0.4; charset=utf-8";
  response.headers = {{"Cache-Control", "no-store"}};
  response.body = http::Body::of(metrics.text(catalogue.store().counts()));
  return response;
}

http::Response get_service(const ServerOptions& options) {
  protocol::ServiceDescription service;
  service.version = WINDSPLAT_VERSION;
  service.limits = options.published_limits();
  const std::string& base = options.base_path;
  service.links = {{"page", base},
                   {"datasets", base + "v1/datasets"},
                   {"frames", base + "v1/frames"},
                   {"references", base + "v1/references"},
                   {"animations", base + "v1/animations"},
                   {"forecasts", base + "v1/forecasts"},
                   {"picks", base + "v1/picks"},
                   {"views", base + "v1/views"},
                   {"jobs", base + "v1/jobs"},
                   {"colormaps", base + "v1/colormaps"},
                   {"presets", base + "v1/presets"},
                   {"stream", base + "v1/stream"},
                   {"viewSchema", base + "view.schema.json"},
                   {"openapi", base + "v1/openapi.json"},
                   {"openapiPage", base + "v1/openapi.html"},
                   {"asyncapi", base + "v1/asyncapi.json"},
                   {"asyncapiPage", base + "v1/asyncapi.html"},
                   {"livez", base + "livez"},
                   {"readyz", base + "readyz"},
                   {"metrics", base + "metrics"}};
  http::Response response = json_response(protocol::encode_service(service));
  response.headers.emplace_back("Link", description_links(base));
  return response;
}

http::Response get_color_maps() {
  std::vector<protocol::ColorMapDescription> maps;
  for (const scene::ColorMap& map : scene::color_maps()) {
    maps.push_back({map.name, map.kind, scene::color_map_srgb(map.name, legend_colors)});
  }
  return json_response(protocol::encode_color_maps(maps));
}

http::Response get_presets() {
  return json_response(protocol::encode_presets(scene::preset_names()));
}

http::Response get_view_schema(const http::Request& request) {
  return tagged_response(request, "application/schema+json", view_schema_json());
}

http::Response get_datasets(const tasks::Catalogue& catalogue) {
  const auto list = catalogue.list();
  if (!list) return http::problem_response(list.error());
  return json_response(protocol::encode_dataset_list(*list));
}

void get_dataset(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
                 const http::Request& request, http::Reply reply) {
  const auto dataset = catalogue.find(id);
  if (!dataset) {
    reply(http::problem_response(make_error(ErrorKind::not_found, dataset.error().message)));
    return;
  }
  run_later(loads, request, std::move(reply), "a description", dataset->get(),
            [&catalogue, id, cancel = request.cancel]() -> http::Response {
              const auto description = catalogue.describe(id, cancel);
              return description ? json_response(protocol::encode_dataset(*description))
                                 : http::problem_response(description.error());
            });
}

}  // namespace windsplat::api
