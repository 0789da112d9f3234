#include "server/api/documents/page.hpp"

#include <string>
#include <utility>
#include <vector>

#include "server/api/documents/bundle.hpp"
#include "server/api/documents/html.hpp"

namespace windsplat::api::documents {
namespace {

constexpr std::string_view style =
    ":root{color-scheme:light dark;font:16px/1.5 system-ui,sans-serif}"
    "body{max-width:60rem;margin:0 auto;padding:1rem;overflow-wrap:break-word}"
    "nav ul{columns:18rem;padding-left:1.2rem}h2{margin-top:2.5rem;border-bottom:1px solid}"
    "h3{margin-top:2rem}code,pre{font:.9em/1.4 ui-monospace,monospace}"
    "pre{overflow-x:auto;white-space:pre-wrap}"
    "table{border-collapse:collapse;width:100%;margin:1rem 0}"
    "caption{text-align:left;font-weight:600}"
    "th,td{text-align:left;vertical-align:top;padding:.2rem .6rem .2rem 0;"
    "border-top:1px solid #8886}"
    "summary{cursor:pointer}";

constexpr std::string_view schemas_place = "#/components/schemas/";

std::string name_in(const std::string& reference) {
  return reference.substr(reference.rfind('/') + 1);
}

std::string schema_link(const std::string& name) { return link("#schema-" + name, name); }

// A schema in a few words, as HTML.
std::string words_of(const Json& schema) {
  if (schema.contains("$ref")) return schema_link(name_in(schema.at("$ref")));
  std::string out;
  if (schema.contains("enum")) {
    for (const Json& value : schema.at("enum")) {
      out += (out.empty() ? "" : " or ") + element("code", value.get<std::string>());
    }
  } else {
    out = escaped(schema.value("type", "any"));
  }
  const Json& numbers = schema.contains("items") ? schema.at("items") : schema;
  if (schema.contains("minItems")) out = schema.at("minItems").dump() + " numbers, a,b";
  if (schema.contains("items") && !schema.contains("minItems")) out = "names, a,b";
  if (numbers.contains("maximum")) {
    out += ", " + numbers.at("minimum").dump() + " to " + numbers.at("maximum").dump();
  } else if (numbers.contains("minimum")) {
    out += ", from " + numbers.at("minimum").dump();
  }
  if (schema.contains("default")) {
    out += ", default " + element("code", schema.at("default").dump());
  }
  return out;
}

std::string parameters_of(const Json& operation) {
  if (!operation.contains("parameters")) return {};
  std::string rows;
  for (const Json& parameter : operation.at("parameters")) {
    const std::string place = parameter.at("in");
    rows += table_row({element("code", parameter.at("name").get<std::string>()),
                       place + (parameter.value("required", false) ? ", required" : ""),
                       words_of(parameter.at("schema")),
                       prose(parameter.at("description").get<std::string>())});
  }
  return table("Parameters", {"name", "in", "value", "meaning"}, rows);
}

// Media types with their schemas, as HTML.
std::string content_of(const Json& holder) {
  std::string out;
  if (!holder.contains("content")) return out;
  for (const auto& [media, content] : holder.at("content").items()) {
    if (!out.empty()) out += "<br>";
    out += element("code", media);
    if (content.contains("schema")) out += " " + words_of(content.at("schema"));
  }
  return out;
}

std::string answers_of(const Json& operation, const Json& components) {
  std::string rows;
  for (const auto& [status, answer] : operation.at("responses").items()) {
    const bool is_shared = answer.contains("$ref");
    const Json& response =
        is_shared ? components.at("responses").at(name_in(answer.at("$ref"))) : answer;
    std::string headers;
    if (response.contains("headers")) {
      for (const auto& [name, header] : response.at("headers").items()) {
        headers += (headers.empty() ? "" : ", ") + element("code", name);
      }
    }
    rows += table_row({status, prose(response.at("description").get<std::string>()),
                       content_of(response), headers});
  }
  return table("Answers", {"status", "meaning", "body", "headers"}, rows);
}

std::string body_of(const Json& operation) {
  if (!operation.contains("requestBody")) return {};
  const Json& body = operation.at("requestBody");
  return element_of("p", "Body: " + prose(body.at("description").get<std::string>()) + " " +
                             content_of(body)) +
         "\n";
}

std::string capitals(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - ('a' - 'A') : c);
  return text;
}

std::string operation_article(const std::string& method, const std::string& path,
                              const Json& operation, const Json& components) {
  const std::string id = operation.at("operationId");
  std::string out =
      element_of("h3 id=\"" + id + "\"", element("code", capitals(method) + " " + path));
  const std::string summary = operation.at("summary").get<std::string>() + ".";
  const std::string description = operation.value("description", "");
  out += "\n" + element("p", summary) + "\n";
  if (description != summary) out += paragraphs(description);
  if (operation.value("deprecated", false)) out += element("p", "Deprecated.");
  out += parameters_of(operation) + body_of(operation) + answers_of(operation, components);
  return element_of("article", out) + "\n";
}

// Pretty JSON in which references are links.
std::string linked_json(const Json& schema) {
  const std::string text = escaped(schema.dump(1));
  const std::string opening = "&quot;" + std::string(schemas_place);
  std::string out;
  std::size_t done = 0;
  for (std::size_t at = text.find(opening); at != std::string::npos; at = text.find(opening, at)) {
    const std::size_t name_at = at + opening.size();
    const std::size_t end = text.find("&quot;", name_at);
    out += text.substr(done, at - done) + schema_link(text.substr(name_at, end - name_at));
    done = at = end + std::string_view("&quot;").size();
  }
  return out + text.substr(done);
}

std::string schemas_section(const Json& components) {
  std::string out = "<h2 id=\"schemas\">Schemas</h2>\n";
  for (const auto& [name, schema] : components.at("schemas").items()) {
    const std::string summary =
        element("strong", name) + " " + prose(schema.value("description", ""));
    out += element_of("details", element_of("summary", summary) +
                                     element_of("pre id=\"schema-" + name + "\" tabindex=\"0\"",
                                                linked_json(schema))) +
           "\n";
  }
  return element_of("section", out);
}

std::string whole_page(const Json& document, std::string_view links, std::string_view contents,
                       std::string_view main) {
  const Json& info = document.at("info");
  const std::string title =
      info.at("title").get<std::string>() + " " + info.at("version").get<std::string>();
  std::string out =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\">";
  out += element("title", title) + element_of("style", style);
  out += "</head>\n<body><header>" + element("h1", title) + "\n" +
         paragraphs(info.at("description").get<std::string>());
  out += element_of("p", links);
  out += "</header>\n";
  out += element_of("nav aria-label=\"Contents\"", element_of("ul", contents));
  return out + "\n" + element_of("main", main) + "</body></html>\n";
}

std::string contents_entry(const std::string& id, const std::string& text) {
  return element_of("li", link("#" + id, text)) + "\n";
}

}  // namespace

