// Two pictures side by side: pixels, views and titles.
#include "server/frame/pair/pair.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "server/cli/beside/panels.hpp"
#include "server/cli/beside/share.hpp"
#include "server/cli/beside/sheets.hpp"
#include "server/image/decode.hpp"
#include "tests/unit/image/decoded_png.hpp"

namespace windsplat::cli {
namespace {

using testing::HasSubstr;

class Pair : public testing::Test {
 protected:
  void SetUp() override {
    arguments_.dataset = "tornado:16";
    arguments_.settings = {"/image/width=160", "/image/height=120"};
  }

  image::Bytes drawn(std::vector<Panel> panels, frame::Format format = frame::Format::png) {
    frame::Encoding encoding;
    encoding.format = format;
    encoding.quality = 100;
    auto sheets = Sheets::of(panels, encoding, pool_);
    EXPECT_TRUE(sheets);
    auto sheet = sheets->draw({});
    EXPECT_TRUE(sheet) << sheet.error().message;
    return sheet ? std::move(sheet->bytes) : image::Bytes();
  }
  std::vector<Panel> panels() {
    auto opened = open_panels(arguments_);
    EXPECT_TRUE(opened) << opened.error().message;
    return opened ? std::move(*opened) : std::vector<Panel>();
  }
  Error refused() {
    const auto opened = open_panels(arguments_);
    EXPECT_FALSE(opened);
    return opened ? Error() : opened.error();
  }
  // The columns [first, first + width) of a picture.
  static std::vector<std::uint8_t> columns(const test::DecodedPng& png, int first, int width) {
    std::vector<std::uint8_t> out;
    for (int y = 0; y < png.height; ++y) {
      const auto row =
          png.rgb.begin() + std::ptrdiff_t{3} * (std::ptrdiff_t{y} * png.width + first);
      out.insert(out.end(), row, row + std::ptrdiff_t{3} * width);
    }
    return out;
  }

