#include "server/api/routes.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>

#include "server/api/operations/operations.hpp"
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

using documents::Kind;
using DocumentsPtr = std::shared_ptr<documents::Documents>;

// Handlers of the documents of the API.
Handler description(const std::shared_ptr<documents::Documents>& documents, documents::Kind kind) {
  return
      [documents, kind](const PathValues&, const http::Request& request, const http::Reply& reply) {
        reply(get_description(*documents, kind, request));
      };
}

std::vector<documents::Entry> entries_of(const std::vector<Route>& table) {
  std::vector<documents::Entry> out;
  out.reserve(table.size());
  for (const Route& route : table) out.push_back({route.method, route.path, route.operation});
  return out;
}

constexpr frame::Format jpeg = frame::Format::jpeg;
constexpr frame::Format png = frame::Format::png;
constexpr frame::Format npy = frame::Format::npy;
constexpr frame::Format pdf = frame::Format::pdf;
constexpr frame::Format svg = frame::Format::svg;
constexpr ValuesFormat values_npy = ValuesFormat::npy;
constexpr ValuesFormat values_json = ValuesFormat::json;
constexpr const char* frame_name = "/v1/datasets/{id}/frame";
constexpr const char* view_frame_name = "/v1/views/{id}/frame";

std::vector<Route> service_routes(const ServerOptions& options, const std::atomic<bool>& draining,
                                  tasks::Backend& backend, const DocumentsPtr& described) {
  metrics::Metrics& metrics = backend.metrics;
  tasks::Catalogue& catalogue = backend.catalogue;
  return {
      Route{"GET", "/livez", operations::read_live(), at_once(get_livez), Charge::none,
            Place::root},
      Route{"GET", "/readyz", operations::read_ready(), at_once(get_readyz, draining), Charge::none,
            Place::root},
      Route{"GET", "/metrics", operations::read_metrics(), at_once(get_metrics, metrics, catalogue),
            Charge::none, Place::root},

      Route{"GET", "/view.schema.json", operations::read_view_schema(), at_once(get_view_schema)},
      Route{"GET", "/problems", operations::list_problem_types(),
            at_once(get_problem_types, options.base_path)},
      Route{"GET", "/problems/{type}", operations::read_problem_type(),
            at_once(get_problem_type, options.base_path)},
      Route{"GET", "/v1", operations::read_service(), at_once(get_service, options)},
      Route{"GET", "/v1/colormaps", operations::read_color_maps(), at_once(get_color_maps)},
      Route{"GET", "/v1/presets", operations::read_presets(), at_once(get_presets)},
      Route{"GET", "/v1/openapi.json", operations::read_openapi(),
            description(described, Kind::openapi)},
      Route{"GET", "/v1/openapi.html", operations::read_openapi_page(),
            description(described, Kind::openapi_page)},
      Route{"GET", "/v1/asyncapi.json", operations::read_asyncapi(),
            description(described, Kind::asyncapi)},
      Route{"GET", "/v1/asyncapi.html", operations::read_asyncapi_page(),
            description(described, Kind::asyncapi_page)},
      Route{"GET", route_stream, operations::read_stream(), at_once(upgrade_required)},
  };
}

std::vector<Route> picture_routes(const std::string& base_path, access::Admission& admission,
                                  tasks::Backend& backend, tasks::TaskExecutor& look_ups) {
  return {
      Route{"POST", "/v1/frames", operations::draw_view(), later(post_frame, backend, admission),
            Charge::valid_picture},
      Route{"POST", "/v1/forecasts", operations::forecast_view(), later(post_forecast, backend)},
      Route{"POST", "/v1/picks", operations::pick_feature(), later(post_pick, backend),
            Charge::picture},
      Route{"POST", "/v1/references", operations::draw_reference(),
            later(post_reference, backend, admission, base_path), Charge::valid_picture},
      Route{"GET", "/v1/references/{id}", operations::read_reference(),
            at_once(get_reference, backend.references)},
      Route{"POST", "/v1/animations", operations::draw_animation(),
            later(post_animation, backend, admission, look_ups, base_path), Charge::valid_picture},
      Route{"GET", "/v1/animations/{id}", operations::read_animation(),
            at_once(get_animation, backend.animations)},
      Route{"DELETE", "/v1/animations/{id}", operations::remove_animation(),
            at_once(delete_animation, backend.animations)},
  };
}

// Pictures at addresses of their own, in every format.
std::vector<Route> frame_routes(tasks::Backend& backend, access::Admission& admission,
                                const views::SavedViews& views) {
  return {
      Route{"GET", "/v1/datasets/{id}/frame.jpg", operations::draw_dataset(jpeg),
            later(get_frame, backend, admission, jpeg), Charge::valid_picture, Place::base,
            frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.png", operations::draw_dataset(png),
            later(get_frame, backend, admission, png), Charge::valid_picture, Place::base,
            frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.npy", operations::draw_dataset(npy),
            later(get_frame, backend, admission, npy), Charge::valid_picture, Place::base,
            frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.pdf", operations::draw_dataset(pdf),
            later(get_frame, backend, admission, pdf), Charge::valid_picture, Place::base,
            frame_name},
      Route{"GET", "/v1/datasets/{id}/frame.svg", operations::draw_dataset(svg),
            later(get_frame, backend, admission, svg), Charge::valid_picture, Place::base,
            frame_name},
      Route{"GET", "/v1/views/{id}/frame.jpg", operations::draw_saved_view(jpeg),
            later(get_view_frame, backend, admission, views, jpeg), Charge::valid_picture,
            Place::base, view_frame_name},
      Route{"GET", "/v1/views/{id}/frame.png", operations::draw_saved_view(png),
            later(get_view_frame, backend, admission, views, png), Charge::valid_picture,
            Place::base, view_frame_name},
      Route{"GET", "/v1/views/{id}/frame.npy", operations::draw_saved_view(npy),
            later(get_view_frame, backend, admission, views, npy), Charge::valid_picture,
            Place::base, view_frame_name},
      Route{"GET", "/v1/views/{id}/frame.pdf", operations::draw_saved_view(pdf),
            later(get_view_frame, backend, admission, views, pdf), Charge::valid_picture,
            Place::base, view_frame_name},
      Route{"GET", "/v1/views/{id}/frame.svg", operations::draw_saved_view(svg),
            later(get_view_frame, backend, admission, views, svg), Charge::valid_picture,
            Place::base, view_frame_name},
  };
}

