// Linear RGBA -> NPY 1.0.
#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "server/base/check.hpp"
#include "server/base/npy_head.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written without conversion");

constexpr std::size_t bytes_between_looks = std::size_t{8} << 20;

}  // namespace

Result<Bytes> encode_npy(std::span<const float> rgba, int width, int height,
                         const CancelToken& cancel) {
  if (width < 0 || height < 0) {
    return make_error(ErrorKind::invalid, "an array cannot be " + std::to_string(height) + " by " +
                                              std::to_string(width));
  }
  WINDSPLAT_CHECK(rgba.size() ==
                  4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::array<std::size_t, 3> shape{static_cast<std::size_t>(height),
                                         static_cast<std::size_t>(width), 4};
  const std::string head = npy_head(shape);
  Bytes bytes;
  bytes.reserve(head.size() + rgba.size_bytes());
  bytes.insert(bytes.end(), head.begin(), head.end());
  const auto* const values = reinterpret_cast<const std::uint8_t*>(rgba.data());
  for (std::size_t at = 0; at < rgba.size_bytes(); at += bytes_between_looks) {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
    const std::size_t end = std::min(at + bytes_between_looks, rgba.size_bytes());
    bytes.insert(bytes.end(), values + at, values + end);
  }
  return bytes;
}

}  // namespace windsplat::image
