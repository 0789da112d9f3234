#include "server/base/npy_head.hpp"

#include <bit>
#include <cstdint>
#include <string_view>

namespace windsplat {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written without conversion");

constexpr std::string_view magic_and_version{"\x93NUMPY\x01\x00", 8};
constexpr std::size_t alignment = 64;

}  // namespace

std::string npy_head(std::span<const std::size_t> shape) {
  std::string text = "{'descr': '<f4', 'fortran_order': False, 'shape': (";
  for (std::size_t n = 0; n < shape.size(); ++n) {
    text += (n > 0 ? ", " : "") + std::to_string(shape[n]);
  }
  text += shape.size() == 1 ? ",), }" : "), }";
  const std::size_t fixed = magic_and_version.size() + sizeof(std::uint16_t);
  const std::size_t unpadded = fixed + text.size() + 1;  // the dict ends with a line feed
  text.append((alignment - unpadded % alignment) % alignment, ' ');
  text += '\n';
  std::string head(magic_and_version);
  head += static_cast<char>(text.size() & 0xff);
  head += static_cast<char>(text.size() >> 8);
  return head + text;
}

}  // namespace windsplat
