// OpenAPI 3.1 of a table of routes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/api/operations/operation.hpp"

namespace windsplat::api::documents {

// A row of the table.
struct Entry {
  std::string method;  // "GET"
  std::string path;    // below the base path, with "{...}"
  Operation operation;
};

// What is the same for every route of a server.
struct About {
  std::string version;    // of the program
  std::string base_path;  // "/" or "/a/b/"
  bool with_token = false;
  bool with_tls = false;
  std::string_view messages_schema;  // texts of protocol/*.schema.json
  std::string_view view_schema;
};

// The document as JSON.
std::string openapi(const std::vector<Entry>& entries, const About& about);

}  // namespace windsplat::api::documents
