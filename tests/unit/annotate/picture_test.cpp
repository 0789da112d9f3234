// Annotated pictures of every format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/annotate/paint/document.hpp"
#include "server/annotate/paint/overlay.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/data/samples/samples.hpp"
#include "server/frame/frame.hpp"
#include "server/image/decode.hpp"
#include "tests/unit/annotate/shown.hpp"
#include "tests/unit/image/decoded_png.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::annotate {
namespace {

using frame::Format;
using testing::HasSubstr;

class AnnotatedPicture : public testing::Test {
 protected:
  void SetUp() override {
    dataset = scene::sample_dataset("climate", {24, 16, 8});
    view.dataset = "climate";
    view.image.width = 400;
    view.image.height = 240;
    show_all(view.annotations);
  }
  frame::Frame produce(Format format, const protocol::View& of, bool measure = false) {
    frame::Encoding encoding;
    encoding.format = format;
    encoding.quality = 100;
    encoding.measure = measure;
    auto made = frame::produce(of, *dataset, encoding, pool, {});
    EXPECT_TRUE(made) << made.error().message;
    return std::move(*made);
  }
  frame::Frame produce(Format format) { return produce(format, view); }

  std::unique_ptr<data::Dataset> dataset;
  protocol::View view;
  ThreadPool pool{2};
};

// Over and under, in linear light and premultiplied.
TEST(Overlay, CompositesBelowAndAboveTheData) {
  Figure figure;
  figure.width = 4;
  figure.height = 2;
  figure.below.emplace_back(Area{{{0, 0}, {2, 0}, {2, 2}, {0, 2}}, {1, 0, 0, 1}});
  figure.above.emplace_back(Area{{{1, 0}, {3, 0}, {3, 2}, {1, 2}}, {0, 1, 0, 0.5}});
  const auto overlay = Overlay::of(figure);
  ASSERT_TRUE(overlay);
  EXPECT_TRUE(overlay->covers(0, 0, 4));
  EXPECT_FALSE(overlay->covers(3, 0, 1));
  // A medium of half transmittance, blue.
  std::vector<float> rgba;
  for (int x = 0; x < 4; ++x) rgba.insert(rgba.end(), {0, 0, 0.5F, 0.5F});
  overlay->composite(0, 1, 4, rgba.data());
  constexpr float code = 0.5F * 1.005F;  // 8 bits of alpha: 128 / 255
  const std::vector<std::array<float, 4>> expected{
      {0.5F, 0, 0.5F, 1},                                      // over red
      {0.5F * (1 - code), code, 0.5F * (1 - code), 1},         // and behind green
      {0, code, 0.5F * (1 - code), code + 0.5F * (1 - code)},  // green alone
      {0, 0, 0.5F, 0.5F}};
  for (std::size_t x = 0; x < 4; ++x) {
    for (std::size_t c = 0; c < 4; ++c) {
      EXPECT_NEAR(rgba[4 * x + c], expected[x][c], 3e-3) << x << ' ' << c;
    }
  }
}

// Tiles without data are never delivered by the engine, and still show what is written there. The
// formats agree to JPEG's rounding.
TEST_F(AnnotatedPicture, JpegAndPngShowTheSame) {
  view.camera.eye = protocol::Vec3{0, -14, 3};  // most of the picture has no data
  const auto png = test::decoded_png(produce(Format::png).bytes);
  for (const bool measured : {false, true}) {
    const frame::Frame jpeg = produce(Format::jpeg, view, measured);
    const auto decoded = image::decode_jpeg(jpeg.bytes, 400, 240);
    ASSERT_TRUE(decoded);
    ASSERT_EQ(decoded->size(), png.rgb.size());
    double sum = 0;
    int most = 0;
    for (std::size_t n = 0; n < png.rgb.size(); ++n) {
      const int apart = std::abs(int{(*decoded)[n]} - int{png.rgb[n]});
      sum += apart;
      most = std::max(most, apart);
    }
    EXPECT_LT(sum / static_cast<double>(png.rgb.size()), 0.6) << measured;
    EXPECT_LT(most, 12) << measured;
  }
}

TEST_F(AnnotatedPicture, NpyAndMeasuredErrorsAreThoseOfTheData) {
  protocol::View plain = view;
  plain.annotations = {};
  const frame::Frame without = produce(Format::npy, plain);
  plain.camera = without.view.camera;  // axes leave room for their texts
  view.camera = without.view.camera;
  EXPECT_EQ(produce(Format::npy).bytes, produce(Format::npy, plain).bytes);
  EXPECT_EQ(produce(Format::png, view, true).error, produce(Format::png, plain, true).error);
  EXPECT_NE(produce(Format::png).bytes, produce(Format::png, plain).bytes);
}

// Two layers of 4 bytes a pixel, which no workspace keeps.
TEST(AnnotatedMemory, CountsForPicturesOfEverySize) {
  for (const auto& [width, height] :
       {std::pair(1, 1), std::pair(1280, 720), std::pair(4096, 2160)}) {
    for (const Format format : {Format::jpeg, Format::png, Format::svg}) {
      const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
      EXPECT_EQ(frame::bytes_beyond_kept(width, height, format, true),
                frame::bytes_beyond_kept(width, height, format, false) + 8 * pixels);
    }
  }
}

TEST_F(AnnotatedPicture, IsTheSameForAnyNumberOfThreads) {
  const frame::Frame two = produce(Format::png);
  ThreadPool one(1);
  frame::Encoding encoding;
  encoding.format = Format::png;
  const auto alone = frame::produce(view, *dataset, encoding, one, {});
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->bytes, two.bytes);
}

