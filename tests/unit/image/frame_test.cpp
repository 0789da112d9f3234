// frame::produce on a built-in sample: sizes, levels, formats, reports, and frame infos.
#include "server/frame/frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "decoded_png.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/frame/frame_info.hpp"
#include "server/image/decode.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::frame {
namespace {

class Produce : public testing::Test {
 protected:
  void SetUp() override {
    auto source = data::open_sample("tornado", {16, 16, 16}, 2);
    ASSERT_TRUE(source) << source.error().message;
    dataset = std::make_unique<data::Dataset>(std::move(*source), "tornado", 1ULL << 30);
    view.dataset = "tornado";
    view.image.width = 96;
    view.image.height = 64;
  }

  Result<Frame> produce_as(Format format, int level = 0) {
    Encoding encoding;
    encoding.format = format;
    const auto completed = complete(view, *dataset);
    if (!completed) return completed.error();
    const auto prepared = prepare(*completed, {view.method.name, 2 * level}, *dataset, encoding);
    if (!prepared) return prepared.error();
    Workspace workspace;
    return produce(*prepared, *dataset, pool, cancel, workspace);
  }

  std::unique_ptr<data::Dataset> dataset;
  protocol::View view;
  ThreadPool pool{2};
  CancelToken cancel;
};

TEST_F(Produce, EveryFormatHasItsSignature) {
  const auto jpeg = produce_as(Format::jpeg);
  const auto png = produce_as(Format::png);
  const auto npy = produce_as(Format::npy);
  ASSERT_TRUE(jpeg) << jpeg.error().message;
  ASSERT_TRUE(png && npy);
  EXPECT_EQ(std::memcmp(jpeg->bytes.data(), "\xff\xd8\xff", 3), 0);
  EXPECT_EQ(std::memcmp(png->bytes.data(), "\x89PNG\r\n\x1a\n", 8), 0);
  EXPECT_EQ(std::memcmp(npy->bytes.data(), "\x93NUMPY", 6), 0);
}

TEST_F(Produce, LevelHalvesBothSidesAndKeepsAtLeastOnePixel) {
  for (const auto& [level, width, height] :
       {std::array{0, 96, 64}, {1, 48, 32}, {3, 12, 8}, {6, 2, 1}, {15, 2, 1}}) {
    const auto frame = produce_as(Format::png, level);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->width, width) << level;
    EXPECT_EQ(frame->height, height) << level;
    EXPECT_EQ(frame->view.image.width, 96) << "the reported view is the requested one";
  }
}

// The largest magnitude and value of the fields are below the thresholds.
TEST_F(Produce, EmptyPictureSaysWhy) {
  const auto drawn = produce_as(Format::png);
  ASSERT_TRUE(drawn) << drawn.error().message;
  EXPECT_EQ(drawn->empty, "");
  EXPECT_EQ(frame_info(*drawn, view).empty, "");

  const auto why = [this] {
    const auto frame = produce_as(Format::jpeg);
    return frame ? frame->empty : "failed: " + frame.error().message;
  };
  view.scalars = std::vector<protocol::ScalarView>();
  view.vector.min_magnitude = 1e6;
  view.vector.magnitude_range = protocol::Range{0, 2e6};
  EXPECT_THAT(why(), testing::HasSubstr("is below /vector/minMagnitude 1e+06"));
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 3};
  EXPECT_THAT(why(), testing::HasSubstr("is below /vector/minMagnitude 1e+06"));
  view.geometry.slice.reset();
  view.vector = {};
  view.camera.eye = protocol::Vec3{0, -5, 0};
  view.camera.target = protocol::Vec3{0, -10, 0};
  EXPECT_EQ(why(), "the camera does not show the data");
  view.method.name = protocol::MethodName::kernel;
  EXPECT_EQ(why(), "the camera does not show the data");
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  EXPECT_THAT(why(), testing::HasSubstr("the view shows no field"));
}

TEST_F(Produce, EmptyMediumSaysWhy) {
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  protocol::ScalarView cloud;
  cloud.field = "cloud";
  cloud.extinction = std::vector<std::array<double, 2>>{{1e6, 0}, {2e6, 5}};
  view.scalars = std::vector<protocol::ScalarView>{cloud};
  for (const auto name : {protocol::MethodName::slab, protocol::MethodName::reference}) {
    view.method.name = name;
    Encoding encoding;
    encoding.allow_reference = true;
    const auto frame = produce(view, *dataset, encoding, pool, cancel);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_THAT(frame->empty,
                testing::HasSubstr("/scalars/0/extinction is 0 at every value of \"cloud\""));
  }
}

