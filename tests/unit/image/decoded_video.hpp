// Decodes H.264 by OpenH264's decoder, for tests of the encoder.
#pragma once

#include <wels/codec_api.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace decoded_video {

struct Luma {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> samples;  // row by row, without gaps
};

class Decoder {
 public:
  Decoder() {
    WelsCreateDecoder(&decoder_);
    int quiet = WELS_LOG_QUIET;
    decoder_->SetOption(DECODER_OPTION_TRACE_LEVEL, &quiet);
    SDecodingParam settings{};
    settings.sVideoProperty.eVideoBsType = VIDEO_BITSTREAM_AVC;
    settings.eEcActiveIdc = ERROR_CON_DISABLE;
    decoder_->Initialize(&settings);
  }
  ~Decoder() {
    decoder_->Uninitialize();
    WelsDestroyDecoder(decoder_);
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  // nullopt: the unit cannot be decoded. The decoder holds pictures of the High profile back to
  // reorder them; none is out of order here.
  std::optional<Luma> decode(std::span<const std::uint8_t> unit) {
    unsigned char* planes[3] = {};
    SBufferInfo info{};
    const auto fault =
        decoder_->DecodeFrameNoDelay(unit.data(), static_cast<int>(unit.size()), planes, &info);
    if (fault != dsErrorFree) return std::nullopt;
    if (info.iBufferStatus != 1) decoder_->FlushFrame(planes, &info);
    if (info.iBufferStatus != 1) return std::nullopt;
    const auto& buffer = info.UsrData.sSystemBuffer;
    Luma out{buffer.iWidth, buffer.iHeight, {}};
    for (int y = 0; y < buffer.iHeight; ++y) {
      const unsigned char* row = planes[0] + static_cast<std::ptrdiff_t>(y) * buffer.iStride[0];
      out.samples.insert(out.samples.end(), row, row + buffer.iWidth);
    }
    return out;
  }

 private:
  ISVCDecoder* decoder_ = nullptr;
};

// Peak signal-to-noise ratio in dB of the upper left width x height samples.
inline double psnr(const Luma& decoded, const std::uint8_t* samples, int stride, int width,
                   int height) {
  double squares = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double apart =
          double{1.0 * decoded.samples[static_cast<std::size_t>(y) * decoded.width + x]} -
          samples[static_cast<std::ptrdiff_t>(y) * stride + x];
      squares += apart * apart;
    }
  }
  if (squares == 0) return std::numeric_limits<double>::infinity();
  return 10 * std::log10(255.0 * 255.0 * width * height / squares);
}

}  // namespace decoded_video
