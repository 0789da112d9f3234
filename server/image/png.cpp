// 8-bit RGB -> PNG with libpng and fast compression.
#include <png.h>

#include <array>
#include <cmath>
#include <csetjmp>
#include <new>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

constexpr int compression_level = 1;  // level of zlib
constexpr int matches_of_runs = 3;    // its strategy Z_RLE
constexpr double metres_to_the_inch = 0.0254;
constexpr std::size_t chunk_bytes = std::size_t{64} << 10;  // largest IDAT

enum class Fate { done, cancelled, failed };

// libpng reports errors through longjmp, which skips destructors. write() and the functions below
// it therefore have no objects with destructors; the output and the error message are members.
class PngWriter {
 public:
  PngWriter()
      : png_(png_create_write_struct_2(PNG_LIBPNG_VER_STRING, this, &on_error, &on_warning, this,
                                       &allocate, &release)),
        info_(png_ == nullptr ? nullptr : png_create_info_struct(png_)) {}
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  // per_metre: pixels to the metre in print; 0: the file tells none.
  Fate write(const std::uint8_t* rgb, int width, int height, png_uint_32 per_metre,
             const CancelToken& cancel) {
    if (info_ == nullptr) return Fate::failed;
    if (setjmp(png_jmpbuf(png_)) != 0) return Fate::failed;  // NOLINT(cert-err52-cpp)
    return write_chunks(rgb, width, height, per_metre, cancel);
  }
  [[nodiscard]] Error error() const {
    return make_error(out_of_memory_ ? ErrorKind::out_of_memory : ErrorKind::internal,
                      std::string("PNG: ") + message_.data());
  }
  [[nodiscard]] Bytes take() { return std::move(bytes_); }

 private:
  Fate write_chunks(const std::uint8_t* rgb, int width, int height, png_uint_32 per_metre,
                    const CancelToken& cancel) {
    png_set_write_fn(png_, this, &append, nullptr);
    png_set_compression_level(png_, compression_level);
    png_set_compression_buffer_size(png_, chunk_bytes);
    // For thin lines and smooth media, differences from the row above and matches of runs alone
    // give files of about the size of a choice of filters for each row and of all matches, in three
    // fifths of the time.
    png_set_compression_strategy(png_, matches_of_runs);
    png_set_filter(png_, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE,
                 PNG_FILTER_TYPE_BASE);
    png_set_sRGB(png_, info_, PNG_sRGB_INTENT_RELATIVE);
    if (per_metre > 0) png_set_pHYs(png_, info_, per_metre, per_metre, PNG_RESOLUTION_METER);
    png_write_info(png_, info_);
    const std::size_t row_bytes = 3 * static_cast<std::size_t>(width);
    for (int row = 0; row < height; ++row, rgb += row_bytes) {
      if (cancel.cancelled()) return Fate::cancelled;
      png_write_row(png_, rgb);
    }
    png_write_end(png_, nullptr);
    return Fate::done;
  }

  // Memory of libpng and zlib; null is an error that libpng reports.
  static void* allocate(png_structp png, png_alloc_size_t bytes) {
    void* const block = ::operator new(bytes, std::nothrow);
    if (block == nullptr) static_cast<PngWriter*>(png_get_mem_ptr(png))->out_of_memory_ = true;
    return block;
  }
  static void release(png_structp /*png*/, void* block) { ::operator delete(block); }

  static void append(png_structp png, std::uint8_t* from, std::size_t bytes) {
    if (!static_cast<PngWriter*>(png_get_io_ptr(png))->has_appended(from, bytes)) {
      png_error(png, "out of memory");
    }
  }
  bool has_appended(const std::uint8_t* from, std::size_t bytes) noexcept {
    try {
      bytes_.insert(bytes_.end(), from, from + bytes);
      return true;
    } catch (const std::bad_alloc&) {
      out_of_memory_ = true;
      return false;
    }
  }

  [[noreturn]] static void on_error(png_structp png, const char* message) {
    keep(png, message);
    png_longjmp(png, 1);
  }
  // If the version of the library differs from that of the headers, it warns and creates nothing.
  static void on_warning(png_structp png, const char* message) { keep(png, message); }
  static void keep(png_structp png, const char* message) {
    auto& kept = static_cast<PngWriter*>(png_get_error_ptr(png))->message_;
    kept[std::string_view(message).copy(kept.data(), kept.size() - 1)] = '\0';
  }

  Bytes bytes_;
  std::array<char, 128> message_{"out of memory"};  // for failures without a message
  bool out_of_memory_ = false;
  png_structp png_;
  png_infop info_;
};

}  // namespace

Result<Bytes> encode_png(std::span<const std::uint8_t> rgb, int width, int height,
                         const CancelToken& cancel, std::optional<double> dots_per_inch) {
  if (width < 1 || height < 1) {
    return make_error(ErrorKind::invalid, "a PNG has at least one pixel a side, not " +
                                              std::to_string(width) + " x " +
                                              std::to_string(height));
  }
  WINDSPLAT_CHECK(rgb.size() ==
                  3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto per_metre =
      static_cast<png_uint_32>(std::lround(dots_per_inch.value_or(0) / metres_to_the_inch));
  PngWriter writer;
  switch (writer.write(rgb.data(), width, height, per_metre, cancel)) {
    case Fate::cancelled:
      return make_error(ErrorKind::cancelled, "request cancelled");
    case Fate::failed:
      return writer.error();
    case Fate::done:
      break;
  }
  return writer.take();
}

}  // namespace windsplat::image
