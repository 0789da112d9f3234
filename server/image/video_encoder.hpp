// Planes of YCbCr -> a stream of H.264 (ITU-T H.264, High profile, Annex B), by OpenH264 if
// windsplat was built with it.
#pragma once

#include <cstdint>
#include <memory>

#include "server/base/error.hpp"
#include "server/image/encode.hpp"
#include "server/image/ycc.hpp"

namespace windsplat::image {

// A picture of the stream. A key picture contains the parameter sets and refers to no other one;
// any other one refers to the picture before it.
struct VideoUnit {
  Bytes bytes;
  bool key = false;
};

// H.264's quantisation parameter whose step is that of libjpeg's tables at `quality` (1..100).
int quantiser_of(int quality);

// The encoder of one stream. It is allocated by the first picture of a size. Not for concurrent
// use.
class VideoEncoder {
 public:
  // Pictures have 16 to 1920 x 1088 pixels; an edge is at least edge_least.
  static constexpr int edge_least = 16;
  static constexpr std::int64_t pixels_most = std::int64_t{1920} * 1088;

  // Whether this build can encode.
  [[nodiscard]] static bool available();

  // Upper bound on the resident memory of the encoder of such a picture. Its pictures are whole
  // macroblocks with a border of 32 pixels. For noise it grew by 7.6 to 10.0 bytes
  // for each of these pixels and by 1.2 MB (OpenH264 2.3.1; 16 x 16 to 1920 x 1088, 17 x 8192).
  [[nodiscard]] static std::uint64_t bytes_for(int width, int height) {
    constexpr std::uint64_t bytes_a_pixel = 11;
    constexpr std::uint64_t base = std::uint64_t{3} << 19;
    constexpr std::uint64_t macroblock = 16;
    constexpr std::uint64_t borders = std::uint64_t{2} * 32;
    const auto stored = [](int edge) {
      const auto macroblocks = (static_cast<std::uint64_t>(edge) + macroblock - 1) / macroblock;
      return macroblocks * macroblock + borders;
    };
    return base + bytes_a_pixel * stored(width) * stored(height);
  }

  VideoEncoder();
  ~VideoEncoder();
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  // Encodes a picture of 4:2:0 at the quantiser of a JPEG quality. An odd width or height is
  // extended by its last column or row: the decoder crops it. The picture is a key one if `key` is
  // set, and the first of each size is in any case. After an error the next picture is a key one.
  // Errors: invalid (size, subsampling), internal (of the encoder; not available).
  Result<VideoUnit> encode(const YccPicture& picture, int quality, bool key);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::image
