#include "server/api/documents/openapi.hpp"

#include <array>
#include <map>
#include <set>
#include <utility>

#include "server/api/documents/answers.hpp"
#include "server/api/documents/bundle.hpp"

namespace windsplat::api::documents {
namespace {

constexpr const char* introduction =
    "A view is a JSON document that determines a picture. Pictures are requested here, or received "
    "as frames of the WebSocket that asyncapi.json describes.\n\nEvery GET can be a HEAD. Every "
    "path answers OPTIONS with its methods, and 405 to others. Unknown and repeated query "
    "parameters are refused with 400. Requests that violate HTTP get 408, 414, 417, 431, 501 or "
    "505. Within version 1 only keys, parameters, resources and statuses are added: clients ignore "
    "keys that they do not know.";

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
  return text;
}

// Names in braces.
std::vector<std::string> placeholders(const std::string& path) {
  std::vector<std::string> out;
  for (std::size_t at = path.find('{'); at != std::string::npos; at = path.find('{', at + 1)) {
    out.push_back(path.substr(at + 1, path.find('}', at) - at - 1));
  }
  return out;
}

Json path_parameter(const std::string& name, const std::string& path) {
  std::string summary = "Name of the field.";
  Json schema{{"type", "string"}, {"minLength", 1}};
  if (name == "id") {
    const std::size_t begin = path.rfind('/', path.find("{id}") - 2) + 1;
    summary = "Id in /v1/" + path.substr(begin, path.find("/{id}") - begin) + ".";
  }
  if (path == "/v1/references/{id}") schema["pattern"] = "\\.png$";
  return {{"name", name},
          {"in", "path"},
          {"required", true},
          {"description", summary},
          {"schema", std::move(schema)}};
}

Json limited(const char* type, const Parameter& parameter) {
  Json out{{"type", type}};
  if (parameter.kind == ParameterKind::integer) {
    out["minimum"] = static_cast<std::int64_t>(parameter.min);
    out["maximum"] = static_cast<std::int64_t>(parameter.max);
  } else {
    out["minimum"] = parameter.min;
    out["maximum"] = parameter.max;
  }
  return out;
}

Json array_of(Json items, int count) {
  Json out{{"type", "array"}, {"items", std::move(items)}};
  if (count > 0) out.update({{"minItems", count}, {"maxItems", count}});
  return out;
}

Json choice(const Parameter& parameter) {
  Json values = Json::array();
  for (const std::string_view value : parameter.values) {
    if (!value.empty()) values.push_back(value);
  }
  return {{"type", "string"}, {"enum", std::move(values)}};
}

Json schema_of(const Parameter& parameter) {
  switch (parameter.kind) {
    case ParameterKind::text:
      return {{"type", "string"}};
    case ParameterKind::number:
      return limited("number", parameter);
    case ParameterKind::integer:
      return limited("integer", parameter);
    case ParameterKind::boolean:
      return {{"type", "boolean"}};
    case ParameterKind::pair:
      return array_of(limited("number", parameter), 2);
    case ParameterKind::choice:
      return choice(parameter);
    case ParameterKind::indices:
      return array_of({{"type", "integer"}, {"minimum", 0}}, 3);
    case ParameterKind::names:
      return array_of({{"type", "string"}}, 0);
  }
  return {};
}

Json query_parameter(const Parameter& parameter) {
  Json schema = schema_of(parameter);
  const bool is_list = schema.value("type", "") == "array";
  if (!parameter.fallback.empty()) schema["default"] = Json::parse(parameter.fallback);
  Json out{{"name", parameter.name}, {"in", "query"}, {"description", parameter.summary}};
  if (parameter.required) out["required"] = true;
  if (is_list) out.update({{"style", "form"}, {"explode", false}});
  out["schema"] = std::move(schema);
  return out;
}

Json operation_of(const Entry& entry, const About& about, Bundle& bundle) {
  const Operation& operation = entry.operation;
  Json out{
      {"operationId", operation.id}, {"tags", {operation.group}}, {"summary", operation.summary}};
  out["description"] = operation.description.empty() ? std::string(operation.summary) + "."
                                                     : std::string(operation.description);
  if (operation.deprecated) out["deprecated"] = true;
  if (about.with_token && operation.needs_no_token) out["security"] = Json::array();
  Json parameters = Json::array();
  for (const std::string& name : placeholders(entry.path)) {
    parameters.push_back(path_parameter(name, entry.path));
  }
  for (const Parameter& parameter : operation.query) {
    parameters.push_back(query_parameter(parameter));
  }
  if (!parameters.empty()) out["parameters"] = std::move(parameters);
  if (operation.body) {
    Json content = Json::object();
    for (const std::string_view media : operation.body->media) {
      Json& part = content[std::string(media)] = Json::object();
      if (!operation.body->shape.empty()) {
        part["schema"] = bundle.refer(std::string(operation.body->shape));
      }
    }
    out["requestBody"] = {{"required", true},
                          {"description", operation.body->summary},
                          {"content", std::move(content)}};
  }
  out["responses"] = responses_of(operation, about.with_token, bundle);
  return out;
}

// The groups in the order of the table.
Json tags_of(const std::vector<Entry>& entries) {
  const std::map<std::string_view, const char*> words{
      {"Service", "The service itself: version, limits, health, descriptions."},
      {"Pictures", "Pictures of views, and what they show."},
      {"Saved views", "Views that the server keeps under an id."},
      {"Jobs", "Work that takes longer than a request."},
      {"Datasets", "Files, and the datasets that are open."},
      {"Values", "Values of the fields of a dataset."},
      {"Uploads", "Files that clients send."}};
  Json out = Json::array();
  std::set<std::string_view> listed;
  for (const Entry& entry : entries) {
    const std::string_view group = entry.operation.group;
    if (!listed.insert(group).second) continue;
    Json tag{{"name", group}};
    const auto found = words.find(group);
    if (found != words.end()) tag["description"] = found->second;
    out.push_back(std::move(tag));
  }
  return out;
}

std::string server_url(const std::string& base_path) {
  return base_path == "/" ? base_path : base_path.substr(0, base_path.size() - 1);
}

}  // namespace

