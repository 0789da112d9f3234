// frame::calibrate and frame::measured_error on a small sample, compared with the integral.
#include "server/frame/measure.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/content.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::frame {
namespace {

class Measure : public testing::Test {
 protected:
  void SetUp() override {
    auto source = data::open_sample("tornado", {16, 16, 16}, 1);
    ASSERT_TRUE(source) << source.error().message;
    dataset = std::make_unique<data::Dataset>(std::move(*source), "tornado", 1ULL << 30);
    protocol::View wanted;
    wanted.dataset = "tornado";
    wanted.image.width = 128;
    wanted.image.height = 96;
    auto completed = scene::complete(wanted, *dataset);
    ASSERT_TRUE(completed) << completed.error().message;
    view = completed->view();
  }

  scene::CompletedView completed() { return scene::complete(view, *dataset).value(); }

  std::map<std::size_t, quality::Measured> calibrated() { return calibrated(pool); }
  std::map<std::size_t, quality::Measured> calibrated(ThreadPool& threads) {
    std::map<std::size_t, quality::Measured> found;
    const auto done = calibrate(
        completed(), *dataset, threads, cancel, workspace, [&](const CalibrationSample& one) {
          EXPECT_TRUE(found.emplace(one.setting, one.measured).second) << one.setting;
          EXPECT_EQ(one.viewpoint.pixels_high, 96);
        });
    EXPECT_TRUE(done) << done.error().message;
    return found;
  }

  Frame drawn(protocol::MethodName method, Format format) {
    protocol::View own = view;
    own.method.name = method;
    Encoding encoding;
    encoding.format = format;
    encoding.measure = true;
    encoding.measure_change = true;
    auto frame = produce(own, *dataset, encoding, pool, cancel, workspace);
    EXPECT_TRUE(frame) << frame.error().message;
    return frame ? std::move(*frame) : Frame();
  }

  // Error of the decoded pixels of a frame relative to the integral.
  double true_error(const Frame& npy) {
    if (integral.empty()) {
      const auto scene = scene::build_scene(view, *dataset);
      auto picture = engine::reference::render(scene.value(), pool, cancel, {1e-7});
      integral = std::move(picture.value().rgba);
    }
    std::vector<float> rgba(integral.size());
    const std::size_t bytes = rgba.size() * sizeof(float);
    std::memcpy(rgba.data(), npy.bytes.data() + npy.bytes.size() - bytes, bytes);
    double squares = 0;
    for (std::size_t i = 0; i < rgba.size(); ++i) {
      squares += (rgba[i] - integral[i]) * (rgba[i] - integral[i]);
    }
    return std::sqrt(squares / static_cast<double>(rgba.size()));
  }

