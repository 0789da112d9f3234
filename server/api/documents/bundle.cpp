#include "server/api/documents/bundle.hpp"

#include <cctype>
#include <stdexcept>
#include <utility>

namespace windsplat::api::documents {
namespace {

constexpr const char* view_file = "view.schema.json";
const std::string definitions = "#/$defs/";

// The title, or the last part of the pointer with a capital.
std::string component_name(const Json& schema, const std::string& pointer) {
  if (schema.contains("title")) return schema.at("title");
  std::string name = pointer.substr(pointer.rfind('/') + 1);
  name.at(0) = static_cast<char>(std::toupper(static_cast<unsigned char>(name.at(0))));
  return name;
}

const Json& schema_at(const Json& file, const std::string& pointer) {
  if (pointer == "#") return file;
  if (!pointer.starts_with(definitions)) throw std::out_of_range("reference " + pointer);
  return file.at("$defs").at(pointer.substr(definitions.size()));
}

Json reference_to(const std::string& name) { return {{"$ref", "#/components/schemas/" + name}}; }

}  // namespace

Bundle::Bundle(std::string_view messages, std::string_view view)
    : messages_(Json::parse(messages)), view_(Json::parse(view)) {}

Json Bundle::refer(const std::string& shape) {
  if (shape == "object") return {{"type", "object"}};
  if (shape == "view") return refer(view_, "#");
  return refer(messages_, definitions + shape);
}

Json Bundle::add(const std::string& name, Json schema) {
  schemas_.emplace(name, std::move(schema));
  return reference_to(name);
}

std::string Bundle::name_of(const std::string& shape) const {
  return shape == "view" ? component_name(view_, "#")
                         : component_name(messages_.at("$defs").at(shape), definitions + shape);
}

Json Bundle::schemas() const {
  Json out = Json::object();
  for (const auto& [name, schema] : schemas_) out[name] = schema;
  return out;
}

Json Bundle::refer(const Json& file, const std::string& pointer) {
  const Json& schema = schema_at(file, pointer);
  const std::string name = component_name(schema, pointer);
  if (schemas_.emplace(name, nullptr).second) {  // first, since schemas may refer to themselves
    Json made = rewritten(schema, file);
    for (const char* key : {"$schema", "$id", "$defs"}) made.erase(key);
    schemas_[name] = std::move(made);
  }
  return reference_to(name);
}

Json Bundle::rewritten(const Json& node, const Json& file) {
  if (node.is_array()) {
    Json out = Json::array();
    for (const Json& element : node) out.push_back(rewritten(element, file));
    return out;
  }
  if (!node.is_object()) return node;
  Json out = Json::object();
  for (const auto& [key, value] : node.items()) {
    if (key == "$defs") continue;
    if (key == "$ref" && value.is_string()) {
      const std::string target = value;
      out.update(target == view_file ? refer(view_, "#") : refer(file, target));
    } else {
      out[key] = rewritten(value, file);
    }
  }
  return out;
}

}  // namespace windsplat::api::documents
