#include "server/image/video_encoder.hpp"

#include <wels/codec_api.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace windsplat::image {
namespace {

// ITU-T H.264, table E-3 to E-5: the codes of a JPEG's colours.
constexpr unsigned char primaries_srgb = 1;  // BT.709
constexpr unsigned char transfer_srgb = 13;  // IEC 61966-2-1
constexpr unsigned char matrix_bt601 = 6;    // SMPTE 170M, the same as BT.601
constexpr unsigned char format_unspecified = 5;

constexpr int unlimited_rate = 0;  // bits/s
// At this rate the level that the stream names follows from the size of its pictures alone.
constexpr float frames_per_s = 25;

struct Destroy {
  void operator()(ISVCEncoder* encoder) const {
    encoder->Uninitialize();
    WelsDestroySVCEncoder(encoder);
  }
};
using Encoder = std::unique_ptr<ISVCEncoder, Destroy>;

Error failed(const std::string& what, int code) {
  return make_error(ErrorKind::internal,
                    "OpenH264 could not " + what + " (code " + std::to_string(code) + ")");
}

int even(int edge) { return edge + edge % 2; }

void describe_colours(SSpatialLayerConfig& layer) {
  layer.bVideoSignalTypePresent = true;
  layer.uiVideoFormat = format_unspecified;
  layer.bFullRange = true;
  layer.bColorDescriptionPresent = true;
  layer.uiColorPrimaries = primaries_srgb;
  layer.uiTransferCharacteristics = transfer_srgb;
  layer.uiColorMatrix = matrix_bt601;
}

// Constant quantiser, no rate control: the pacing chooses the quality of each picture. One thread
// and one slice; no frame is skipped, and none but the first is a key one unless that is asked for.
Result<Encoder> make_encoder(int width, int height, int quantiser) {
  ISVCEncoder* made = nullptr;
  if (const int code = WelsCreateSVCEncoder(&made); code != 0 || made == nullptr) {
    return failed("be created", code);
  }
  Encoder encoder(made);
  int quiet = WELS_LOG_QUIET;
  encoder->SetOption(ENCODER_OPTION_TRACE_LEVEL, &quiet);
  SEncParamExt settings;
  encoder->GetDefaultParams(&settings);
  settings.iUsageType = CAMERA_VIDEO_REAL_TIME;
  settings.iPicWidth = width;
  settings.iPicHeight = height;
  settings.iTargetBitrate = unlimited_rate;
  settings.iRCMode = RC_OFF_MODE;
  settings.fMaxFrameRate = frames_per_s;
  settings.iTemporalLayerNum = 1;
  settings.iSpatialLayerNum = 1;
  settings.iComplexityMode = LOW_COMPLEXITY;
  settings.uiIntraPeriod = 0;
  settings.iNumRefFrame = 1;
  settings.eSpsPpsIdStrategy = CONSTANT_ID;
  settings.iEntropyCodingModeFlag = 1;
  settings.bEnableFrameSkip = false;
  settings.iMultipleThreadIdc = 1;
  settings.bEnableDenoise = false;
  settings.bEnableBackgroundDetection = false;
  settings.bEnableAdaptiveQuant = false;
  settings.bEnableSceneChangeDetect = false;
  SSpatialLayerConfig& layer = settings.sSpatialLayers[0];
  layer.iVideoWidth = width;
  layer.iVideoHeight = height;
  layer.fFrameRate = frames_per_s;
  layer.uiProfileIdc = PRO_HIGH;
  layer.iDLayerQp = quantiser;
  layer.sSliceArgument.uiSliceMode = SM_SINGLE_SLICE;
  describe_colours(layer);
  if (const int code = encoder->InitializeExt(&settings); code != 0) {
    return failed("begin a stream of " + std::to_string(width) + " x " + std::to_string(height),
                  code);
  }
  int annex_b = videoFormatI420;
  encoder->SetOption(ENCODER_OPTION_DATAFORMAT, &annex_b);
  return encoder;
}

Bytes bytes_of(const SFrameBSInfo& out) {
  Bytes bytes;
  bytes.reserve(static_cast<std::size_t>(std::max(out.iFrameSizeInBytes, 0)));
  for (int n = 0; n < out.iLayerNum; ++n) {
    const SLayerBSInfo& layer = out.sLayerInfo[n];
    std::size_t length = 0;
    for (int unit = 0; unit < layer.iNalCount; ++unit) {
      length += static_cast<std::size_t>(layer.pNalLengthInByte[unit]);
    }
    bytes.insert(bytes.end(), layer.pBsBuf, layer.pBsBuf + length);
  }
  return bytes;
}

}  // namespace

