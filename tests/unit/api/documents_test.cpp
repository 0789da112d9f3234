// OpenAPI and AsyncAPI: made from routes and schemas, with references that resolve.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/frame_header.hpp"
#include "server/api/documents/asyncapi.hpp"
#include "server/api/documents/openapi.hpp"
#include "server/api/documents/page.hpp"
#include "server/api/embedded_schemas.hpp"
#include "server/api/operations/operations.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/http/cors.hpp"

namespace windsplat::api {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;
using testing::Not;

documents::About about_of(const std::string& base_path, bool with_token = false) {
  return {"1.2.3", base_path, with_token, false, messages_schema_json(), view_schema_json()};
}

std::vector<documents::Entry> some_entries() {
  return {{"GET", "/readyz", operations::read_ready()},
          {"POST", "/v1/frames", operations::draw_view()},
          {"GET", "/v1/views/{id}", operations::read_view()},
          {"PATCH", "/v1/views/{id}", operations::patch_view()},
          {"GET", "/v1/datasets/{id}/fields/{field}/histogram", operations::count_values()}};
}

// Calls visit(reference) for each.
template <class Visit>
void each_reference(const Json& node, const Visit& visit) {
  if (node.is_object() && node.contains("$ref") && node["$ref"].is_string()) visit(node["$ref"]);
  if (!node.is_structured()) return;
  for (const Json& inner : node) each_reference(inner, visit);
}

void expect_references_to_resolve_and_components_to_be_used(const Json& document) {
  std::set<std::string> used;
  each_reference(document, [&](const std::string& reference) {
    ASSERT_TRUE(reference.starts_with("#/")) << reference;
    EXPECT_TRUE(document.contains(Json::json_pointer(reference.substr(1)))) << reference;
    used.insert(reference);
  });
  for (const auto& [kind, components] : document["components"].items()) {
    if (kind == "headers" || kind == "securitySchemes") continue;
    for (const auto& [name, component] : components.items()) {
      EXPECT_EQ(used.count("#/components/" + kind + "/" + name), 1U) << kind << ' ' << name;
    }
  }
}

TEST(OpenApi, ReferencesResolveAndEveryComponentIsUsed) {
  const Json document = Json::parse(documents::openapi(some_entries(), about_of("/")));
  expect_references_to_resolve_and_components_to_be_used(document);
  EXPECT_THAT(document.dump(), Not(HasSubstr("$defs")));
  EXPECT_THAT(document.dump(), Not(HasSubstr("schema.json\"}")));
}

TEST(OpenApi, SchemasAreThoseOfTheProtocolButForReferences) {
  const Json document = Json::parse(documents::openapi(some_entries(), about_of("/")));
  const Json file = Json::parse(messages_schema_json())["$defs"]["histogram"];
  EXPECT_EQ(document["components"]["schemas"]["Histogram"], file);
  const Json view = Json::parse(view_schema_json());
  const Json made = document["components"]["schemas"]["View"];
  EXPECT_EQ(made["properties"]["image"], view["properties"]["image"]);
  EXPECT_EQ(made["properties"].size(), view["properties"].size());
  EXPECT_EQ(document["components"]["schemas"]["Rings"], view["$defs"]["rings"]);
}

TEST(OpenApi, HasEveryRouteAndNothingElse) {
  const Json document = Json::parse(documents::openapi(some_entries(), about_of("/")));
  std::set<std::string> found;
  for (const auto& [path, methods] : document["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) found.insert(method + " " + path);
  }
  EXPECT_EQ(found, (std::set<std::string>{"get /readyz", "post /v1/frames", "get /v1/views/{id}",
                                          "patch /v1/views/{id}",
                                          "get /v1/datasets/{id}/fields/{field}/histogram"}));
}

TEST(OpenApi, ParametersHaveTheLimitsByWhichTheyAreRead) {
  const Json document = Json::parse(documents::openapi(some_entries(), about_of("/")));
  std::map<std::string, Json> found;
  const Json& get = document["paths"]["/v1/datasets/{id}/fields/{field}/histogram"]["get"];
  for (const Json& parameter : get["parameters"]) found[parameter["name"]] = parameter;
  EXPECT_EQ(found["id"]["in"], "path");
  EXPECT_EQ(found["field"]["required"], true);
  const Json& bins = found["bins"]["schema"];
  EXPECT_EQ(bins["default"], 64);
  const auto read = [](const std::string& text) {
    const http::Parameters query{{"bins", text}};
    http::QueryReader reader(query);
    const auto value = read_integer(reader, parameters::bins);
    return reader.finish().has_value() && value.has_value();
  };
  const int most = bins["maximum"];
  EXPECT_TRUE(read(std::to_string(most)));
  EXPECT_FALSE(read(std::to_string(most + 1)));
  EXPECT_TRUE(read(bins["minimum"].dump()));
  EXPECT_FALSE(read("0"));
  EXPECT_EQ(found["range"]["explode"], false);
  EXPECT_EQ(found["range"]["schema"]["maxItems"], 2);
}

TEST(OpenApi, BodiesAndAnswersHaveTheirMediaTypesAndSchemas) {
  const Json document = Json::parse(documents::openapi(some_entries(), about_of("/")));
  const Json& post = document["paths"]["/v1/frames"]["post"];
  EXPECT_EQ(post["requestBody"]["content"]["application/json"]["schema"]["$ref"],
            "#/components/schemas/View");
  EXPECT_TRUE(post["responses"]["200"]["content"].contains("image/png"));
  for (const char* status : {"304", "400", "404", "406", "411", "413", "415", "422", "429"}) {
    EXPECT_TRUE(post["responses"].contains(status)) << status;
  }
  EXPECT_FALSE(post["responses"].contains("401")) << "no token";
  const Json& patch = document["paths"]["/v1/views/{id}"]["patch"];
  EXPECT_TRUE(patch["requestBody"]["content"].contains("application/merge-patch+json"));
  EXPECT_TRUE(patch["responses"].contains("412"));
  const Json& ready = document["paths"]["/readyz"]["get"]["responses"]["503"]["content"];
  EXPECT_TRUE(ready.contains("application/json")) << "draining";
  EXPECT_TRUE(ready.contains("application/problem+json")) << "full";
  EXPECT_EQ(document["components"]["responses"]["TooManyRequests"]["headers"].count("Retry-After"),
            1U);
}

// Vary is for caches, and a script cannot upgrade a connection.
TEST(OpenApi, HeadersOfAnswersAreReadableByScriptsOfAllowedOrigins) {
  const std::string origin = "https://friend.example";
  http::Request request;
  request.headers.emplace_back("Origin", origin);
  http::Response response;
  http::share_with_origins(response, request, {origin});
  std::set<std::string> readable{"Vary", "Upgrade"};
  for (const auto& [name, value] : response.headers) {
    if (name != "Access-Control-Expose-Headers") continue;
    for (const std::string_view one : http::split_list(value, ',')) readable.emplace(one);
  }
  const Json open = Json::parse(documents::openapi(some_entries(), about_of("/", true)));
  const Json& headers = open["components"]["headers"];
  EXPECT_TRUE(headers.contains("Windsplat-Values"));
  EXPECT_TRUE(headers.contains("WWW-Authenticate"));
  for (const auto& [name, header] : headers.items()) EXPECT_TRUE(readable.contains(name)) << name;
}

TEST(OpenApi, TellsBasePathAndToken) {
  const Json open = Json::parse(documents::openapi(some_entries(), about_of("/")));
  EXPECT_EQ(open["servers"][0]["url"], "/");
  EXPECT_TRUE(open["security"].empty());
  const Json closed = Json::parse(documents::openapi(some_entries(), about_of("/a/b/", true)));
  EXPECT_EQ(closed["servers"][0]["url"], "/a/b");
  EXPECT_EQ(closed["components"]["securitySchemes"]["token"]["scheme"], "bearer");
  EXPECT_TRUE(closed["security"][0].contains("token"));
  EXPECT_TRUE(closed["paths"]["/v1/frames"]["post"]["responses"].contains("401"));
  EXPECT_FALSE(closed["paths"]["/v1/frames"]["post"].contains("security"));
  const Json& ready = closed["paths"]["/readyz"]["get"];
  EXPECT_FALSE(ready["responses"].contains("401")) << "needs no token";
  EXPECT_EQ(ready["security"], Json::array());
  EXPECT_EQ(closed["info"]["version"], "1.2.3");
}

TEST(OpenApi, QueriesThatAnOperationDoesNotHaveAreRefused) {
  const Operation operation = operations::count_values();
  EXPECT_TRUE(check_query(operation, {{"bins", "7"}, {"log", "true"}}));
  const auto unknown = check_query(operation, {{"bin", "7"}});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("known parameters: bins, range"));
  EXPECT_FALSE(check_query(operation, {{"bins", "7"}, {"bins", "7"}}));
  EXPECT_TRUE(check_query(Operation{.any_query = true}, {{"x", "1"}}));
}

TEST(AsyncApi, HasEveryMessageInItsDirection) {
  const Json document = Json::parse(documents::asyncapi(about_of("/")));
  expect_references_to_resolve_and_components_to_be_used(document);
  const auto names = [&](const char* operation) {
    std::set<std::string> out;
    for (const Json& message : document["operations"][operation]["messages"]) {
      const std::string reference = message["$ref"];
      EXPECT_TRUE(document.contains(Json::json_pointer(reference.substr(1)))) << reference;
      out.insert(reference.substr(reference.rfind('/') + 1));
    }
    return out;
  };
  EXPECT_EQ(names("receive"), (std::set<std::string>{"open", "patch", "still", "play", "pause",
                                                     "ack", "visibility", "video"}));
  EXPECT_EQ(names("send"), (std::set<std::string>{"hello", "opened", "progress", "chosen",
                                                  "unchanged", "stats", "error", "frame"}));
  EXPECT_EQ(document["channels"]["stream"]["address"], "v1/stream");
  EXPECT_EQ(document["servers"]["this"]["pathname"], "/");
}

double value_at(const std::uint8_t* bytes, std::string_view type) {
  std::uint64_t bits = 0;
  const int size = std::stoi(std::string(type.substr(1))) / 8;
  for (int n = 0; n < size; ++n) bits |= std::uint64_t{bytes[n]} << (8 * n);
  if (type == "f64") return std::bit_cast<double>(bits);
  if (type == "f32")
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  return static_cast<double>(bits);
}

TEST(AsyncApi, PartsOfTheHeaderAreWhereFramesHaveThem) {
  protocol::FrameHeader header;
  header.seq = 0x01020304;
  header.rev = 5;
  header.step = 6;
  header.flags = 7;
  header.width = 801;
  header.height = 602;
  header.codec = protocol::Codec::png;
  header.quality = 90;
  header.method = protocol::MethodCode::reference;
  header.level = 2;
  header.error = 0.25F;
  header.jpeg_error = 0.5F;
  header.queue_us = 11;
  header.render_us = 12;
  header.encode_us = 13;
  header.payload_bytes = 14;
  header.t = 1.5;
  const auto bytes = protocol::encode_frame_header(header);
  std::map<std::string, double> found;
  int end = 0;
  for (const documents::HeaderPart& part : documents::frame_header_parts()) {
    EXPECT_EQ(part.offset, end) << part.name << ": without a gap";
    end += std::stoi(std::string(part.type.substr(1))) / 8;
    found[std::string(part.name)] = value_at(bytes.data() + part.offset, part.type);
  }
  EXPECT_EQ(end, static_cast<int>(protocol::frame_header_bytes));
  EXPECT_EQ(found, (std::map<std::string, double>{
                       {"magic", 0x4c505357}, {"version", 1},       {"kind", 1},
                       {"headerBytes", 64},   {"seq", 0x01020304},  {"rev", 5},
                       {"step", 6},           {"flags", 7},         {"width", 801},
                       {"height", 602},       {"codec", 2},         {"quality", 90},
                       {"method", 3},         {"level", 2},         {"error", 0.25},
                       {"jpegError", 0.5},    {"queueUs", 11},      {"renderUs", 12},
                       {"encodeUs", 13},      {"payloadBytes", 14}, {"t", 1.5}}));
}

TEST(ApiPages, HaveEveryOperationAndMessageAndNothingFromElsewhere) {
  const std::string requests =
      documents::openapi_page(documents::openapi(some_entries(), about_of("/")));
  EXPECT_THAT(requests, HasSubstr("<html lang=\"en\">"));
  EXPECT_THAT(requests, HasSubstr("<code>POST /v1/frames</code>"));
  EXPECT_THAT(requests, Not(HasSubstr("/v1/picks</code>"))) << "none of these routes";
  const std::string stream = documents::asyncapi_page(documents::asyncapi(about_of("/")));
  EXPECT_THAT(stream, HasSubstr("<h3 id=\"message-patch\">"));
  EXPECT_THAT(stream, HasSubstr("<code>jpegError</code>"));
  EXPECT_THAT(stream, HasSubstr("the key <code>type</code>"));
  for (const std::string& page : {requests, stream}) {
    EXPECT_THAT(page, Not(HasSubstr("<script")));
    EXPECT_THAT(page, Not(HasSubstr("://")));
    EXPECT_THAT(page, Not(HasSubstr("style=\"")));
    EXPECT_THAT(page, HasSubstr("<style>" + std::string(documents::page_style()) + "</style>"));
    // Each link within the page leads somewhere.
    for (std::size_t at = page.find("href=\"#"); at != std::string::npos;
         at = page.find("href=\"#", at + 1)) {
      const std::size_t begin = at + std::string_view("href=\"#").size();
      const std::string id = page.substr(begin, page.find('"', begin) - begin);
      EXPECT_THAT(page, HasSubstr("id=\"" + id + "\"")) << id;
    }
  }
}

}  // namespace
}  // namespace windsplat::api