// The data cover what is behind them: an opaque surface at the bottom hides the edges below it.
TEST_F(AnnotatedPicture, AnOpaqueSurfaceHidesTheEdgesBehindIt) {
  view.annotations = {};
  view.annotations.box = true;
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  view.scalars.emplace();
  view.camera.eye = protocol::Vec3{0, -0.5, -4};  // from below
  view.camera.up = protocol::Vec3{0, 1, 0};
  const auto shows = [&](bool surface) {
    view.ground.show = surface ? protocol::GroundShow::on : protocol::GroundShow::off;
    view.ground.surface_color = "#000000";
    view.ground.tint = view.ground.coastlines = false;
    const auto picture = test::decoded_png(produce(Format::png).bytes);
    return std::count_if(picture.rgb.begin(), picture.rgb.end(),
                         [](std::uint8_t code) { return code > 60; });
  };
  EXPECT_LT(static_cast<double>(shows(true)), 0.8 * static_cast<double>(shows(false)));
}

TEST_F(AnnotatedPicture, SvgHasItsTextsAsText) {
  const frame::Frame made = produce(Format::svg);
  const std::string svg(made.bytes.begin(), made.bytes.end());
  EXPECT_THAT(svg, testing::StartsWith("<svg "));
  EXPECT_THAT(svg, HasSubstr("viewBox=\"0 0 400 240\""));
  EXPECT_THAT(svg, HasSubstr(">Global circulation with clouds</text>"));
  EXPECT_THAT(svg, HasSubstr("data:image/png;base64,iVBORw0KGgo"));
  EXPECT_EQ(svg.find("nan", svg.find("</text>")), std::string::npos) << "behind the picture";
}

TEST_F(AnnotatedPicture, ATitleOfOnesOwnIsTextToo) {
  view.annotations.title_text = "\u0394\u03b8 < 5 K & rising \u2014 18 January";
  const frame::Frame made = produce(Format::svg);
  const std::string svg(made.bytes.begin(), made.bytes.end());
  EXPECT_THAT(svg, HasSubstr(">\u0394\u03b8 &lt; 5 K &amp; rising \u2014 18 January</text>"));
  EXPECT_EQ(svg.find("Global circulation"), std::string::npos);
}

TEST_F(AnnotatedPicture, ACharacterThatTheFontLacksIsRefused) {
  view.annotations.title_text = "a \u4e2d";
  const auto refused = frame::complete(view, *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/annotations/titleText");
  EXPECT_THAT(refused.error().message, HasSubstr("'\u4e2d'"));
  view.annotations.title_text = "e\u0301 \u00fc \u0416 \u2248 \u2192";
  EXPECT_TRUE(frame::complete(view, *dataset));
}

// SVG aligns texts at their start, middle and end: any other alignment is a shift, so that a text
// lies where the pixels have it.
TEST(Svg, PutsTextsWhereThePixelsHaveThem) {
  for (const double align : {0.0, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0}) {
    Figure figure;
    figure.width = 200;
    figure.height = 20;
    const Text text{"pressure", {100, 15}, 12, align, {}, {}};
    figure.above.emplace_back(text);
    const std::vector<std::uint8_t> rgb(std::size_t{3} * 200 * 20);
    const auto made = encode_svg(rgb, figure, 300);
    ASSERT_TRUE(made);
    const std::string svg(made->begin(), made->end());
    const std::size_t at = svg.find("<text x=\"");
    const double x = std::stod(svg.substr(at + 9));
    const double width = width_of(text.text, text.size);
    const double left = svg.find("\"start\"", at) != std::string::npos ? x
                        : svg.find("\"end\"", at) != std::string::npos ? x - width
                                                                       : x - width / 2;
    EXPECT_NEAR(left, 100 - align * width, 0.01) << align;
  }
}

// Streams of a PDF that are compressed, as text.
std::string inflated(const image::Bytes& pdf) {
  std::string out;
  const std::string text(pdf.begin(), pdf.end());
  for (std::size_t at = text.find("stream\n"); at != std::string::npos;
       at = text.find("stream\n", at + 1)) {
    std::vector<unsigned char> part(1U << 22U);
    uLongf length = part.size();
    const auto* const from = reinterpret_cast<const Bytef*>(text.data() + at + 7);
    if (uncompress(part.data(), &length, from, text.size() - at - 7) == Z_OK) {
      out.append(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(length));
    }
  }
  return out;
}

TEST_F(AnnotatedPicture, PdfHasItsTextsAsTextAtItsResolution) {
  const frame::Frame made = produce(Format::pdf);
  const std::string pdf(made.bytes.begin(), made.bytes.end());
  EXPECT_THAT(pdf, testing::StartsWith("%PDF-1.5"));
  const std::string streams = inflated(made.bytes);
  // 400 x 240 pixels at 300 to the inch are 96 x 57.6 points.
  EXPECT_THAT(pdf + streams, HasSubstr("57.6"));
  EXPECT_THAT(streams, HasSubstr("beginbfchar")) << "glyphs map to characters";
  EXPECT_THAT(pdf + streams, HasSubstr("DejaVuSans"));
  EXPECT_EQ(made.bytes, produce(Format::pdf).bytes) << "equal pictures are equal files";
}

}  // namespace
}  // namespace windsplat::annotate
