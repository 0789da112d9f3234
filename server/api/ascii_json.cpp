#include "server/api/ascii_json.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace windsplat::api {

std::string ascii_json(std::string_view json) {
  std::string out;
  for (std::size_t i = 0; i < json.size();) {
    const auto lead = static_cast<unsigned char>(json[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if (length == 1) {
      out += json[i++];
      continue;
    }
    std::uint32_t code = lead & (0x7fU >> length);
    for (std::size_t k = 1; k < length && i + k < json.size(); ++k) {
      code = code << 6 | (static_cast<unsigned char>(json[i + k]) & 0x3fU);
    }
    i += length;
    std::array<char, 16> text{};
    if (code >= 0x10000) {
      const std::uint32_t rest = code - 0x10000;
      std::snprintf(text.data(), text.size(), "\\u%04x\\u%04x", 0xd800 + (rest >> 10),
                    0xdc00 + (rest & 0x3ff));
    } else {
      std::snprintf(text.data(), text.size(), "\\u%04x", code);
    }
    out += text.data();
  }
  return out;
}

}  // namespace windsplat::api
