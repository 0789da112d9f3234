// The service itself: descriptions, health, lists that do not depend on data, the stream.
#include "server/api/operations/operations.hpp"

namespace windsplat::api::operations {
namespace {

constexpr std::string_view service_group = "Service";

Operation description(std::string_view id, std::string_view summary, std::string_view media) {
  return {
      .id = id,
      .group = service_group,
      .summary = summary,
      .answers = {{200, "The document.", media == json_media ? "object" : "", {media}, {"ETag"}},
                  not_modified()}};
}

}  // namespace

Answer json_answer(std::string_view summary, std::string_view shape) {
  return {200, summary, shape, {json_media}};
}

Answer job_answer() {
  return {202,
          "A job, whose state is that of GET /v1/jobs/{id}.",
          "job",
          {json_media},
          {"Location", "Retry-After"}};
}

RequestBody view_body(std::string_view summary) { return {"view", {json_media}, summary}; }

Answer not_modified() { return {304, "If-None-Match names what would be sent.", {}, {}, {"ETag"}}; }

Answer nothing(std::string_view summary) { return {204, summary}; }

Operation read_live() {
  return {.id = "readLive",
          .group = service_group,
          .summary = "Whether the process answers",
          .answers = {json_answer("It does.", "health")},
          .needs_no_token = true};
}

Operation read_ready() {
  return {.id = "readReady",
          .group = service_group,
          .summary = "Whether the server takes requests",
          .answers = {json_answer("It does.", "health"),
                      {503, "It is shutting down.", "health", {json_media}}},
          .needs_no_token = true};
}

Operation read_metrics() {
  return {.id = "readMetrics",
          .group = service_group,
          .summary = "Metrics in the text format of Prometheus",
          .answers = {{200, "All metrics.", {}, {"text/plain"}}}};
}

Operation read_service() {
  return {.id = "readService",
          .group = service_group,
          .summary = "Version, links and limits of the server",
          .answers = {{200,
                       "The service. Link names the descriptions (RFC 8631).",
                       "service",
                       {json_media},
                       {"Link"}}}};
}

Operation read_view_schema() {
  return {.id = "readViewSchema",
          .group = service_group,
          .summary = "JSON Schema of a view",
          .answers = {{200, "The schema.", "object", {"application/schema+json"}, {"ETag"}},
                      not_modified()}};
}

Operation list_problem_types() {
  return {.id = "listProblemTypes",
          .group = service_group,
          .summary = "The types of problems, as HTML or text",
          .description = "Needs no token.",
          .answers = {{200, "The list.", {}, {"text/plain", "text/html"}, {"Vary"}}},
          .needs_no_token = true};
}

Operation read_problem_type() {
  return {.id = "readProblemType",
          .group = service_group,
          .summary = "The page of a problem type, as HTML or text",
          .description = "The member `type` of a problem refers to it. Needs no token.",
          .answers = {{200, "The page.", {}, {"text/plain", "text/html"}, {"Vary"}}},
          .problems = {404},
          .needs_no_token = true};
}

Operation read_color_maps() {
  return {.id = "listColorMaps",
          .group = service_group,
          .summary = "Colour maps that a view can name",
          .answers = {json_answer("The maps with their colours.", "colorMaps")}};
}

Operation read_presets() {
  return {.id = "listPresets",
          .group = service_group,
          .summary = "Names of looks",
          .answers = {json_answer("The names.", "presets")}};
}

Operation read_stream() {
  return {.id = "openStream",
          .group = service_group,
          .summary = "The WebSocket of frames, subprotocol windsplat.v1",
          .description = "Its messages are described by /v1/asyncapi.json.",
          .answers = {{101, "The connection is a WebSocket.", {}, {}, {"Upgrade"}}},
          .problems = {426}};
}

Operation read_openapi() {
  return description("readOpenApi", "The description of these resources", json_media);
}

Operation read_openapi_page() {
  return description("readOpenApiPage", "The description of these resources as a page",
                     "text/html");
}

Operation read_asyncapi() {
  return description("readAsyncApi", "The description of the stream", json_media);
}

Operation read_asyncapi_page() {
  return description("readAsyncApiPage", "The description of the stream as a page", "text/html");
}

}  // namespace windsplat::api::operations
