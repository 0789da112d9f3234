// 8-bit RGB -> PNG by libspng; the only file that knows it. Compression is set for speed.
#include <spng.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "server/base/check.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

constexpr int compression_level = 1;          // zlib's
constexpr std::uint8_t color_type_rgb = 2;    // PNG 11.2.2
constexpr std::uint8_t rendering_intent = 1;  // relative colorimetric

struct FreePng {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
  void operator()(void* bytes) const { std::free(bytes); }
};

Error png_error(int code) {
  const ErrorKind kind = code == SPNG_EMEM ? ErrorKind::out_of_memory : ErrorKind::internal;
  return make_error(kind, std::string("PNG: ") + spng_strerror(code));
}

int configure(spng_ctx* context, int width, int height) {
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = 8;
  header.color_type = color_type_rgb;
  if (const int code = spng_set_option(context, SPNG_ENCODE_TO_BUFFER, 1)) return code;
  if (const int code = spng_set_option(context, SPNG_IMG_COMPRESSION_LEVEL, compression_level)) {
    return code;
  }
  // Thin lines on an even ground: subtracting the left or upper pixel gains most of what trying
  // every filter on every row would.
  if (const int code = spng_set_option(context, SPNG_FILTER_CHOICE,
                                       SPNG_FILTER_CHOICE_SUB | SPNG_FILTER_CHOICE_UP)) {
    return code;
  }
  if (const int code = spng_set_ihdr(context, &header)) return code;
  return spng_set_srgb(context, rendering_intent);
}

}  // namespace

Result<Bytes> encode_png(std::span<const std::uint8_t> rgb, int width, int height,
                         const CancelToken& cancel) {
  if (width < 1 || height < 1) {
    return make_error(ErrorKind::invalid, "a PNG has at least one pixel a side, not " +
                                              std::to_string(width) + " x " +
                                              std::to_string(height));
  }
  WINDSPLAT_CHECK(rgb.size() ==
                  3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));

  const std::unique_ptr<spng_ctx, FreePng> context(spng_ctx_new(SPNG_CTX_ENCODER));
  if (!context) return png_error(SPNG_EMEM);
  if (const int code = configure(context.get(), width, height)) return png_error(code);
  if (const int code = spng_encode_image(context.get(), nullptr, 0, SPNG_FMT_PNG,
                                         SPNG_ENCODE_PROGRESSIVE | SPNG_ENCODE_FINALIZE)) {
    return png_error(code);
  }
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(width);
  for (int row = 0; row < height; ++row) {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "nobody waits for the PNG");
    const std::uint8_t* const at = rgb.data() + static_cast<std::size_t>(row) * row_bytes;
    const int code = spng_encode_row(context.get(), at, row_bytes);
    if (code != 0 && code != SPNG_EOI) return png_error(code);
  }
  std::size_t png_bytes = 0;
  int code = 0;
  const std::unique_ptr<void, FreePng> png(spng_get_png_buffer(context.get(), &png_bytes, &code));
  if (!png) return png_error(code);
  const auto* begin = static_cast<const std::uint8_t*>(png.get());
  return Bytes(begin, begin + png_bytes);
}

}  // namespace windsplat::image
