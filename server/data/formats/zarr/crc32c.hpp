// CRC-32C (Castagnoli) as in RFC 3720, B.4.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace windsplat::data::zarr {

// Row n: what a byte adds to the sum with n bytes after it.
inline constexpr auto crc32c_table = [] {
  std::array<std::array<std::uint32_t, 256>, 8> out{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t rest = byte;
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest >> 1U) ^ ((rest & 1U) != 0 ? 0x82f63b78U : 0U);
    }
    out[0][byte] = rest;
  }
  for (std::size_t row = 1; row < out.size(); ++row) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t rest = out[row - 1][byte];
      out[row][byte] = (rest >> 8U) ^ out[0][rest & 0xffU];
    }
  }
  return out;
}();

// `before`: the sum of the bytes that precede these. Eight bytes at a time (Kounavis, Berry, 2005).
inline std::uint32_t crc32c(const unsigned char* bytes, std::size_t count,
                            std::uint32_t before = 0) {
  static_assert(std::endian::native == std::endian::little);
  const auto& table = crc32c_table;
  std::uint32_t sum = ~before;
  for (; count >= 8; bytes += 8, count -= 8) {
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    std::memcpy(&low, bytes, sizeof low);
    std::memcpy(&high, bytes + sizeof low, sizeof high);
    low ^= sum;
    sum = table[7][low & 0xffU] ^ table[6][(low >> 8U) & 0xffU] ^ table[5][(low >> 16U) & 0xffU] ^
          table[4][low >> 24U] ^ table[3][high & 0xffU] ^ table[2][(high >> 8U) & 0xffU] ^
          table[1][(high >> 16U) & 0xffU] ^ table[0][high >> 24U];
  }
  for (; count > 0; ++bytes, --count) sum = (sum >> 8U) ^ table[0][(sum ^ *bytes) & 0xffU];
  return ~sum;
}

}  // namespace windsplat::data::zarr