// Black pictures of surfaces said nothing.
TEST_F(Produce, EmptySurfaceSaysWhy) {
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  view.scalars = std::vector<protocol::ScalarView>();
  protocol::SurfaceView surface;
  surface.field = "cloud";
  surface.isovalue = 1e6;
  view.surfaces = {surface};
  Encoding encoding;
  encoding.allow_reference = true;
  for (const auto name : {protocol::MethodName::slab, protocol::MethodName::kernel,
                          protocol::MethodName::reference}) {
    view.method.name = name;
    const auto frame = produce(view, *dataset, encoding, pool, cancel);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_THAT(frame->empty, testing::StartsWith("/surfaces/0/isovalue 1e+06 is beyond"));
  }
  surface.isovalue.reset();
  surface.slice = protocol::SliceView{protocol::GridAxis::z, 3};
  view.surfaces.push_back(surface);
  EXPECT_EQ(produce(view, *dataset, encoding, pool, cancel)->empty, "") << "the other one is seen";
}

TEST(EmptyPicture, MaskedSamplesAreNamed) {
  auto source = std::make_unique<scene::FakeSource>(
      scene::atmosphere_grid(),
      std::vector<data::FieldInfo>{scene::wind_info(), scene::scalar_info("cloud", "1")}, 1);
  source->values = [](const std::string& field, std::size_t n) {
    // Of the wind, a level is masked; of the cloud, everything.
    return field == "wind" && n >= 12 ? 1.0 : std::nan("");
  };
  const auto dataset = scene::dataset_of(std::move(source));
  protocol::View view;
  view.dataset = "fake";
  ThreadPool pool{1};
  const auto whole = produce(view, *dataset, {}, pool, {});
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->empty, "");
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 0};
  const auto slice = produce(view, *dataset, {}, pool, {});
  ASSERT_TRUE(slice) << slice.error().message;
  EXPECT_EQ(slice->empty.rfind("every sample of \"wind\" in the slice is masked at step 0", 0), 0U)
      << slice->empty;
  view.geometry.slice.reset();
  view.region.where = {{"cloud", {0, 1}}};
  const auto filtered = produce(view, *dataset, {}, pool, {});
  ASSERT_TRUE(filtered) << filtered.error().message;
  EXPECT_THAT(filtered->empty,
              ::testing::HasSubstr("in the region is masked at step 0, or left out "
                                   "by /region/where"));
}

// Mean coverage must not depend on the resolution.
TEST_F(Produce, LowerLevelShowsTheSamePicture) {
  view.image.width = 256;
  view.image.height = 192;
  const auto mean_opacity = [](const Frame& frame) {
    const std::size_t values = 4 * static_cast<std::size_t>(frame.width * frame.height);
    std::vector<float> rgba(values);
    std::memcpy(rgba.data(), frame.bytes.data() + frame.bytes.size() - 4 * values, 4 * values);
    double sum = 0;
    for (std::size_t i = 3; i < values; i += 4) sum += rgba[i];
    return sum / static_cast<double>(frame.width * frame.height);
  };
  const auto whole = produce_as(Format::npy, 0);
  const auto half = produce_as(Format::npy, 1);
  ASSERT_TRUE(whole && half);
  EXPECT_GT(mean_opacity(*whole), 0);
  EXPECT_NEAR(mean_opacity(*half) / mean_opacity(*whole), 1, 0.1);
}