struct VideoEncoder::State {
  Encoder encoder;
  int width = 0;
  int height = 0;
  int quantiser = 0;
  long long pictures = 0;  // NOLINT(google-runtime-int): the type of OpenH264's time stamps

  Result<void> prepare(int picture_width, int picture_height, int wanted, bool key);
  Result<VideoUnit> encode(const YccPicture& picture);
};

Result<void> VideoEncoder::State::prepare(int picture_width, int picture_height, int wanted,
                                          bool key) {
  if (!encoder || width != picture_width || height != picture_height) {
    encoder.reset();
    auto made = make_encoder(picture_width, picture_height, wanted);
    if (!made) return made.error();
    encoder = std::move(*made);
    width = picture_width;
    height = picture_height;
    quantiser = wanted;
    return {};
  }
  if (quantiser != wanted) {
    SEncParamExt settings;
    if (const int code = encoder->GetOption(ENCODER_OPTION_SVC_ENCODE_PARAM_EXT, &settings);
        code != 0) {
      return failed("tell its settings", code);
    }
    settings.sSpatialLayers[0].iDLayerQp = wanted;
    if (const int code = encoder->SetOption(ENCODER_OPTION_SVC_ENCODE_PARAM_EXT, &settings);
        code != 0) {
      return failed("change the quantiser", code);
    }
    quantiser = wanted;
  }
  if (key) encoder->ForceIntraFrame(true);
  return {};
}

Result<VideoUnit> VideoEncoder::State::encode(const YccPicture& picture) {
  SSourcePicture source{};
  source.iColorFormat = videoFormatI420;
  source.iPicWidth = width;
  source.iPicHeight = height;
  constexpr long long ms_per_s = 1000;  // NOLINT(google-runtime-int)
  source.uiTimeStamp = pictures++ * ms_per_s / static_cast<int>(frames_per_s);
  for (std::size_t p = 0; p < picture.planes().size(); ++p) {
    source.iStride[p] = picture.planes()[p].width;
    source.pData[p] = picture.planes()[p].samples;
  }
  SFrameBSInfo out{};
  const int code = encoder->EncodeFrame(&source, &out);
  const bool coded = out.eFrameType == videoFrameTypeIDR || out.eFrameType == videoFrameTypeP;
  if (code != 0 || !coded) return failed("encode a picture", code != 0 ? code : out.eFrameType);
  return VideoUnit{bytes_of(out), out.eFrameType == videoFrameTypeIDR};
}

bool VideoEncoder::available() { return true; }

VideoEncoder::VideoEncoder() : state_(std::make_unique<State>()) {}
VideoEncoder::~VideoEncoder() = default;

Result<VideoUnit> VideoEncoder::encode(const YccPicture& picture, int quality, bool key) {
  const int width = even(picture.width());
  const int height = even(picture.height());
  if (picture.subsampling() != Subsampling::s420 || std::min(width, height) < edge_least ||
      std::int64_t{width} * height > pixels_most) {
    return make_error(ErrorKind::invalid, "no video of a picture of " + std::to_string(width) +
                                              " x " + std::to_string(height) + " pixels");
  }
  const auto ready = state_->prepare(width, height, quantiser_of(quality), key);
  auto unit = ready ? state_->encode(picture) : Result<VideoUnit>(ready.error());
  if (!unit) state_->encoder.reset();
  return unit;
}

}  // namespace windsplat::image
