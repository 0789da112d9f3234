// JPEG -> 8-bit RGB with libjpeg-turbo.
#include <turbojpeg.h>

#include <memory>
#include <string>
#include <type_traits>

#include "server/image/decode.hpp"

namespace windsplat::image {
namespace {

struct DestroyDecompressor {
  void operator()(void* decompressor) const { tjDestroy(decompressor); }
};

}  // namespace

Result<Bytes> decode_jpeg(std::span<const std::uint8_t> jpeg, int width, int height) {
  const std::unique_ptr<std::remove_pointer_t<tjhandle>, DestroyDecompressor> decompressor(
      tjInitDecompress());
  if (!decompressor) {
    return make_error(ErrorKind::internal, std::string("JPEG: ") + tjGetErrorStr2(nullptr));
  }
  int found_width = 0;
  int found_height = 0;
  int subsampling = 0;
  int colorspace = 0;
  if (tjDecompressHeader3(decompressor.get(), jpeg.data(), jpeg.size(), &found_width, &found_height,
                          &subsampling, &colorspace) != 0) {
    return make_error(ErrorKind::bad_data,
                      std::string("JPEG: ") + tjGetErrorStr2(decompressor.get()));
  }
  if (found_width != width || found_height != height) {
    return make_error(ErrorKind::bad_data, "JPEG: " + std::to_string(found_width) + " x " +
                                               std::to_string(found_height) + " pixels, not " +
                                               std::to_string(width) + " x " +
                                               std::to_string(height));
  }
  Bytes rgb(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (tjDecompress2(decompressor.get(), jpeg.data(), jpeg.size(), rgb.data(), width, 0, height,
                    TJPF_RGB, TJFLAG_ACCURATEDCT) != 0) {
    return make_error(ErrorKind::bad_data,
                      std::string("JPEG: ") + tjGetErrorStr2(decompressor.get()));
  }
  return rgb;
}

}  // namespace windsplat::image
