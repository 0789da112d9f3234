// The schemas of protocol/ as components of a document: each shape that is referred to, and what it
// refers to, under its title. OpenAPI 3.1 and AsyncAPI 3 take the same dialect of JSON Schema
// (2020-12), so only references change.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace windsplat::api::documents {

// Keys stay in the order in which they are written.
using Json = nlohmann::ordered_json;

class Bundle {
 public:
  // The texts of messages.schema.json and view.schema.json.
  Bundle(std::string_view messages, std::string_view view);

  // A reference to a shape (operation.hpp). Throws std::out_of_range if there is none.
  Json refer(const std::string& shape);
  // Adds a schema that is in no file.
  Json add(const std::string& name, Json schema);
  // The name of the component of a shape.
  [[nodiscard]] std::string name_of(const std::string& shape) const;
  // The components that were referred to, by name.
  [[nodiscard]] Json schemas() const;

 private:
  Json refer(const Json& file, const std::string& pointer);
  Json rewritten(const Json& node, const Json& file);

  Json messages_;
  Json view_;
  std::map<std::string, Json> schemas_;
};

}  // namespace windsplat::api::documents
