#include "server/api/routes.hpp"

#include <array>
#include <cstring>
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

// Handlers that answer at once, or need the request alone.
template <auto respond>
void at_once(Services& services, const PathValues& values, const http::Request& request,
             const http::Reply& reply) {
  if constexpr (std::is_invocable_v<decltype(respond)>) {
    reply(respond());
  } else if constexpr (std::is_invocable_v<decltype(respond), const http::Request&>) {
    reply(respond(request));
  } else if constexpr (std::is_invocable_v<decltype(respond), Services&>) {
    reply(respond(services));
  } else if constexpr (std::is_invocable_v<decltype(respond), Services&, const std::string&>) {
    reply(respond(services, values[0]));
  } else {
    reply(respond(services, values[0], request));
  }
}

// Handlers that may reply later.
template <auto handle>
void later(Services& services, const PathValues& values, const http::Request& request,
           const http::Reply& reply) {
  using Handle = decltype(handle);
  if constexpr (std::is_invocable_v<Handle, Services&, const http::Request&, http::Reply>) {
    handle(services, request, reply);
  } else if constexpr (std::is_invocable_v<Handle, Services&, const std::string&,
                                           const http::Request&, http::Reply>) {
    handle(services, values[0], request, reply);
  } else {
    handle(services, values[0], values[1], request, reply);
  }
}

template <frame::Format format>
void get_frame_as(Services& services, const PathValues& values, const http::Request& request,
                  const http::Reply& reply) {
  get_frame(services, values[0], format, request, reply);
}

constexpr const char* frame_name = "/v1/datasets/{id}/frame";

constexpr std::array table{
    Route{"GET", "/livez", at_once<get_livez>, {}, {}, Place::root},
    Route{"GET", "/readyz", at_once<get_readyz>, {}, {}, Place::root},
    Route{"GET", "/metrics", at_once<get_metrics>, {}, {}, Place::root},

    Route{"GET", "/view.schema.json", at_once<get_view_schema>},
    Route{"GET", "/v1", at_once<get_service>},
    Route{"GET", "/v1/colormaps", at_once<get_color_maps>},
    Route{"GET", "/v1/presets", at_once<get_presets>},
    Route{"GET", route_stream, at_once<upgrade_required>},

    Route{"POST", "/v1/frames", later<post_frame>, {}, Charge::valid_picture},
    Route{"POST", "/v1/forecasts", later<post_forecast>},
    Route{"POST", "/v1/references", later<post_reference>, {}, Charge::valid_picture},
    Route{"GET", "/v1/references/{id}", at_once<get_reference>},

    Route{"POST", "/v1/views", later<post_saved_view>},
    Route{"GET", "/v1/views/{id}", at_once<get_view>},
    Route{"PUT", "/v1/views/{id}", later<put_view>},
    Route{"PATCH", "/v1/views/{id}", later<patch_view>},
    Route{"DELETE", "/v1/views/{id}", later<delete_view>},

    Route{"GET", "/v1/jobs", at_once<get_jobs>},
    Route{"GET", "/v1/jobs/{id}", at_once<get_job>},
    Route{"DELETE", "/v1/jobs/{id}", at_once<delete_job>},

    Route{"GET", "/v1/datasets", at_once<get_datasets>},
    Route{"POST", "/v1/datasets", later<post_dataset>},
    Route{"GET", "/v1/datasets/{id}", later<get_dataset>},
    Route{"DELETE", "/v1/datasets/{id}", at_once<delete_dataset>, Query::taken},
    Route{"GET", "/v1/datasets/{id}/frame.jpg", get_frame_as<frame::Format::jpeg>, Query::taken,
          Charge::valid_picture, Place::base, frame_name},
    Route{"GET", "/v1/datasets/{id}/frame.png", get_frame_as<frame::Format::png>, Query::taken,
          Charge::valid_picture, Place::base, frame_name},
    Route{"GET", "/v1/datasets/{id}/frame.npy", get_frame_as<frame::Format::npy>, Query::taken,
          Charge::valid_picture, Place::base, frame_name},
    Route{"GET", "/v1/datasets/{id}/probe", later<get_probe>, Query::taken, Charge::picture},
    Route{"GET", "/v1/datasets/{id}/fields/{field}/histogram", later<get_histogram>, Query::taken,
          Charge::picture},
    Route{"GET", "/v1/datasets/{id}/fields/{field}/series", later<get_series>, Query::taken,
          Charge::picture},
    Route{"GET", "/v1/datasets/{id}/fields/{field}/range", later<get_range>, Query::taken,
          Charge::picture},
};

}  // namespace

std::span<const Route> routes() { return table; }

std::vector<const char*> route_names() {
  std::vector<const char*> names{route_login, route_page, route_other};
  for (const Route& route : table) {
    if (std::strcmp(names.back(), route.name) != 0) names.push_back(route.name);
  }
  return names;
}

}  // namespace windsplat::api
