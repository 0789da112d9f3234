# protocol/view.schema.json -> bytes inside the binary: defines api::view_schema_json().
set(schema_file ${PROJECT_SOURCE_DIR}/protocol/view.schema.json)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${schema_file})
file(READ ${schema_file} schema_hex HEX)
# An array of bytes: compilers limit the length of a string literal, and the content might end it.
string(REGEX REPLACE "(..)" "'\\\\x\\1'," schema_bytes "${schema_hex}")
set(byte "'[^']*',")
string(REGEX REPLACE "(${byte}${byte}${byte}${byte}${byte}${byte}${byte}${byte})" "\\1\n    "
  schema_bytes "${schema_bytes}")
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/view_schema.cpp @ONLY CONTENT
"// Written by embed_schema.cmake from protocol/view.schema.json.
#include \"server/api/embedded_schemas.hpp\"

namespace windsplat::api {
namespace {
constexpr char text[] = {
    @schema_bytes@};
}  // namespace

std::string_view view_schema_json() { return {text, sizeof(text)}; }

}  // namespace windsplat::api
")
target_sources(windsplat_api PRIVATE ${PROJECT_BINARY_DIR}/generated/view_schema.cpp)