std::vector<Route> view_routes(const ServerOptions& options, tasks::TaskExecutor& view_io) {
  views::SavedViews& views = *options.views;
  const std::string& base_path = options.base_path;
  return {
      Route{"POST", "/v1/views", operations::save_view(),
            later(post_saved_view, views, view_io, base_path)},
      Route{"GET", "/v1/views/{id}", operations::read_view(), at_once(get_view, views)},
      Route{"PUT", "/v1/views/{id}", operations::replace_view(), later(put_view, views, view_io)},
      Route{"PATCH", "/v1/views/{id}", operations::patch_view(), later(patch_view, views, view_io)},
      Route{"DELETE", "/v1/views/{id}", operations::remove_view(),
            later(delete_view, views, view_io)},
  };
}

std::vector<Route> dataset_routes(const ServerOptions& options, tasks::Backend& backend,
                                  tasks::TaskExecutor& look_ups) {
  tasks::Catalogue& catalogue = backend.catalogue;
  tasks::TaskExecutor& loads = backend.loads;
  tasks::Jobs& jobs = backend.jobs;
  return {
      Route{"GET", "/v1/jobs", operations::list_jobs(), at_once(get_jobs, jobs, options.base_path)},
      Route{"GET", "/v1/jobs/{id}", operations::read_job(),
            at_once(get_job, jobs, options.base_path)},
      Route{"DELETE", "/v1/jobs/{id}", operations::cancel_job(), at_once(delete_job, jobs)},

      Route{"GET", "/v1/files", operations::list_files(), later(get_files, options, look_ups)},
      Route{"GET", "/v1/datasets", operations::list_datasets(), at_once(get_datasets, catalogue)},
      Route{"POST", "/v1/datasets", operations::open_dataset(),
            later(post_dataset, options, look_ups, backend)},
      Route{"GET", "/v1/datasets/{id}", operations::describe_dataset(),
            later(get_dataset, catalogue, loads)},
      Route{"DELETE", "/v1/datasets/{id}", operations::release_dataset(),
            at_once(delete_dataset, catalogue)},

      Route{"GET", "/v1/datasets/{id}/probe", operations::probe_fields(),
            later(get_probe, catalogue, loads), Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/histogram", operations::count_values(),
            later(get_histogram, catalogue, loads), Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/series", operations::read_series(),
            later(get_series, catalogue, loads), Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/values.npy", operations::read_values(),
            later(get_values, catalogue, loads, values_npy), Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/values.json", operations::describe_values(),
            later(get_values, catalogue, loads, values_json), Charge::picture},
      Route{"GET", "/v1/datasets/{id}/fields/{field}/range", operations::read_range(),
            later(get_range, backend), Charge::picture},
      Route{"POST", "/v1/datasets/{id}/fields/{field}/range", operations::read_range_in_view(),
            later(post_range, backend), Charge::picture},
  };
}

std::vector<Route> upload_routes(const ServerOptions& options, const UploadThreads& threads,
                                 tasks::Catalogue& catalogue) {
  std::vector<Route> rows{
      Route{"GET", "/v1/uploads/{id}", operations::read_upload(), at_once(get_upload, options)},
      Route{"PUT", "/v1/uploads/{id}", operations::upload_file(),
            [](const PathValues&, const http::Request& request, const http::Reply& reply) {
              request.sink->answer(request, reply);
            }},
  };
  rows.back().open_sink = [&options, threads](const PathValues& values,
                                              const http::Request& request, std::uint64_t bytes) {
    return receive_upload(options, threads, values[0], request, bytes);
  };
  rows.push_back(Route{"DELETE", "/v1/uploads/{id}", operations::remove_upload(),
                       later(delete_upload, options, threads.disk, catalogue)});
  return rows;
}

}  // namespace

std::vector<Route> routes(const ServerOptions& options, const std::atomic<bool>& draining,
                          access::Admission& admission, tasks::Backend& backend,
                          tasks::TaskExecutor& look_ups, tasks::TaskExecutor& view_io,
                          const UploadThreads& uploads) {
  const DocumentsPtr described = documents_of(options);
  std::vector<Route> table;
  for (auto part : {service_routes(options, draining, backend, described),
                    picture_routes(options.base_path, admission, backend, look_ups),
                    frame_routes(backend, admission, *options.views), view_routes(options, view_io),
                    dataset_routes(options, backend, look_ups),
                    upload_routes(options, uploads, backend.catalogue)}) {
    std::move(part.begin(), part.end(), std::back_inserter(table));
  }
  described->describe(entries_of(table));
  return table;
}

}  // namespace windsplat::api