std::string_view page_style() { return style; }

std::string openapi_page(std::string_view text) {
  const Json document = Json::parse(text);
  const Json& components = document.at("components");
  std::string contents;
  std::string main;
  for (const Json& tag : document.at("tags")) {
    std::string section = element("h2", tag.at("name").get<std::string>()) + "\n" +
                          paragraphs(tag.value("description", ""));
    for (const auto& [path, methods] : document.at("paths").items()) {
      for (const auto& [method, operation] : methods.items()) {
        if (operation.at("tags").at(0) != tag.at("name")) continue;
        section += operation_article(method, path, operation, components);
        contents += contents_entry(operation.at("operationId"), capitals(method) + " " + path);
      }
    }
    main += element_of("section", section) + "\n";
  }
  contents += contents_entry("schemas", "Schemas");
  return whole_page(
      document,
      link("openapi.json", "This as OpenAPI 3.1") + " · " + link("asyncapi.html", "The stream"),
      contents, main + schemas_section(components));
}

std::string asyncapi_page(std::string_view text) {
  const Json document = Json::parse(text);
  const Json& components = document.at("components");
  std::string contents;
  std::string main;
  for (const auto& [action, operation] : document.at("operations").items()) {
    std::string section = element("h2", operation.at("title").get<std::string>()) + "\n" +
                          paragraphs(operation.at("description").get<std::string>());
    for (const Json& reference : operation.at("messages")) {
      const std::string name = name_in(reference.at("$ref"));
      const Json& message = components.at("messages").at(name);
      section += element_of("h3 id=\"message-" + name + "\"", element("code", name)) + "\n" +
                 paragraphs(message.at("summary").get<std::string>()) + "\n" +
                 element_of("p", element("code", message.at("contentType").get<std::string>()) +
                                     " " + words_of(message.at("payload"))) +
                 "\n";
      contents += contents_entry("message-" + name, name);
    }
    main += element_of("section", section) + "\n";
  }
  std::string rows;
  for (const auto& [name, part] :
       components.at("schemas").at("FrameHeader").at("properties").items()) {
    rows += table_row({part.at("x-offset").dump(), part.at("x-encoding").get<std::string>(),
                       element("code", name), prose(part.at("description").get<std::string>())});
  }
  main +=
      element_of("section id=\"header\"",
                 element("h2", "Header of a frame") +
                     table("Little-endian values", {"offset", "type", "name", "meaning"}, rows));
  contents += contents_entry("header", "Header of a frame") + contents_entry("schemas", "Schemas");
  return whole_page(
      document,
      link("asyncapi.json", "This as AsyncAPI 3") + " · " + link("openapi.html", "Requests"),
      contents, main + schemas_section(components));
}

}  // namespace windsplat::api::documents
