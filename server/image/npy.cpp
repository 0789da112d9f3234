// Linear RGBA -> NPY 1.0: magic and version, a Python dict padded so that the values start on a
// multiple of 64 bytes, then the values.
#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "server/base/check.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written without conversion");

constexpr std::array<std::uint8_t, 8> magic_and_version{0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0};
constexpr std::size_t alignment = 64;
constexpr std::size_t bytes_between_looks = std::size_t{8} << 20;

std::string header_text(int width, int height) {
  std::string text = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                     std::to_string(height) + ", " + std::to_string(width) + ", 4), }";
  const std::size_t fixed = magic_and_version.size() + sizeof(std::uint16_t);
  const std::size_t unpadded = fixed + text.size() + 1;  // the header ends with a line feed
  text.append((alignment - unpadded % alignment) % alignment, ' ');
  return text + '\n';
}

}  // namespace

Result<Bytes> encode_npy(std::span<const float> rgba, int width, int height,
                         const CancelToken& cancel) {
  if (width < 0 || height < 0) {
    return make_error(ErrorKind::invalid, "an array cannot be " + std::to_string(height) + " by " +
                                              std::to_string(width));
  }
  WINDSPLAT_CHECK(rgba.size() ==
                  4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::string text = header_text(width, height);
  const std::size_t values_at = magic_and_version.size() + sizeof(std::uint16_t) + text.size();
  Bytes bytes;
  bytes.reserve(values_at + rgba.size_bytes());
  bytes.insert(bytes.end(), magic_and_version.begin(), magic_and_version.end());
  bytes.push_back(static_cast<std::uint8_t>(text.size() & 0xff));
  bytes.push_back(static_cast<std::uint8_t>(text.size() >> 8));
  bytes.insert(bytes.end(), text.begin(), text.end());
  const auto* const values = reinterpret_cast<const std::uint8_t*>(rgba.data());
  for (std::size_t at = 0; at < rgba.size_bytes(); at += bytes_between_looks) {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
    const std::size_t end = std::min(at + bytes_between_looks, rgba.size_bytes());
    bytes.insert(bytes.end(), values + at, values + end);
  }
  return bytes;
}

}  // namespace windsplat::image
