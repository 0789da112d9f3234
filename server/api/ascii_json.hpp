// JSON as the value of a header.
#pragma once

#include <string>
#include <string_view>

namespace windsplat::api {

// Headers are ASCII: other characters of `json`, valid UTF-8, are escaped as \uXXXX.
std::string ascii_json(std::string_view json);

}  // namespace windsplat::api
