// protocol/view.schema.json, embedded: embed_schema.cmake writes the definition.
#pragma once

#include <string_view>

namespace windsplat::api {

std::string_view view_schema_json();

}  // namespace windsplat::api