  ViewArguments arguments_;
  ThreadPool pool_{2};
};

// All that two datasets could determine differently is given.
TEST_F(Pair, HasThePixelsOfTheTwoPictures) {
  arguments_.figure = true;
  for (const char* given :
       {"/camera/eye=[1, -5, 2]", "/camera/target=[0, 0, 0]", "/vector/length=0.3",
        "/vector/magnitudeRange=[0, 70]", "/vector/minMagnitude=2", "/vector/color/range=[0, 60]",
        "/vector/color/by=magnitude",
        "/scalars=[{\"field\": \"cloud\", \"color\": {\"range\": [0, 1]}, "
        "\"extinction\": [[0, 0], [1, 9]]}]"}) {
    arguments_.settings.emplace_back(given);
  }
  ViewArguments second = arguments_;
  second.dataset = "tornado:20";
  second.step = "5";
  for (ViewArguments* alone : {&arguments_, &second}) {
    alone->settings.emplace_back("/annotations/titleText=" + alone->dataset);
  }
  const auto left = test::decoded_png(drawn(open_panels(arguments_).value()));
  const auto right = test::decoded_png(drawn(open_panels(second).value()));
  arguments_.beside = "tornado:20";
  arguments_.beside_step = "5";
  arguments_.beside_settings = {"/annotations/titleText=tornado:20"};
  const auto both = test::decoded_png(drawn(panels()));
  const int gap = frame::gap_of_pair(120);
  EXPECT_EQ(both.height, 120);
  ASSERT_EQ(both.width, 2 * 160 + gap);
  EXPECT_TRUE(columns(both, 0, 160) == left.rgb);
  EXPECT_TRUE(columns(both, 160 + gap, 160) == right.rgb);
  EXPECT_FALSE(left.rgb == right.rgb);
  EXPECT_THAT(columns(both, 160, gap), testing::Each(128));
}

TEST_F(Pair, IsTheSameInAJpegButForItsCompression) {
  arguments_.beside_step = "2";
  const auto png = test::decoded_png(drawn(panels()));
  const auto jpeg = image::decode_jpeg(drawn(panels(), frame::Format::jpeg), png.width, 120);
  ASSERT_TRUE(jpeg);
  ASSERT_EQ(jpeg->size(), png.rgb.size());
  double sum = 0;
  for (std::size_t n = 0; n < jpeg->size(); ++n) {
    sum += std::abs(int{(*jpeg)[n]} - int{png.rgb[n]});
  }
  EXPECT_LT(sum / static_cast<double>(jpeg->size()), 1);
}

TEST_F(Pair, HasEqualDefaults) {
  arguments_.beside = "tornado:20";
  const auto both = panels();
  const protocol::View& left = both[0].view;
  const protocol::View& right = both[1].view;
  EXPECT_EQ(left.vector.length, right.vector.length);
  EXPECT_EQ(left.vector.min_magnitude, right.vector.min_magnitude);
  EXPECT_EQ(left.vector.magnitude_range, right.vector.magnitude_range);
  EXPECT_EQ(left.vector.color.range, right.vector.color.range);
  EXPECT_EQ(left.scalars->front().extinction, right.scalars->front().extinction);
  EXPECT_EQ(left.scalars->front().color.range, right.scalars->front().color.range);
}

// A flat box beside a cube, which is framed from elsewhere.
TEST_F(Pair, HasTheCameraOfTheFirstWhateverTheSecondIs) {
  arguments_.beside = "climate:24x16x8";
  const auto both = panels();
  EXPECT_EQ(both[0].view.camera, both[1].view.camera);
  const auto alone = frame::complete(protocol::View{}, *both[1].dataset);
  ASSERT_TRUE(alone);
  EXPECT_NE(both[1].view.camera, alone->view().camera);
}

TEST_F(Pair, KeepsTheRangesThatAreGiven) {
  arguments_.settings.emplace_back("/vector/color/range=[0, 50]");
  arguments_.beside_settings = {"/vector/color/range=[20, 90]"};
  const auto both = panels();
  EXPECT_EQ(both[0].view.vector.color.range, (protocol::Range{0, 50}));
  EXPECT_EQ(both[1].view.vector.color.range, (protocol::Range{20, 90}));
}

TEST_F(Pair, OfAFieldAndItsDifferenceHasARangeForEach) {
  arguments_.settings.emplace_back("/scalars=[{\"field\": \"vorticity\"}]");
  arguments_.step = "9";
  arguments_.beside_settings = {"/difference/step=0"};
  const auto both = panels();
  const protocol::Range range = both[1].view.scalars->front().color.range.value();
  EXPECT_NE(both[0].view.scalars->front().color.range, range);
  EXPECT_EQ(range[0], -range[1]);
}

// Two completed views of a field "t" with wind.
class SharedDefaults : public testing::Test {
 protected:
  SharedDefaults() {
    for (data::DatasetInfo* info : {&first_info_, &second_info_}) {
      data::FieldInfo t;
      t.name = "t";
      t.units = "K";
      t.component_units = {"K"};
      t.components = {"t"};
      data::FieldInfo wind;
      wind.name = "wind";
      wind.kind = data::FieldKind::vector;
      wind.components = {"u", "v"};
      wind.component_units = {"m s-1", "m s-1"};
      info->fields = {t, wind};
    }
    first_ = completed({250, 300}, {0, 20}, 4);
    second_ = completed({270, 320}, {0, 50}, 7);
  }
  static protocol::View completed(const protocol::Range& colors, const protocol::Range& speeds,
                                  double top) {
    protocol::View view;
    view.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
    view.vector.length = top;
    view.vector.magnitude_range = speeds;
    view.vector.color.by = protocol::ColorBy::magnitude;
    view.vector.color.range = speeds;
    view.scalars.emplace(1);
    view.scalars->front().field = "t";
    view.scalars->front().color.range = colors;
    view.scalars->front().extinction = {{{colors[0], 0}, {colors[1], top}}};
    protocol::SurfaceView section;
    section.field = "t";
    section.slice = protocol::SliceView{};
    section.color.range = colors;
    view.surfaces = {section};
    return view;
  }
  void share() {
    protocol::View bare = asked_;
    bare.surfaces.resize(1);
    share_defaults({{{bare, first_, first_info_}, {bare, second_, second_info_}}});
  }
  [[nodiscard]] std::array<protocol::Range, 2> colors() const {
    return {first_.scalars->front().color.range.value(),
            second_.scalars->front().color.range.value()};
  }

