// AsyncAPI 3 of the stream, from the schema of its messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/api/documents/openapi.hpp"

namespace windsplat::api::documents {

// A value of the header of a frame (protocol/frame_header.hpp).
struct HeaderPart {
  std::string_view name;
  std::string_view type;  // u8, u16, u32, f32, f64; little-endian
  int offset;             // bytes
  std::string_view summary;
};
const std::vector<HeaderPart>& frame_header_parts();

// The document as JSON.
std::string asyncapi(const About& about);

}  // namespace windsplat::api::documents
