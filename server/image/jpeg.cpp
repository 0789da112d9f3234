// 8-bit RGB or planes of YCbCr -> JPEG with libjpeg-turbo.
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "server/base/check.hpp"
#include "server/image/encode.hpp"
#include "server/image/jpeg_encoder.hpp"
#include "server/image/jpeg_parts.hpp"

namespace windsplat::image {
namespace {

constexpr int edge_max = 65500;  // pixels, of the library
constexpr std::int64_t strips_max = 16;

struct DestroyCompressor {
  void operator()(void* compressor) const { tjDestroy(compressor); }
};
struct FreeJpeg {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

using Compressor = std::unique_ptr<std::remove_pointer_t<tjhandle>, DestroyCompressor>;

// The final frame (4:4:4) uses the accurate DCT, moving frames the fast one.
int transform_of(Subsampling subsampling) {
  return subsampling == Subsampling::s444 ? TJFLAG_ACCURATEDCT : TJFLAG_FASTDCT;
}

int library_name(Subsampling subsampling) {
  return subsampling == Subsampling::s444 ? TJSAMP_444 : TJSAMP_420;
}

Error fault_of(const Compressor& compressor) {
  return make_error(ErrorKind::internal, std::string("JPEG: ") + tjGetErrorStr2(compressor.get()));
}

Result<void> check(int width, int height, int quality) {
  if (width < 1 || height < 1 || width > edge_max || height > edge_max) {
    return make_error(ErrorKind::too_large, "a JPEG has 1 to " + std::to_string(edge_max) +
                                                " pixels a side, not " + std::to_string(width) +
                                                " x " + std::to_string(height));
  }
  if (quality < 1 || quality > 100) {
    return make_error(ErrorKind::invalid,
                      "JPEG quality is 1 to 100, not " + std::to_string(quality));
  }
  return {};
}

// Division of a picture into strips, by its size only: rows of MCUs per strip; the last strip may
// have fewer.
struct Cut {
  int mcu_columns = 0;
  int mcu_rows = 0;
  int strip_rows = 0;
  int strips = 0;
};

Cut cut_of(const YccPicture& picture) {
  constexpr std::int64_t strip_pixels = 1 << 16;  // overhead of a strip: a few hundred pixels
  constexpr int interval_max = 0xFFFF;            // MCUs
  Cut cut;
  cut.mcu_columns = picture.planes()[1].width / 8;
  cut.mcu_rows = picture.planes()[1].height / 8;
  const std::int64_t pixels = std::int64_t{picture.width()} * picture.height();
  const auto wanted =
      static_cast<int>(std::clamp<std::int64_t>(pixels / strip_pixels, 1, strips_max));
  cut.strip_rows = std::min((cut.mcu_rows + wanted - 1) / wanted, interval_max / cut.mcu_columns);
  cut.strips = (cut.mcu_rows + cut.strip_rows - 1) / cut.strip_rows;
  return cut;
}

struct Strip {
  std::unique_ptr<unsigned char[]> jpeg;  // uninitialised: unused pages do not become resident
  std::size_t capacity = 0;
  std::size_t size = 0;
};

}  // namespace

struct JpegEncoder::State {
  std::vector<Compressor> compressors;  // per thread
  std::vector<Strip> strips;
  std::vector<std::span<const std::uint8_t>> pieces;
  std::vector<int> failed;  // per thread

  // Releases the storage of a very large picture before a smaller one.
  void make_room(const Cut& cut, int mcu) {
    // Storage of a picture of retained_pixels at 4:4:4 in the largest number of strips.
    const std::size_t kept = strips_max * tjBufSize(1920, 80, TJSAMP_444);
    const auto count = static_cast<std::size_t>(cut.strips);
    const std::size_t needed = count * tjBufSize(cut.mcu_columns * mcu, cut.strip_rows * mcu,
                                                 mcu == 8 ? TJSAMP_444 : TJSAMP_420);
    std::size_t held = 0;
    for (const Strip& strip : strips) held += strip.capacity;
    if (held > std::max(needed, kept)) strips.clear();
    if (strips.size() < count) strips.resize(count);
  }

