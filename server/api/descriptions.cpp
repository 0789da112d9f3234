// The descriptions of the API: OpenAPI and AsyncAPI, and a page of each.
#include <memory>
#include <string>

#include "server/access/login.hpp"
#include "server/api/documents/documents.hpp"
#include "server/api/documents/page.hpp"
#include "server/api/embedded_schemas.hpp"
#include "server/api/resources.hpp"

namespace windsplat::api {
namespace {

bool is_page(documents::Kind kind) {
  return kind == documents::Kind::openapi_page || kind == documents::Kind::asyncapi_page;
}

const std::string& description_policy() {
  static const std::string text =
      "default-src 'none'; style-src " + access::policy_hash(documents::page_style()) +
      "; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
  return text;
}

}  // namespace

std::shared_ptr<documents::Documents> documents_of(const ServerOptions& options) {
  return std::make_shared<documents::Documents>(
      documents::About{WINDSPLAT_VERSION, options.base_path, options.token != nullptr,
                       options.tls != nullptr, messages_schema_json(), view_schema_json()});
}

std::string description_links(const std::string& base_path) {
  std::string out;
  for (const char* name : {"openapi", "asyncapi"}) {
    const std::string path = base_path + "v1/" + name;
    if (!out.empty()) out += ", ";
    out += '<' + path + R"(.json>; rel="service-desc"; type="application/json", )";
    out += '<' + path + R"(.html>; rel="service-doc"; type="text/html")";
  }
  return out;
}

http::Response get_description(documents::Documents& documents, documents::Kind kind,
                               const http::Request& request) {
  if (!is_page(kind)) return tagged_response(request, "application/json", documents.text(kind));
  http::Response response =
      tagged_response(request, "text/html; charset=utf-8", documents.text(kind));
  response.headers.emplace_back("Content-Security-Policy", description_policy());
  response.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  return response;
}

}  // namespace windsplat::api