  std::unique_ptr<data::Dataset> dataset;
  protocol::View view;
  std::vector<double> integral;
  Workspace workspace;
  ThreadPool pool{2};
  CancelToken cancel;
};

TEST_F(Measure, MeasuredFrameErrorIsItsErrorAgainstTheIntegral) {
  for (const auto method : {protocol::MethodName::slab, protocol::MethodName::kernel}) {
    const Frame frame = drawn(method, Format::npy);
    ASSERT_TRUE(frame.error);
    const double ratio = *frame.error / true_error(frame);
    EXPECT_GT(ratio, 0.7);
    EXPECT_LT(ratio, 1.4);
  }
}

// The whole volume lies within few slabs, as it does in slabs of half the thickness.
TEST_F(Measure, ErrorOfSlabsThickerThanTheVolumeIsItsErrorAgainstTheIntegral) {
  for (const double thickness : {16.0, 32.0, 64.0}) {
    view.method.slab_thickness = thickness;
    const Frame frame = drawn(protocol::MethodName::slab, Format::npy);
    ASSERT_TRUE(frame.error);
    const double truth = true_error(frame);
    EXPECT_NEAR(*frame.error / truth, 1, 0.3) << thickness << ' ' << truth;
    const auto found = calibrated();
    EXPECT_NEAR(found.at(quality::own_setting(frame.view)).error.value() / truth, 1, 0.3)
        << thickness;
  }
}

// The cells are so flat that the number of slabs is limited, whatever their thickness.
TEST_F(Measure, NoErrorIsMeasuredWhereSlabsCannotBeThinner) {
  view.geometry.scale = {1e3, 1e3, 1e-3};
  view.camera.eye.reset();
  view = completed().view();
  for (const auto method : {protocol::MethodName::slab, protocol::MethodName::kernel}) {
    EXPECT_FALSE(drawn(method, Format::npy).error);
  }
  view.method.name = protocol::MethodName::slab;
  const auto found = calibrated();
  EXPECT_GT(found.size(), 1U);
  for (const auto& [setting, measured] : found) {
    EXPECT_FALSE(measured.error) << setting;
    EXPECT_GT(measured.ms.value(), 0) << setting;
  }
}

// Between cells whose slabs can all be thinner and cells whose slabs cannot lie those of which
// slabs of half a cell are possible and slabs of a quarter are not (a range of a factor of 2).
TEST_F(Measure, CalibrationReportsEverySettingHoweverFlatTheCells) {
  view.method.name = protocol::MethodName::slab;
  view.method.compositing = protocol::Compositing::analytic;
  view.method.stop_transmittance = 0;
  view.method.slab_thickness = 1;
  view.method.detail = protocol::Detail::full;
  std::size_t without_error = 0;
  std::size_t with_error = 0;
  for (const double scale : {2.0, 3.0, 4.5, 6.75, 10.0}) {
    view.geometry.scale = {1e3, 1e3, scale};
    view.camera.eye.reset();
    view = completed().view();
    const auto found = calibrated();
    for (std::size_t i = 0; i < quality::settings_count; ++i) {
      if (!quality::is_allowed(quality::settings[i], view)) continue;
      ASSERT_TRUE(found.contains(i)) << scale << ' ' << i;
      ++(found.at(i).error ? with_error : without_error);
    }
  }
  EXPECT_GT(with_error, 0U);
  EXPECT_GT(without_error, 0U);
}

// Errors that thinner slabs reduce less or not at all: compositing rule and early termination.
TEST_F(Measure, OtherRulesAndEarlyTerminationAreMeasuredAgainstTheIntegral) {
  const protocol::MethodView usual = view.method;
  true_error(drawn(protocol::MethodName::slab, Format::npy));  // preserves the integral
  for (const auto& [compositing, stop] : {std::pair{protocol::Compositing::simple, 1.5e-4},
                                          std::pair{protocol::Compositing::cd_euler, 1.5e-4},
                                          std::pair{protocol::Compositing::analytic, 0.3}}) {
    view.method = usual;
    view.method.compositing = compositing;
    view.method.stop_transmittance = stop;
    const Frame frame = drawn(protocol::MethodName::slab, Format::npy);
    ASSERT_TRUE(frame.error);
    const double truth = true_error(frame);
    EXPECT_NEAR(*frame.error / truth, 1, 0.4) << truth;
    const auto found = calibrated();
    const auto error_of = [&](int thinner) {
      const quality::Setting setting{protocol::MethodName::slab, 0, 0, thinner};
      return found.at(quality::index_of(setting).value()).error.value();
    };
    EXPECT_NEAR(error_of(1) / truth, 1, 0.4) << truth;
    const double promised =
        quality::prior(quality::signature_of(view).kind,
                       quality::settings[quality::own_setting(view)], quality::viewpoint_of(view))
            .error;
    EXPECT_GT(promised, 0.2 * truth) << "before any measurement";
    view.method.slab_thickness /= 4;
    EXPECT_NEAR(error_of(4) / drawn(protocol::MethodName::slab, Format::npy).error.value(), 1, 0.3);
  }
}

// Mean over pixels of the channel that changes most.
double mean_change(const Frame& picture, const Frame& whole) {
  EXPECT_EQ(picture.bytes.size(), whole.bytes.size());
  const std::size_t pixels = static_cast<std::size_t>(picture.width) * picture.height;
  const auto values = [&](const Frame& of) {
    std::vector<float> out(4 * pixels);
    std::memcpy(out.data(), of.bytes.data() + of.bytes.size() - 4 * sizeof(float) * pixels,
                4 * sizeof(float) * pixels);
    return out;
  };
  const std::vector<float> a = values(picture);
  const std::vector<float> b = values(whole);
  double sum = 0;
  for (std::size_t p = 0; p < 4 * pixels; p += 4) {
    double most = 0;
    for (std::size_t c = p; c < p + 4; ++c) {
      most = std::max(most, std::abs(static_cast<double>(a[c]) - b[c]));
    }
    sum += most;
  }
  return sum / static_cast<double>(pixels);
}

TEST_F(Measure, ChangeBySkippedLinesAndSplatsIsThatOfThePictureWithAllOfThem) {
  view.scalars.value()[0].min_optical_depth = 0.2;
  view.vector.min_magnitude = 0.3 * view.vector.magnitude_range.value()[1];
  view.vector.stride = 1;
  const protocol::View skipping = view;
  for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
    view = skipping;
    const Frame picture = drawn(method, Format::npy);
    const double png = drawn(method, Format::png).skipped_change.value();
    const double jpeg = drawn(method, Format::jpeg).skipped_change.value();
    view.vector.min_magnitude = 0;
    const Frame lines = drawn(method, Format::npy);
    view.scalars.value()[0].min_optical_depth = 0;
    const Frame whole = drawn(method, Format::npy);
    const double truth = mean_change(picture, whole);
    EXPECT_GT(truth, 0.02);
    EXPECT_NEAR(picture.skipped_change.value(), truth, 1e-6 * truth);
    EXPECT_LE(picture.skipped_change.value(), picture.work.skipped_bound);
    EXPECT_EQ(png, picture.skipped_change.value());
    EXPECT_EQ(jpeg, picture.skipped_change.value());
    EXPECT_GT(lines.skipped_change.value(), 1e-4) << "of splats alone";
    EXPECT_LT(lines.skipped_change.value(), truth);
    EXPECT_EQ(whole.skipped_change, 0.0) << "nothing is skipped";
  }
}