std::string openapi(const std::vector<Entry>& entries, const About& about) {
  Bundle bundle(about.messages_schema, about.view_schema);
  Json paths = Json::object();
  for (const Entry& entry : entries) {
    paths[entry.path][lower(entry.method)] = operation_of(entry, about, bundle);
  }
  std::vector<Operation> operations;
  operations.reserve(entries.size());
  for (const Entry& entry : entries) operations.push_back(entry.operation);
  Json responses = problem_responses(operations, about.with_token, bundle);
  Json components{{"schemas", bundle.schemas()},
                  {"responses", std::move(responses)},
                  {"headers", headers(about.with_token)}};
  Json security = Json::array();
  if (about.with_token) {
    components["securitySchemes"] = {
        {"token",
         {{"type", "http"},
          {"scheme", "bearer"},
          {"description", "The token of --token-file. Browsers log in at /login instead."}}}};
    security.push_back({{"token", Json::array()}});
  }
  const Json document{
      {"openapi", "3.1.0"},
      {"info",
       {{"title", "windsplat"},
        {"version", about.version},
        {"summary", "Renders 3-D fields to pictures"},
        {"description", introduction},
        {"contact", {{"name", "the windsplat authors"}}},
        {"license", {{"name", "MIT"}, {"identifier", "MIT"}}}}},
      {"servers",
       Json::array({{{"url", server_url(about.base_path)}, {"description", "This server."}}})},
      {"security", std::move(security)},
      {"tags", tags_of(entries)},
      {"paths", std::move(paths)},
      {"components", std::move(components)}};
  return document.dump();
}

}  // namespace windsplat::api::documents
