// protocol/*.schema.json, embedded: embed_schemas.cmake writes the definitions.
#pragma once

#include <string_view>

namespace windsplat::api {

std::string_view view_schema_json();
std::string_view messages_schema_json();

}  // namespace windsplat::api