// Pixels are composited from the kernels that their rays meet, by other code.
TEST_F(Measure, ChangeBySkippedLinesAndSplatsIsEstimatedFromSomePixels) {
  view.image.width = 320;
  view.image.height = 240;
  const auto estimated = [&] {
    const auto scene = scene::build_scene(completed(), *dataset);
    return content_of(scene.value()).value().skipped_change.value();
  };
  view.scalars.value()[0].min_optical_depth = 0;
  view.vector.min_magnitude = 0;
  EXPECT_EQ(estimated(), 0);
  for (const auto& [lines, splats] : {std::pair{0.3, 0.0}, std::pair{0.0, 0.2}}) {
    view.vector.min_magnitude = lines * view.vector.magnitude_range.value()[1];
    view.scalars.value()[0].min_optical_depth = splats;
    for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
      const double truth = drawn(method, Format::png).skipped_change.value();
      EXPECT_GT(truth, 1e-4);
      EXPECT_LT(std::abs(std::log(estimated() / truth)), std::log(1.5))
          << lines << ' ' << splats << ' ' << estimated() << ' ' << truth;
    }
  }
}

TEST_F(Measure, ChangeBySkippedLinesHasTheSameBitsForAnyNumberOfThreads) {
  view.image.width = 640;
  view.image.height = 480;
  view.vector.min_magnitude = 0.3 * view.vector.magnitude_range.value()[1];
  const double change = drawn(protocol::MethodName::slab, Format::jpeg).skipped_change.value();
  EXPECT_GT(change, 0);
  Encoding encoding;
  encoding.measure = true;
  encoding.measure_change = true;
  for (const unsigned threads : {1U, 3U, 7U}) {
    ThreadPool other(threads);
    const auto frame = produce(view, *dataset, encoding, other, cancel);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->skipped_change, change) << threads;
  }
}

// Which lines and splats are left out is known before: nothing needs to be measured for it.
TEST_F(Measure, ChangeOfAnyPictureIsKnownToBeZeroIfNothingIsSkipped) {
  view.scalars.value()[0].min_optical_depth = 0;
  view.vector.min_magnitude = 0;
  const auto plain = produce(view, *dataset, {}, pool, cancel);
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->work.skipped_bound, 0);
  EXPECT_EQ(plain->skipped_change, 0.0);
}

// A picture beyond the error that was asked for is drawn again.
TEST_F(Measure, ChangeIsMeasuredOnlyOfPicturesThatKeepTheirError) {
  view.vector.min_magnitude = 0.3 * view.vector.magnitude_range.value()[1];
  for (const Format format : {Format::jpeg, Format::npy}) {
    view.quality.max_error.reset();
    const Frame free = drawn(protocol::MethodName::kernel, format);
    view.quality.max_error = 0.5 * free.error.value();
    const Frame beyond = drawn(protocol::MethodName::kernel, format);
    EXPECT_FALSE(beyond.skipped_change);
    ASSERT_TRUE(beyond.content);
    EXPECT_TRUE(beyond.content->skipped_change);
    view.quality.max_error = 2 * free.error.value();
    const Frame kept = drawn(protocol::MethodName::kernel, format);
    EXPECT_EQ(kept.skipped_change, free.skipped_change.value());
    EXPECT_EQ(kept.error, free.error);
    EXPECT_EQ(kept.bytes, free.bytes);
  }
}