  data::DatasetInfo first_info_, second_info_;
  protocol::View asked_, first_, second_;
};

TEST_F(SharedDefaults, CoverBothRangesAndHaveTheLengthsOfTheFirst) {
  share();
  for (const protocol::View* view : {&first_, &second_}) {
    EXPECT_EQ(view->scalars->front().color.range, (protocol::Range{250, 320}));
    EXPECT_EQ(view->surfaces.front().color.range, (protocol::Range{250, 320}));
    EXPECT_EQ(view->vector.magnitude_range, (protocol::Range{0, 50}));
    EXPECT_EQ(view->vector.color.range, (protocol::Range{0, 50}));
    EXPECT_EQ(view->vector.length, 4);
    EXPECT_EQ(view->scalars->front().extinction->back()[1], 4);
  }
}

TEST_F(SharedDefaults, AreNotThoseOfOtherUnitsOrOfADifference) {
  second_info_.fields[0].units = "degC";
  second_info_.fields[0].component_units = {"degC"};
  share();
  EXPECT_EQ(colors()[0], (protocol::Range{250, 300}));
  EXPECT_EQ(colors()[1], (protocol::Range{270, 320}));
  EXPECT_EQ(second_.vector.length, 4) << "winds have equal units";
  second_info_ = first_info_;
  second_.difference = protocol::DifferenceView{{}, 0};
  share();
  EXPECT_EQ(colors()[1], (protocol::Range{270, 320}));
}

TEST_F(SharedDefaults, LeaveWhatIsGivenAlone) {
  asked_.vector.length = 1;
  asked_.scalars = first_.scalars;
  share();
  EXPECT_EQ(colors()[0], (protocol::Range{250, 300}));
  EXPECT_EQ(colors()[1], (protocol::Range{270, 320}));
  EXPECT_EQ(second_.vector.length, 7) << "as completed";
  EXPECT_EQ(second_.vector.magnitude_range, (protocol::Range{0, 50}));
}

TEST_F(Pair, SaysWhatEachPictureIs) {
  arguments_.beside = "tornado:20";
  auto both = panels();
  EXPECT_TRUE(both[0].view.annotations.title && both[1].view.annotations.step_time);
  arguments_.settings.emplace_back("/annotations/titleText=ensemble");
  both = panels();
  EXPECT_EQ(both[0].view.annotations.title_text, "ensemble  \u00b7  tornado:16");
  EXPECT_EQ(both[1].view.annotations.title_text, "ensemble  \u00b7  tornado:20");
  arguments_.beside_settings = {"/annotations/titleText=control"};
  both = panels();
  EXPECT_EQ(both[0].view.annotations.title_text, "ensemble");
  EXPECT_EQ(both[1].view.annotations.title_text, "control");
  arguments_.beside.clear();
  arguments_.beside_settings = {"/vector/stride=2", "/vector/r2=3"};
  both = panels();
  EXPECT_EQ(both[0].view.annotations.title_text, "ensemble");
  EXPECT_EQ(both[1].view.annotations.title_text,
            "ensemble  \u00b7  /vector/stride=2, /vector/r2=3");
  arguments_.beside_settings = {"/difference/step=0"};
  EXPECT_EQ(panels()[1].view.annotations.title_text, "ensemble") << "a line of its own says so";
  arguments_.settings.emplace_back("/annotations/title=false");
  EXPECT_FALSE(panels()[0].view.annotations.title);
}

TEST_F(Pair, HasTheTextsOfBothAsTextsInDocuments) {
  arguments_.beside = "tornado:20";
  arguments_.settings.emplace_back("/annotations/titleText=a");
  arguments_.beside_settings = {"/annotations/titleText=b"};
  const image::Bytes bytes = drawn(panels(), frame::Format::svg);
  const std::string svg(bytes.begin(), bytes.end());
  EXPECT_THAT(
      svg, HasSubstr("viewBox=\"0 0 " + std::to_string(320 + frame::gap_of_pair(120)) + " 120\""));
  const std::size_t right = svg.find("<svg x=\"" + std::to_string(160 + frame::gap_of_pair(120)) +
                                     "\" y=\"0\" width=\"160\"");
  const std::size_t left = svg.find("<svg x=\"0\" y=\"0\" width=\"160\" height=\"120\"");
  ASSERT_LT(left, right);
  ASSERT_NE(right, std::string::npos);
  EXPECT_LT(left, svg.find(">a</text>"));
  EXPECT_LT(svg.find(">a</text>"), right);
  EXPECT_LT(right, svg.find(">b</text>"));
  EXPECT_NE(svg.find(">b</text>"), std::string::npos);
  const image::Bytes pdf = drawn(panels(), frame::Format::pdf);
  EXPECT_THAT(std::string(pdf.begin(), pdf.end()), testing::StartsWith("%PDF-1.5"));
}

TEST_F(Pair, RefusesWhatCannotBeLinked) {
  arguments_.beside_settings = {"/camera/fovY=20"};
  EXPECT_THAT(refused().message, HasSubstr("the camera of the first"));
  arguments_.beside_settings = {"/image/width=200"};
  EXPECT_THAT(refused().message, HasSubstr("the size of the first"));
  arguments_.beside_settings = {"/dataset=\"climate\""};
  EXPECT_THAT(refused().message, HasSubstr("that of --beside DATASET"));
  ASSERT_FALSE(refused().at.empty());
  EXPECT_EQ(refused().at.front().pointer, "/dataset");
  arguments_.beside = "climate:24x16x8";
  EXPECT_THAT(refused().message, HasSubstr("that of --beside DATASET"));
  arguments_.beside.clear();
  arguments_.beside_settings = {"/quality/maxError=0.01"};
  EXPECT_THAT(refused().message, HasSubstr("budgetMs and maxError"));
  arguments_.beside_settings = {"/vector/field=current"};
  EXPECT_THAT(refused().message, HasSubstr("of the picture beside: "));
  arguments_.beside_settings = {"/vector/stride"};
  EXPECT_THAT(refused().message, HasSubstr("--beside-set '/vector/stride' is not of the form"));
  arguments_.beside_settings.clear();
  arguments_.beside_step = "12";
  EXPECT_THAT(refused().message, HasSubstr("has steps 0 to 11"));
  arguments_.beside_step = "2";
  auto both = panels();
  frame::Encoding npy;
  npy.format = frame::Format::npy;
  EXPECT_FALSE(Sheets::of(both, npy, pool_));
}

}  // namespace
}  // namespace windsplat::cli
