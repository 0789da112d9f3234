# protocol/*.schema.json -> bytes inside the binary: defines the functions of embedded_schemas.hpp.
function(windsplat_embed_schema name)
  set(schema_file ${PROJECT_SOURCE_DIR}/protocol/${name}.schema.json)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${schema_file})
  file(READ ${schema_file} schema_hex HEX)
  # An array of bytes: compilers limit the length of a string literal, and the content might end it.
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," schema_bytes "${schema_hex}")
  set(byte "'[^']*',")
  string(REGEX REPLACE "(${byte}${byte}${byte}${byte}${byte}${byte}${byte}${byte})" "\\1\n    "
    schema_bytes "${schema_bytes}")
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/${name}_schema.cpp @ONLY CONTENT
"// Written by embed_schemas.cmake from protocol/${name}.schema.json.
#include \"server/api/embedded_schemas.hpp\"

namespace windsplat::api {
namespace {
constexpr char ${name}_text[] = {
    @schema_bytes@};
}  // namespace

std::string_view ${name}_schema_json() { return {${name}_text, sizeof(${name}_text)}; }

}  // namespace windsplat::api
")
  target_sources(windsplat_api PRIVATE ${PROJECT_BINARY_DIR}/generated/${name}_schema.cpp)
endfunction()

windsplat_embed_schema(view)
windsplat_embed_schema(messages)