// Counts of kernel positions decide, so that it does not depend on the load.
TEST_F(Measure, ChangeIsNotMeasuredWhereDrawingEverythingWouldTakeMuchLongerThanThePicture) {
  const auto scene = scene::build_scene(completed(), *dataset);
  ASSERT_TRUE(scene);
  scene::Scene some = scene.value();
  for (const auto method : {scene::Method::kernel, scene::Method::slab}) {
    some.method = method;
    const auto is_measured_with = [&](double samples, double share_left_out) {
      engine::WorkReport work;
      work.samples = static_cast<std::int64_t>(samples);
      work.skipped_both = static_cast<std::int64_t>(samples * share_left_out);
      return is_change_measured(some, work);
    };
    EXPECT_TRUE(is_measured_with(1e8, 0.5));
    EXPECT_TRUE(is_measured_with(2e5, 0.999)) << "takes no longer than describing the view";
    EXPECT_FALSE(is_measured_with(1e8, 0.98));
    EXPECT_FALSE(is_measured_with(1e8, 1));
  }
}

TEST_F(Measure, MeasuredPictureIsTheSentOne) {
  Encoding encoding;
  for (const Format format : {Format::png, Format::npy, Format::jpeg}) {
    const Frame measured = drawn(protocol::MethodName::slab, format);
    encoding.format = format;
    view.method.name = protocol::MethodName::slab;
    const auto plain = produce(view, *dataset, encoding, pool, cancel);
    ASSERT_TRUE(plain);
    EXPECT_FALSE(plain->error);
    EXPECT_EQ(measured.bytes, plain->bytes) << static_cast<int>(format);
  }
}

TEST_F(Measure, EveryFormatOfAPictureReportsTheSameError) {
  const double png = drawn(protocol::MethodName::slab, Format::png).error.value();
  const Frame jpeg = drawn(protocol::MethodName::slab, Format::jpeg);
  EXPECT_NEAR(jpeg.error.value() / png, 1, 1e-4);
  EXPECT_GT(jpeg.jpeg_error.value(), 0);
}

// A description would delay the picture, and its error is known without.
TEST_F(Measure, OnlyPicturesWithoutAMeasuredErrorAreDescribed) {
  const Frame measured = drawn(protocol::MethodName::slab, Format::jpeg);
  EXPECT_TRUE(measured.error);
  EXPECT_FALSE(measured.content);
  view.geometry.scale = {1e3, 1e3, 1e-3};
  view.camera.eye.reset();
  view = completed().view();
  const Frame too_flat = drawn(protocol::MethodName::slab, Format::jpeg);
  EXPECT_FALSE(too_flat.error);
  EXPECT_TRUE(too_flat.content);
}

TEST_F(Measure, OnlyFullSizePicturesAreMeasured) {
  Encoding encoding;
  encoding.measure = true;
  const auto prepared = prepare(completed(), {view.method.name, 1}, *dataset, encoding);
  ASSERT_TRUE(prepared);
  const auto small = produce(*prepared, *dataset, pool, cancel, workspace);
  ASSERT_TRUE(small);
  EXPECT_FALSE(small->error);
}

TEST_F(Measure, CalibrationRunReportsEveryAllowedSettingOnce) {
  const auto found = calibrated();
  for (std::size_t i = 0; i < quality::settings_count; ++i) {
    EXPECT_EQ(found.count(i), quality::is_allowed(quality::settings[i], view) ? 1U : 0U) << i;
  }
  for (const auto& [setting, measured] : found) {
    EXPECT_GT(measured.error.value(), 0) << setting;
    EXPECT_GT(measured.ms.value(), 0) << setting;
  }
}

