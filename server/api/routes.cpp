#include "server/api/routes.hpp"

#include <type_traits>
#include <utility>

#include "server/api/resources.hpp"
#include "server/http/problem.hpp"

namespace windsplat::api {
namespace {

http::Response upgrade_required() {
  http::Response response = http::problem_response(
      426, "Upgrade Required", "this resource is a WebSocket: send an upgrade request");
  response.headers.emplace_back("Upgrade", "websocket");
  return response;
}

// Handlers that answer at once. The parts outlive them.
template <class Respond, class... Parts>
Handler at_once(Respond respond, Parts&... parts) {
  return [respond, &parts...](const PathValues& values, const http::Request& request,
                              const http::Reply& reply) {
    if constexpr (std::is_invocable_v<Respond, Parts&...>) {
      reply(respond(parts...));
    } else if constexpr (std::is_invocable_v<Respond, Parts&..., const http::Request&>) {
      reply(respond(parts..., request));
    } else if constexpr (std::is_invocable_v<Respond, Parts&..., const std::string&>) {
      reply(respond(parts..., values[0]));
    } else {
      reply(respond(parts..., values[0], request));
    }
  };
}

// Handlers that may reply later.
template <class Handle, class... Parts>
Handler later(Handle handle, Parts&... parts) {
  return [handle, &parts...](const PathValues& values, const http::Request& request,
                             const http::Reply& reply) {
    if constexpr (std::is_invocable_v<Handle, Parts&..., const http::Request&, http::Reply>) {
      handle(parts..., request, reply);
    } else if constexpr (std::is_invocable_v<Handle, Parts&..., const std::string&,
                                             const http::Request&, http::Reply>) {
      handle(parts..., values[0], request, reply);
    } else {
      handle(parts..., values[0], values[1], request, reply);
    }
  };
}

constexpr frame::Format jpeg = frame::Format::jpeg;
constexpr frame::Format png = frame::Format::png;
constexpr frame::Format npy = frame::Format::npy;
constexpr frame::Format pdf = frame::Format::pdf;
constexpr frame::Format svg = frame::Format::svg;
constexpr const char* frame_name = "/v1/datasets/{id}/frame";

}  // namespace

std::vector<Route> routes(const ServerOptions& options, const std::atomic<bool>& draining,
                          access::Admission& admission, tasks::Backend& backend,
                          tasks::TaskExecutor& look_ups, tasks::TaskExecutor& view_io) {
  tasks::Catalogue& catalogue = backend.catalogue;
  tasks::TaskExecutor& loads = backend.loads;
  tasks::Jobs& jobs = backend.jobs;
  metrics::Metrics& metrics = backend.metrics;
  views::SavedViews& views = *options.views;
  const std::string& base_path = options.base_path;
  return {
      Route{"GET", "/livez", at_once(get_livez), {}, {}, Place::root},
      Route{"GET", "/readyz", at_once(get_readyz, draining), {}, {}, Place::root},
      Route{"GET", "/metrics", at_once(get_metrics, metrics, catalogue), {}, {}, Place::root},

      Route{"GET", "/view.schema.json", at_once(get_view_schema)},
      Route{"GET", "/v1", at_once(get_service, options)},
      Route{"GET", "/v1/colormaps", at_once(get_color_maps)},
      Route{"GET", "/v1/presets", at_once(get_presets)},
      Route{"GET", route_stream, at_once(upgrade_required)},

      Route{"POST", "/v1/frames", later(post_frame, backend, admission), Query::taken,
            Charge::valid_picture},
      Route{"POST", "/v1/forecasts", later(post_forecast, backend)},
      Route{"POST", "/v1/picks", later(post_pick, backend), Query::taken, Charge::picture},
      Route{"POST", "/v1/references", later(post_reference, backend, admission, base_path),
            Query::refused, Charge::valid_picture},
      Route{"GET", "/v1/references/{id}", at_once(get_reference, backend.references)},

      Route{"POST", "/v1/views", later(post_saved_view, views, view_io, base_path)},
      Route{"GET", "/v1/views/{id}", at_once(get_view, views)},
      Route{"PUT", "/v1/views/{id}", later(put_view, views, view_io)},
      Route{"PATCH", "/v1/views/{id}", later(patch_view, views, view_io)},
      Route{"DELETE", "/v1/views/{id}", later(delete_view, views, view_io)},

      Route{"GET", "/v1/jobs", at_once(get_jobs, jobs)},
      Route{"GET", "/v1/jobs/{id}", at_once(get_job, jobs)},
      Route{"DELETE", "/v1/jobs/{id}", at_once(delete_job, jobs)},

      Route{"GET", "/v1/files", later(get_files, options, look_ups), Query::taken},
      Route{"GET", "/v1/datasets", at_once(get_datasets, catalogue)},
      Route{"POST", "/v1/datasets", later(post_dataset, options, look_ups, backend)},
      Route{"GET", "/v1/datasets/{id}", later(get_dataset, catalogue, loads)},
      Route{"DELETE", "/v1/datasets/{id}", at_once(delete_dataset, catalogue), Query::taken},
      Route{"GET", "/v1/datasets/{id}/frame.jpg", later(get_frame, backend, admission, jpeg),
            Query::taken, Charge::valid_picture, Place::base, frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.png", later(get_frame, backend, admission, png),
            Query::taken, Charge::valid_picture, Place::base, frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.npy", later(get_frame, backend, admission, npy),
            Query::taken, Charge::valid_picture, Place::base, frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.pdf", later(get_frame, backend, admission, pdf),
            Query::taken, Charge::valid_picture, Place::base, frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.svg", later(get_frame, backend, admission, svg),
            Query::taken, Charge::valid_picture, Place::base, frame_name},
      Route{"GET", "/v1/datasets/{id}/probe", later(get_probe, catalogue, loads), Query::taken,
            Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/histogram",
            later(get_histogram, catalogue, loads), Query::taken, Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/series", later(get_series, catalogue, loads),
            Query::taken, Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/range", later(get_range, backend),
            Query::taken, Charge::picture},
      Route{"POST",
            "/v1/datasets/{id}/fields/{field}/range",
            later(post_range, backend),
            {},
            Charge::picture},
  };
}

}  // namespace windsplat::api