TEST_F(Produce, ReportListsShownFieldsAndTheirBytes) {
  const auto both = produce_as(Format::jpeg);
  ASSERT_TRUE(both) << both.error().message;
  const auto& info = dataset->info();
  const data::FieldInfo* wind = info.first(data::FieldKind::vector);
  const data::FieldInfo* scalar = info.first(data::FieldKind::scalar);
  ASSERT_TRUE(wind != nullptr && scalar != nullptr);

  constexpr std::int64_t one_component = std::int64_t{16} * 16 * 16 * 4;
  protocol::ScalarView medium;
  medium.field = scalar->name;
  medium.extinction = {{-1e6, 1.0}, {1e6, 1.0}};
  protocol::ScalarView clear = medium;
  clear.extinction = {{-1e6, 0.0}, {1e6, 0.0}};

  view.scalars = {clear, medium, medium};
  const auto with_medium = produce_as(Format::jpeg);
  ASSERT_TRUE(with_medium) << with_medium.error().message;
  EXPECT_EQ(with_medium->work.fields, (std::vector<std::string>{wind->name, scalar->name}));
  EXPECT_EQ(with_medium->work.bytes,
            one_component * static_cast<std::int64_t>(wind->components.size() + 1));

  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  const auto medium_only = produce_as(Format::jpeg);
  ASSERT_TRUE(medium_only);
  EXPECT_EQ(medium_only->work.fields, std::vector<std::string>{scalar->name});
  EXPECT_EQ(medium_only->work.bytes, one_component);

  view.scalars = {clear};
  const auto nothing = produce_as(Format::jpeg);
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->work.fields.empty());
  EXPECT_EQ(nothing->work.bytes, 0);
}

TEST_F(Produce, BackgroundIsPartOfThePictureButNotOfTheArray) {
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  view.scalars.emplace();
  view.image.background = "#204060";
  const auto png = produce_as(Format::png);
  const auto npy = produce_as(Format::npy);
  ASSERT_TRUE(png && npy);
  const std::vector<std::uint8_t> rgb = test::decoded_png(png->bytes).rgb;
  ASSERT_EQ(rgb.size(), std::size_t{3} * 96 * 64);
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    ASSERT_EQ(rgb[i], 0x20);
    ASSERT_EQ(rgb[i + 1], 0x40);
    ASSERT_EQ(rgb[i + 2], 0x60);
  }
  const std::size_t values_at = npy->bytes.size() - std::size_t{96} * 64 * 16;
  for (std::size_t i = values_at; i < npy->bytes.size(); ++i) ASSERT_EQ(npy->bytes[i], 0);
}

TEST_F(Produce, AnyThreadCountGivesTheSameBytes) {
  ThreadPool one(1);
  const auto alone = produce(view, *dataset, {Format::png}, one, cancel);
  const auto shared = produce_as(Format::png);
  ASSERT_TRUE(alone && shared);
  EXPECT_EQ(alone->bytes, shared->bytes);
}

// The two ways from the engine to bytes: JPEG tile by tile, PNG from an image.
TEST_F(Produce, JpegShowsWhatPngShows) {
  view.image.background = "#305070";
  for (const auto& [width, height] : {std::pair{96, 64}, {131, 67}, {1, 1}, {3, 70}}) {
    for (const auto method : {protocol::MethodName::slab, protocol::MethodName::reference}) {
      if (method == protocol::MethodName::reference && width * height > 300) continue;
      view.method.name = method;
      view.image.width = width;
      view.image.height = height;
      const Encoding exact{Format::png, 0, image::Subsampling::s444, true};
      const Encoding near{Format::jpeg, 100, image::Subsampling::s444, true};
      const auto png = produce(view, *dataset, exact, pool, cancel);
      const auto jpeg = produce(view, *dataset, near, pool, cancel);
      ASSERT_TRUE(png && jpeg);
      const std::size_t size = std::size_t{3} * width * height;
      const std::vector<std::uint8_t> truth = test::decoded_png(png->bytes).rgb;
      ASSERT_EQ(truth.size(), size);
      const auto found = image::decode_jpeg(jpeg->bytes, width, height);
      ASSERT_TRUE(found) << found.error().message;
      for (std::size_t i = 0; i < size; ++i) ASSERT_NEAR((*found)[i], truth[i], 5) << i;
    }
  }
}