// Smaller pictures show coarser levels of detail of these data than the view.
TEST(MeasureMerged, EverySettingIsCalibratedFromWhatWasLoadedForIt) {
  auto source = data::open_sample("climate", {160, 80, 10}, 1);
  ASSERT_TRUE(source) << source.error().message;
  data::Dataset dataset(std::move(*source), "climate", 1ULL << 30);
  protocol::View view;
  view.dataset = "climate";
  view.image.width = 640;
  view.image.height = 480;
  const auto completed = scene::complete(view, dataset).value();
  std::set<std::array<int, 3>> levels;
  for (const quality::Setting& setting : quality::settings) {
    auto other = data::Dataset(data::open_sample("climate", {160, 80, 10}, 1).value(), "climate",
                               1ULL << 30);
    levels.insert(prepare(completed, setting, other, {}).value().scene.level);
  }
  EXPECT_GT(levels.size(), 3U);  // more than the three of the coarser settings
  CancelToken cancel;
  ASSERT_TRUE(load_for_calibration(completed, dataset, cancel));
  data::Dataset resident = dataset.resident_only();
  Workspace workspace;
  ThreadPool pool{2};
  std::size_t reported = 0;
  const auto done = calibrate(completed, resident, pool, cancel, workspace,
                              [&](const CalibrationSample&) { ++reported; });
  ASSERT_TRUE(done) << done.error().message;
  std::size_t allowed = 0;
  for (const quality::Setting& setting : quality::settings) {
    allowed += quality::is_allowed(setting, completed.view()) ? 1 : 0;
  }
  EXPECT_EQ(reported, allowed);
}

// Two estimates of the same error: a calibration run and a frame use different references.
TEST_F(Measure, CalibrationRunAgreesWithMeasuredFrames) {
  auto found = calibrated();
  const auto error_of = [&](const quality::Setting& setting) {
    return found.at(quality::index_of(setting).value()).error.value();
  };
  for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
    const double frames = drawn(method, Format::npy).error.value();
    EXPECT_NEAR(error_of({method, 0, 0}) / frames, 1, 0.2);
  }
  EXPECT_NEAR(error_of({protocol::MethodName::slab, 0, 0, 2}) /
                  error_of({protocol::MethodName::slab, 0, 0, 4}),
              4, 1e-3);
}

TEST_F(Measure, CalibrationErrorsHaveTheSameBitsForAnyNumberOfThreads) {
  ThreadPool one(1);
  ThreadPool three(3);
  const auto first = calibrated(one);
  for (int run = 0; run < 2; ++run) {
    for (const auto& [setting, measured] : calibrated(three)) {
      EXPECT_EQ(measured.error.value(), first.at(setting).error.value()) << setting;
    }
  }
}

// From far away the view merges its data: slabs of any thickness then have equal errors.
TEST_F(Measure, CalibrationRunRendersAveragesAsFramesDo) {
  scene::orbit(view, completed().lattice(), 20, 30, 0.05);
  EXPECT_LT(viewpoint_of(completed(), *dataset).detail, 1);
  auto found = calibrated();
  const auto error_of = [&](int thinner) {
    return found.at(quality::index_of({protocol::MethodName::slab, 0, 0, thinner}).value())
        .error.value();
  };
  EXPECT_NEAR(error_of(4) / error_of(1), 1, 0.1);
}

// Scenes are built with the reported detail.
TEST_F(Measure, ViewUsesAveragesWhereItsDetailIsBelowOne) {
  const scene::CompletedView first = completed();
  int averaged = 0;
  for (const bool lines : {true, false}) {
    if (!lines) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
    for (double zoom = 0.02; zoom < 4; zoom *= 1.3) {
      scene::orbit(view, first.lattice(), 20, 30, zoom);
      const auto seen = completed();
      const auto built = scene::build_scene(seen, *dataset).value();
      const bool is_averaged = built.level != std::array{0, 0, 0};
      EXPECT_EQ(scene::detail_shown(seen) < 1, is_averaged) << zoom;
      averaged += is_averaged ? 1 : 0;
    }
  }
  EXPECT_GT(averaged, 4);
  EXPECT_LT(averaged, 36);
  view.method.detail = protocol::Detail::full;
  EXPECT_EQ(scene::detail_shown(completed()), 0);
}

TEST_F(Measure, CalibrationRunWithKnownContentReportsIt) {
  quality::Content known;
  known.lines = 0.123;
  const auto done = calibrate(
      completed(), *dataset, pool, cancel, workspace,
      [&](const CalibrationSample& one) { EXPECT_EQ(one.viewpoint.content->lines, 0.123); }, known);
  EXPECT_TRUE(done);
}

TEST_F(Measure, CancelledCalibrationRunStops) {
  int told = 0;
  const CancelToken stop;
  const auto done =
      calibrate(completed(), *dataset, pool, stop, workspace, [&](const CalibrationSample&) {
        if (++told == 2) stop.cancel();
      });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::cancelled);
  EXPECT_LE(told, 4);
}

}  // namespace
}  // namespace windsplat::frame
