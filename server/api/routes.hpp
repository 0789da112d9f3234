// Names of the routes in log lines and metrics: a bounded set.
#pragma once

#include <array>

namespace windsplat::net {

inline constexpr const char* route_other = "other";  // unknown or unparsed path
inline constexpr const char* route_page = "page";
inline constexpr const char* route_login = "/login";
inline constexpr const char* route_stream = "/v1/stream";

inline constexpr std::array route_names{
    "/livez",
    "/readyz",
    "/metrics",
    "/view.schema.json",
    "/v1",
    "/v1/colormaps",
    "/v1/presets",
    "/v1/frames",
    "/v1/references",
    "/v1/references/{id}",
    "/v1/forecasts",
    "/v1/views",
    "/v1/views/{id}",
    "/v1/jobs",
    "/v1/jobs/{id}",
    "/v1/datasets",
    "/v1/datasets/{id}",
    "/v1/datasets/{id}/frame",
    "/v1/datasets/{id}/probe",
    "/v1/datasets/{id}/fields/{field}/histogram",
    "/v1/datasets/{id}/fields/{field}/series",
    "/v1/datasets/{id}/fields/{field}/range",
    route_stream,
    route_login,
    route_page,
    route_other,
};

}  // namespace windsplat::net