// A workspace that was used for other frames gives the same result as a new one, as does a frame
// rendered in steps.
TEST_F(Produce, WorkspaceKeepsNoStateBetweenPictures) {
  Workspace used;
  ThreadPool one(1);
  const Encoding moving{Format::jpeg, 80, image::Subsampling::s420};
  const Encoding settled{Format::jpeg, 90, image::Subsampling::s444};
  for (const auto& [width, height] : {std::pair{200, 150}, {96, 64}, {161, 99}}) {
    view.image.width = width;
    view.image.height = height;
    for (const Encoding& encoding : {moving, settled, Encoding{Format::png}}) {
      const auto fresh = produce(view, *dataset, encoding, pool, cancel);
      const auto again = produce(view, *dataset, encoding, one, cancel, used);
      ASSERT_TRUE(fresh && again);
      EXPECT_EQ(fresh->bytes, again->bytes) << width;
      EXPECT_EQ(again->width, width);
      EXPECT_EQ(fresh->work.fields, again->work.fields);
    }
  }
  CancelToken raised;
  raised.cancel();
  ASSERT_FALSE(produce(view, *dataset, moving, pool, raised, used));
  EXPECT_EQ(produce(view, *dataset, moving, pool, cancel, used)->bytes,
            produce(view, *dataset, moving, pool, cancel)->bytes);
}

TEST_F(Produce, InvalidViewsAndCancelledFramesAreErrors) {
  view.step = 2;
  const auto late = produce_as(Format::jpeg);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().kind, ErrorKind::invalid);
  ASSERT_EQ(late.error().at.size(), 1U);
  EXPECT_EQ(late.error().at[0].pointer, "/step");

  view.step = 0;
  cancel.cancel();
  const auto cancelled = produce_as(Format::jpeg);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().kind, ErrorKind::cancelled);
}

// A request that shares the renderer is refused if it takes minutes.
TEST_F(Produce, ReferenceIsRenderedOnlyWhereAllowed) {
  view.method.name = protocol::MethodName::reference;
  const auto refused = produce_as(Format::png);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  ASSERT_EQ(refused.error().at.size(), 1U);
  EXPECT_EQ(refused.error().at[0].pointer, "/method/name");
  EXPECT_EQ(dataset->loads(), 0U);
}

// The fields of colour and of heights are listed, without duplicates.
TEST(ProduceFields, OfColorAndHeightAreListedOnce) {
  auto source = std::make_unique<scene::FakeSource>(
      scene::atmosphere_grid(),
      std::vector<data::FieldInfo>{scene::wind_info(), scene::scalar_info("z", "m"),
                                   scene::scalar_info("q", "1")},
      1);
  auto dataset = scene::dataset_of(std::move(source));
  protocol::View view;
  view.image.width = 32;
  view.image.height = 32;
  view.scalars.emplace();
  ThreadPool pool(1);
  const auto fields = [&] {
    const auto frame = produce(view, *dataset, Encoding{}, pool, CancelToken());
    EXPECT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->work.bytes, 36 * 4 * static_cast<std::int64_t>(frame->work.fields.size() + 2));
    return frame->work.fields;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(fields(), Names{"wind"});
  view.vector.color.by = protocol::ColorBy::scalar;
  view.vector.color.field = "q";
  EXPECT_EQ(fields(), (Names{"wind", "q"}));
  view.geometry.height_field = "z";
  EXPECT_EQ(fields(), (Names{"wind", "q", "z"}));
  view.vector.color.field = "z";
  EXPECT_EQ(fields(), (Names{"wind", "z"}));
}

// Only the shown fields are requested from the source, for every method.
TEST(ProduceFields, UnusedFieldsAreNeverRead) {
  using Reads = scene::FakeSource::Reads;
  for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
    const auto reads_of = [&](const auto& change) {
      const auto reads = std::make_shared<Reads>();
      auto source = std::make_unique<scene::FakeSource>(
          scene::atmosphere_grid(),
          std::vector<data::FieldInfo>{scene::wind_info(), scene::scalar_info("q", "1"),
                                       scene::scalar_info("t", "K")},
          2, reads);
      auto dataset = scene::dataset_of(std::move(source));
      protocol::View view;
      view.image.width = 32;
      view.image.height = 32;
      view.method.name = method;
      change(view);
      ThreadPool pool(1);
      const auto frame = produce(view, *dataset, Encoding{}, pool, CancelToken());
      EXPECT_TRUE(frame) << frame.error().message;
      EXPECT_EQ(frame->work.fields.size(), reads->size());
      return *reads;
    };
    const auto fog = [](const std::string& field) {
      protocol::ScalarView medium;
      medium.field = field;
      medium.extinction = {{0.0, 1.0}, {1e3, 1.0}};
      return medium;
    };
    const auto no_lines = [](protocol::View& view) {
      view.vector.field.kind = protocol::FieldChoice::Kind::none;
    };
    EXPECT_EQ(reads_of([&](protocol::View& view) { view.scalars.emplace(); }),
              (Reads{{"wind@0", 1}}));
    EXPECT_EQ(reads_of([&](protocol::View& view) {
                no_lines(view);
                view.scalars = {fog("q")};
              }),
              (Reads{{"q@0", 1}}));
    EXPECT_EQ(reads_of([&](protocol::View& view) {
                view.scalars = {fog("t"), fog("t")};
              }),
              (Reads{{"t@0", 1}, {"wind@0", 1}}));
    EXPECT_EQ(reads_of([&](protocol::View& view) {
                view.scalars.emplace();
                view.vector.color.by = protocol::ColorBy::scalar;
                view.vector.color.field = "q";
              }),
              (Reads{{"q@0", 1}, {"wind@0", 1}}));
    EXPECT_EQ(reads_of([&](protocol::View& view) {
                no_lines(view);
                view.scalars.emplace();
                view.vector.color.by = protocol::ColorBy::scalar;
                view.vector.color.field = "q";
              }),
              Reads{})
        << "the colour field of hidden lines";
  }
}

