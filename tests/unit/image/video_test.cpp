// H.264 of moving pictures: decoded by OpenH264's own decoder and compared with the planes encoded.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "server/image/jpeg_encoder.hpp"
#include "server/image/video_encoder.hpp"
#ifdef WINDSPLAT_OPENH264
#include "tests/unit/image/decoded_video.hpp"
#endif

namespace image_test {
namespace {

using namespace windsplat::image;  // NOLINT(google-build-using-namespace)

// Waves that move by two pixels a picture, as planes of 4:2:0.
void draw_waves(YccPicture& picture, int width, int height, int time) {
  std::vector<float> rgba(static_cast<std::size_t>(width) * height * 4);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float* pixel = rgba.data() + 4 * (static_cast<std::size_t>(y) * width + x);
      const float at = 0.05F * static_cast<float>(x + 2 * time);
      const float value = 0.5F + 0.5F * std::sin(at) * std::cos(0.03F * static_cast<float>(y) + at);
      pixel[0] = value;
      pixel[1] = value * value;
      pixel[2] = 1 - value;
      pixel[3] = 1;
    }
  }
  picture.reset(width, height, Subsampling::s420, {0, 0, 0});
  picture.put({0, 0, width, height, rgba.data(), static_cast<std::size_t>(4 * width)});
}

TEST(VideoQuantiser, HasTheStepOfTheJpegTables) {
  // A step doubles every six values; the scale of libjpeg is 1 at quality 50, 2 at 25 and 1/2
  // at 75.
  EXPECT_EQ(quantiser_of(50), 28);
  EXPECT_EQ(quantiser_of(25), 34);
  EXPECT_EQ(quantiser_of(75), 22);
  for (int quality = 2; quality <= 100; ++quality) {
    EXPECT_LE(quantiser_of(quality), quantiser_of(quality - 1));
    EXPECT_GE(quantiser_of(quality), 0);
    EXPECT_LE(quantiser_of(quality), 51);
  }
}

#ifdef WINDSPLAT_OPENH264

using decoded_video::Decoder;

struct Size {
  int width;
  int height;
};

TEST(VideoEncoder, EveryPictureOfEverySizeIsDecodedInOrder) {
  for (const auto& [width, height] :
       {Size{320, 180}, Size{321, 179}, Size{17, 16}, Size{15, 333}, Size{640, 359}}) {
    SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
    VideoEncoder encoder;
    Decoder decoder;
    YccPicture picture;
    for (int time = 0; time < 6; ++time) {
      draw_waves(picture, width, height, time);
      const auto unit = encoder.encode(picture, 75, false);
      ASSERT_TRUE(unit) << unit.error().message;
      EXPECT_EQ(unit->key, time == 0);
      const auto decoded = decoder.decode(unit->bytes);
      ASSERT_TRUE(decoded) << "picture " << time;
      EXPECT_EQ(decoded->width, width + width % 2);
      EXPECT_EQ(decoded->height, height + height % 2);
      const auto& luma = picture.planes()[0];
      EXPECT_GT(decoded_video::psnr(*decoded, luma.samples, luma.width, width, height), 36);
    }
  }
}

