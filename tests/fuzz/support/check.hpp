// Properties checked by a target besides the absence of crashes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace fuzz {

// Ends the process with the message unless `holds`, so that libFuzzer keeps the input.
void expect(bool holds, std::string_view what, std::string_view seen = {});

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace fuzz