TEST_F(Produce, FrameInfoNamesMethodsAndSlabs) {
  const auto frame = produce_as(Format::jpeg);
  ASSERT_TRUE(frame);
  view.method.compositing = protocol::Compositing::cd_naive;
  view.method.slab_thickness = 0.5;
  view.method.name = protocol::MethodName::kernel;
  EXPECT_FALSE(frame_info(*frame, view).slab_thickness);
  view.method.name = protocol::MethodName::slab;
  const protocol::FrameInfo info = frame_info(*frame, view);
  EXPECT_EQ(info.method, "slab");
  EXPECT_EQ(info.compositing, "cd-naive");
  EXPECT_EQ(info.slab_thickness, 0.5);
}

TEST_F(Produce, ReportContainsTheLevelAndActualSettings) {
  view.image.width = 10;
  view.image.height = 8;
  view.vector.stride = 1;  // kernels of another stride are counted beside those of the medium
  const auto coarse = produce_as(Format::png);
  view.method.detail = protocol::Detail::full;
  const auto full = produce_as(Format::png);
  ASSERT_TRUE(coarse && full);
  const std::string all = engine::text_of(full->work.variant);
  EXPECT_EQ(all.find("level"), std::string::npos) << all;
  EXPECT_EQ(full->work.samples, 16 * 16 * 16);
  const std::string some = engine::text_of(coarse->work.variant);
  const std::size_t at = some.find(" level=");
  ASSERT_NE(at, std::string::npos) << some;
  const int level = std::stoi(some.substr(at + 7));
  ASSERT_GE(level, 1);
  const std::string each = std::to_string(level);
  EXPECT_EQ(some.substr(at), " level=" + each + "," + each + "," + each);
  EXPECT_EQ(coarse->work.samples, full->work.samples >> (3 * level));
  EXPECT_GT(coarse->work.bytes, full->work.bytes >> (3 * level)) << "media have two values";
  EXPECT_LT(coarse->work.bytes, full->work.bytes / 2);
  EXPECT_EQ(coarse->work.fields, full->work.fields);
}

TEST_F(Produce, FrameInfoContainsTheReport) {
  const auto frame = produce_as(Format::jpeg, 1);
  ASSERT_TRUE(frame) << frame.error().message;
  view.vector.stride = 3;
  const protocol::FrameInfo info = frame_info(*frame, view);
  EXPECT_EQ(info.method, "slab");
  EXPECT_EQ(info.compositing, "analytic");
  EXPECT_EQ(info.slab_thickness, 1);
  EXPECT_EQ(info.stride, 3);
  EXPECT_EQ(info.width, 48);
  EXPECT_EQ(info.height, 32);
  EXPECT_EQ(info.error_kind, "none");
  EXPECT_FALSE(info.error_value || info.jpeg_error);
  EXPECT_EQ(info.samples, frame->work.samples);
  EXPECT_GT(info.samples, 0);
  EXPECT_EQ(info.fields, frame->work.fields);
  EXPECT_EQ(info.bytes, frame->work.bytes);
  EXPECT_EQ(info.variant, engine::text_of(frame->work.variant));
}

}  // namespace
}  // namespace windsplat::frame