// Reads the bits of a parameter set (ITU-T H.264, 7.2 and 9.1).
class Bits {
 public:
  // `unit` begins with the start code and the header of the set; bytes that prevent start codes are
  // left out (7.3.1).
  explicit Bits(const std::vector<std::uint8_t>& unit) {
    for (std::size_t n = 5; n < unit.size(); ++n) {
      if (n >= 7 && unit[n] == 3 && unit[n - 1] == 0 && unit[n - 2] == 0) continue;
      bytes_.push_back(unit[n]);
    }
  }
  unsigned fixed(int count) {
    unsigned value = 0;
    for (; count > 0; --count, ++at_) {
      value = 2 * value + ((bytes_.at(at_ / 8) >> (7 - at_ % 8)) & 1U);
    }
    return value;
  }
  unsigned variable() {
    int zeros = 0;
    while (fixed(1) == 0) ++zeros;
    return (1U << static_cast<unsigned>(zeros)) - 1 + fixed(zeros);
  }
  void skip_variable(int count) {
    for (; count > 0; --count) variable();
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// A decoder that reorders pictures would show each of them late.
TEST(VideoEncoder, TellsProfileLevelColoursOfJpegAndThatNothingIsReordered) {
  VideoEncoder encoder;
  YccPicture picture;
  draw_waves(picture, 1280, 720, 0);
  const auto unit = encoder.encode(picture, 75, false);
  ASSERT_TRUE(unit);
  const std::vector<std::uint8_t> begin(unit->bytes.begin(), unit->bytes.begin() + 5);
  EXPECT_EQ(begin, (std::vector<std::uint8_t>{0, 0, 0, 1, 0x67}));
  Bits bits(unit->bytes);
  EXPECT_EQ(bits.fixed(8), 100U) << "profile_idc: High";
  bits.fixed(8);
  EXPECT_EQ(bits.fixed(8), 31U) << "level_idc of 3600 macroblocks";
  bits.skip_variable(1);
  EXPECT_EQ(bits.variable(), 1U) << "chroma_format_idc: 4:2:0";
  bits.skip_variable(2);
  bits.fixed(2);
  bits.skip_variable(1);
  ASSERT_EQ(bits.variable(), 0U) << "pic_order_cnt_type";
  bits.skip_variable(2);
  bits.fixed(1);
  EXPECT_EQ(bits.variable(), 79U);
  EXPECT_EQ(bits.variable(), 44U);
  bits.fixed(2);
  if (bits.fixed(1) != 0) bits.skip_variable(4);  // cropping
  ASSERT_EQ(bits.fixed(1), 1U) << "vui_parameters_present_flag";
  ASSERT_EQ(bits.fixed(2), 0U) << "no aspect ratio, no overscan";
  ASSERT_EQ(bits.fixed(1), 1U) << "video_signal_type_present_flag";
  EXPECT_EQ(bits.fixed(3), 5U) << "video_format";
  EXPECT_EQ(bits.fixed(1), 1U) << "video_full_range_flag";
  ASSERT_EQ(bits.fixed(1), 1U) << "colour_description_present_flag";
  EXPECT_EQ(bits.fixed(8), 1U) << "colour_primaries of sRGB";
  EXPECT_EQ(bits.fixed(8), 13U) << "transfer_characteristics of sRGB";
  EXPECT_EQ(bits.fixed(8), 6U) << "matrix_coefficients of BT.601";
  ASSERT_EQ(bits.fixed(5), 0U) << "no chroma location, timing, buffering or pic_struct";
  ASSERT_EQ(bits.fixed(1), 1U) << "bitstream_restriction_flag";
  bits.fixed(1);
  bits.skip_variable(4);
  EXPECT_EQ(bits.variable(), 0U) << "max_num_reorder_frames";
}

TEST(VideoEncoder, AKeyPictureNeedsNoEarlierOne) {
  VideoEncoder encoder;
  YccPicture picture;
  for (int time = 0; time < 4; ++time) {
    draw_waves(picture, 320, 180, time);
    const auto unit = encoder.encode(picture, 75, time == 3);
    ASSERT_TRUE(unit);
    EXPECT_EQ(unit->key, time == 0 || time == 3);
    Decoder fresh;
    const auto decoded = fresh.decode(unit->bytes);
    EXPECT_EQ(decoded.has_value(), unit->key);
  }
}

TEST(VideoEncoder, AnotherSizeBeginsWithAKeyPictureThatTheSameDecoderReads) {
  VideoEncoder encoder;
  Decoder decoder;
  YccPicture picture;
  for (const auto& [width, height] : {Size{320, 180}, Size{160, 90}, Size{321, 181}}) {
    for (int time = 0; time < 3; ++time) {
      draw_waves(picture, width, height, time);
      const auto unit = encoder.encode(picture, 75, false);
      ASSERT_TRUE(unit);
      EXPECT_EQ(unit->key, time == 0);
      const auto decoded = decoder.decode(unit->bytes);
      ASSERT_TRUE(decoded);
      EXPECT_EQ(decoded->width, width + width % 2);
    }
  }
}

TEST(VideoEncoder, QualityChangesWithoutAKeyPicture) {
  VideoEncoder encoder;
  Decoder decoder;
  YccPicture picture;
  double coarse = 0;
  double fine = 0;
  for (int time = 0; time < 12; ++time) {
    draw_waves(picture, 320, 180, time);
    const auto unit = encoder.encode(picture, time < 6 ? 40 : 85, false);
    ASSERT_TRUE(unit);
    EXPECT_EQ(unit->key, time == 0);
    const auto decoded = decoder.decode(unit->bytes);
    ASSERT_TRUE(decoded);
    const auto& luma = picture.planes()[0];
    (time < 6 ? coarse : fine) = decoded_video::psnr(*decoded, luma.samples, luma.width, 320, 180);
  }
  // 12 steps of the quantiser are a factor of 4, 12 dB for noise; smooth pictures lose less.
  EXPECT_GT(fine, coarse + 3);
}

TEST(VideoEncoder, TakesLessThanHalfOfTheBytesOfJpeg) {
  VideoEncoder encoder;
  JpegEncoder jpeg;
  windsplat::ThreadPool pool(1);
  YccPicture picture;
  std::size_t video_bytes = 0;
  std::size_t jpeg_bytes = 0;
  for (int time = 0; time < 8; ++time) {
    draw_waves(picture, 320, 180, time);
    const auto unit = encoder.encode(picture, 75, false);
    Bytes bytes;
    ASSERT_TRUE(unit && jpeg.encode(picture, 75, pool, bytes));
    if (time == 0) continue;
    video_bytes += unit->bytes.size();
    jpeg_bytes += bytes.size();
  }
  EXPECT_LT(2 * video_bytes, jpeg_bytes);
}

TEST(VideoEncoder, RefusesWhatItCannotEncode) {
  VideoEncoder encoder;
  YccPicture picture;
  draw_waves(picture, 14, 100, 0);
  EXPECT_FALSE(encoder.encode(picture, 75, false));
  picture.reset(1922, 1088, Subsampling::s420, {0, 0, 0});
  EXPECT_FALSE(encoder.encode(picture, 75, false));
  picture.reset(320, 180, Subsampling::s444, {0, 0, 0});
  EXPECT_FALSE(encoder.encode(picture, 75, false));
  draw_waves(picture, 320, 180, 0);
  const auto unit = encoder.encode(picture, 75, false);
  ASSERT_TRUE(unit) << "a refusal does not spoil the encoder";
  EXPECT_TRUE(unit->key);
}

#ifndef WINDSPLAT_SANITIZED  // its shadow memory counts

std::uint64_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t all = 0;
  std::uint64_t resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

// Noise, whose units are the longest.
TEST(VideoEncoder, TakesNoMoreMemoryThanItsBoundAlsoForNarrowPictures) {
  for (const auto& [width, height] : {Size{320, 180}, Size{17, 8192}, Size{200, 8000}}) {
    SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
    std::vector<float> rgba(static_cast<std::size_t>(width) * height * 4, 1.0F);
    unsigned state = 1;
    for (std::size_t n = 0; n < rgba.size(); ++n) {
      state = state * 1664525U + 1013904223U;  // Numerical Recipes, 7.1
      if (n % 4 != 3) rgba[n] = static_cast<float>(state >> 8U) / 16777216.0F;
    }
    YccPicture picture;
    picture.reset(width, height, Subsampling::s420, {0, 0, 0});
    picture.put({0, 0, width, height, rgba.data(), static_cast<std::size_t>(4 * width)});
    std::array<VideoEncoder, 3> encoders;
    const std::uint64_t before = resident_bytes();
    for (VideoEncoder& encoder : encoders) {
      for (int time = 0; time < 3; ++time) ASSERT_TRUE(encoder.encode(picture, 75, time == 2));
    }
    EXPECT_LE(resident_bytes(), before + encoders.size() * VideoEncoder::bytes_for(width, height));
  }
}

#endif

#else

TEST(VideoEncoder, IsNotAvailableWithoutTheLibrary) {
  EXPECT_FALSE(VideoEncoder::available());
  YccPicture picture;
  draw_waves(picture, 32, 32, 0);
  EXPECT_FALSE(VideoEncoder().encode(picture, 75, false));
}

#endif

}  // namespace
}  // namespace image_test