  // Passes the width in whole MCUs, so that the library does not copy rows for padding, up to its
  // largest edge; beyond, its padding equals that of the planes.
  bool compress(const YccPicture& picture, const Cut& cut, int quality, int index,
                const Compressor& compressor) {
    const int mcu = picture.mcu_side();
    const int first = index * cut.strip_rows;
    const int rows = std::min(cut.strip_rows, cut.mcu_rows - first);
    std::array<const unsigned char*, 3> planes{};
    std::array<int, 3> strides{};
    for (std::size_t p = 0; p < 3; ++p) {
      const YccPicture::Plane& plane = picture.planes()[p];
      const int side = p == 0 ? mcu : 8;
      planes[p] = plane.samples + static_cast<std::ptrdiff_t>(first) * side * plane.width;
      strides[p] = plane.width;
    }
    const int name = library_name(picture.subsampling());
    Strip& strip = strips[static_cast<std::size_t>(index)];
    const int width = std::min(cut.mcu_columns * mcu, edge_max);
    const int height = std::min(rows * mcu, edge_max);
    const std::size_t capacity = tjBufSize(width, height, name);
    if (strip.capacity < capacity) {
      strip.jpeg = std::make_unique_for_overwrite<unsigned char[]>(capacity);
      strip.capacity = capacity;
    }
    unsigned char* jpeg = strip.jpeg.get();
    unsigned long size = 0;  // NOLINT(google-runtime-int): the library's type
    const int flags = transform_of(picture.subsampling()) | TJFLAG_NOREALLOC;
    if (tjCompressFromYUVPlanes(compressor.get(), planes.data(), width, strides.data(), height,
                                name, &jpeg, &size, quality, flags) != 0) {
      return false;
    }
    strip.size = size;
    return true;
  }
};

JpegEncoder::JpegEncoder() : state_(std::make_unique<State>()) {}
JpegEncoder::~JpegEncoder() = default;

Result<void> JpegEncoder::encode(const YccPicture& picture, int quality, ThreadPool& pool,
                                 Bytes& bytes, const CancelToken& cancel) {
  if (auto fits = check(picture.width(), picture.height(), quality); !fits) return fits;
  const Cut cut = cut_of(picture);
  State& state = *state_;
  while (state.compressors.size() < pool.size()) {
    state.compressors.emplace_back(tjInitCompress());
    if (!state.compressors.back()) {
      state.compressors.pop_back();
      return make_error(ErrorKind::internal, std::string("JPEG: ") + tjGetErrorStr2(nullptr));
    }
  }
  const auto count = static_cast<std::size_t>(cut.strips);
  state.make_room(cut, picture.mcu_side());
  state.failed.assign(pool.size(), 0);
  pool.run(count, [&](std::size_t index, unsigned worker) {
    if (state.failed[worker] != 0 || cancel.cancelled()) return;
    if (!state.compress(picture, cut, quality, static_cast<int>(index),
                        state.compressors[worker])) {
      state.failed[worker] = 1;
    }
  });
  for (std::size_t worker = 0; worker < state.failed.size(); ++worker) {
    if (state.failed[worker] != 0) return fault_of(state.compressors[worker]);
  }
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
  state.pieces.clear();
  for (std::size_t s = 0; s < count; ++s) {
    state.pieces.emplace_back(state.strips[s].jpeg.get(), state.strips[s].size);
  }
  return stitch(state.pieces, {picture.width(), picture.height(), cut.mcu_columns * cut.strip_rows},
                bytes);
}

Result<Bytes> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height, int quality,
                          Subsampling subsampling) {
  if (auto fits = check(width, height, quality); !fits) return fits.error();
  WINDSPLAT_CHECK(rgb.size() ==
                  3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const Compressor compressor(tjInitCompress());
  if (!compressor) {
    return make_error(ErrorKind::internal, std::string("JPEG: ") + tjGetErrorStr2(nullptr));
  }
  unsigned char* jpeg = nullptr;
  unsigned long jpeg_bytes = 0;  // NOLINT(google-runtime-int): the library's type
  const int failed =
      tjCompress2(compressor.get(), rgb.data(), width, 0, height, TJPF_RGB, &jpeg, &jpeg_bytes,
                  library_name(subsampling), quality, transform_of(subsampling));
  const std::unique_ptr<unsigned char, FreeJpeg> owner(jpeg);
  if (failed != 0) return fault_of(compressor);
  return Bytes(jpeg, jpeg + jpeg_bytes);
}

}  // namespace windsplat::image
