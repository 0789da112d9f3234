// 8-bit RGB -> JPEG by libjpeg-turbo; the only file that knows it. A compressor lives for one call:
// making one takes microseconds, and calls share nothing.
#include <turbojpeg.h>

#include <memory>
#include <string>
#include <type_traits>

#include "server/base/check.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

constexpr int edge_max = 65500;  // pixels, of the library

struct Destroy {
  void operator()(void* compressor) const { tjDestroy(compressor); }
};
struct Free {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

}  // namespace

Result<Bytes> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height, int quality,
                          Subsampling subsampling) {
  if (width < 1 || height < 1 || width > edge_max || height > edge_max) {
    return make_error(ErrorKind::too_large, "a JPEG has 1 to " + std::to_string(edge_max) +
                                                " pixels a side, not " + std::to_string(width) +
                                                " x " + std::to_string(height));
  }
  if (quality < 1 || quality > 100) {
    return make_error(ErrorKind::invalid,
                      "JPEG quality is 1 to 100, not " + std::to_string(quality));
  }
  WINDSPLAT_CHECK(rgb.size() ==
                  3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));

  const std::unique_ptr<std::remove_pointer_t<tjhandle>, Destroy> compressor(tjInitCompress());
  if (!compressor) {
    return make_error(ErrorKind::internal, std::string("JPEG: ") + tjGetErrorStr2(nullptr));
  }
  // The settled picture (4:4:4) takes the accurate transform, the moving one the fast.
  const bool settled = subsampling == Subsampling::s444;
  unsigned char* jpeg = nullptr;
  unsigned long jpeg_bytes = 0;  // NOLINT(google-runtime-int): the library's type
  const int failed = tjCompress2(compressor.get(), rgb.data(), width, 0, height, TJPF_RGB, &jpeg,
                                 &jpeg_bytes, settled ? TJSAMP_444 : TJSAMP_420, quality,
                                 settled ? TJFLAG_ACCURATEDCT : TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, Free> owner(jpeg);
  if (failed != 0) {
    return make_error(ErrorKind::internal,
                      std::string("JPEG: ") + tjGetErrorStr2(compressor.get()));
  }
  return Bytes(jpeg, jpeg + jpeg_bytes);
}

}  // namespace windsplat::image
