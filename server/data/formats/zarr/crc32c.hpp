// CRC-32C (Castagnoli) as in RFC 3720, B.4.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace windsplat::data::zarr {

inline std::uint32_t crc32c(const unsigned char* bytes, std::size_t count) {
  static constexpr auto table = [] {
    std::array<std::uint32_t, 256> out{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      std::uint32_t rest = byte;
      for (int bit = 0; bit < 8; ++bit) {
        rest = (rest >> 1U) ^ ((rest & 1U) != 0 ? 0x82f63b78U : 0U);
      }
      out.at(byte) = rest;
    }
    return out;
  }();
  std::uint32_t sum = ~std::uint32_t{0};
  for (std::size_t i = 0; i < count; ++i) {
    sum = (sum >> 8U) ^ table[(sum ^ bytes[i]) & 0xffU];
  }
  return ~sum;
}

}  // namespace windsplat::data::zarr
