// The settings of the sweep, the error of a point relative to a reference, and the error floor of
// splats.
#include "server/study/sweep.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/frame/difference.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/place.hpp"
#include "server/study/metrics.hpp"
#include "tests/unit/frame/part_store.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::study {
namespace {

using scene::Compositing;
using scene::Method;

bool has(const Sweep& sweep, Method method, Compositing compositing) {
  return std::any_of(sweep.settings.begin(), sweep.settings.end(), [&](const Setting& s) {
    return s.method == method && s.compositing == compositing;
  });
}

TEST(Sweep, MeasuresEveryCompositingAndNoSettingTwice) {
  const Subject subject = standard_subject("soft", false).value();
  const Sweep sweep = plan_sweep(subject, false);
  for (const Compositing compositing : compositings) {
    EXPECT_TRUE(has(sweep, Method::kernel, compositing)) << name_of(compositing);
    EXPECT_TRUE(has(sweep, Method::slab, compositing)) << name_of(compositing);
  }
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(sweep.settings[i] == sweep.settings[j]);
  }
}

TEST(Sweep, CurveVariesOneParameterOnly) {
  const Subject subject = standard_subject("dense", false).value();
  const Sweep sweep = plan_sweep(subject, false);
  for (const Curve& curve : sweep.curves) {
    for (const std::size_t i : curve.points) {
      const Setting& setting = sweep.settings[i];
      EXPECT_EQ(setting.method, curve.method);
      EXPECT_EQ(setting.compositing, curve.compositing);
      int others = 0;
      const Knobs own = own_knobs(subject);
      for (const Knob knob : {Knob::stride, Knob::span, Knob::slab_thickness,
                              Knob::stop_transmittance, Knob::width}) {
        if (knob != curve.knob && value_of(setting.knobs, knob) != value_of(own, knob)) ++others;
      }
      EXPECT_EQ(others, 0) << name_of(curve.knob);
    }
  }
}

TEST(Sweep, OmitsContentTheSceneLacks) {
  const Sweep vectors = plan_sweep(standard_subject("vectors", false).value(), false);
  EXPECT_FALSE(has(vectors, Method::kernel, Compositing::cd));
  const Sweep scalar = plan_sweep(standard_subject("scalar", false).value(), false);
  for (const Curve& curve : scalar.curves) EXPECT_NE(curve.knob, Knob::span);
}

TEST(Scene, AppliesItsParametersAndScalesLinesWithThePicture) {
  const Subject subject = standard_subject("soft", false).value();
  Setting setting{Method::slab, Compositing::cd, own_knobs(subject)};
  setting.knobs.stride *= 2;
  setting.knobs.span = 3;
  setting.knobs.slab_thickness = 0.5;
  setting.knobs.stop_transmittance = 0.25;
  setting.knobs.width = subject.view.image.width / 2;
  const scene::Scene scene = scene_at(subject, setting).value();
  EXPECT_EQ(scene.method, Method::slab);
  EXPECT_EQ(scene.compositing, Compositing::cd);
  EXPECT_EQ(scene.vector->stride, 2 * *subject.view.vector.stride);
  EXPECT_EQ(scene.scalars.at(0).stride, 2);
  EXPECT_EQ(scene.vector->span, 3);
  EXPECT_EQ(scene.slab_thickness, 0.5);
  EXPECT_EQ(scene.stop_transmittance, 0.25);
  EXPECT_EQ(scene.camera.width, subject.view.image.width / 2);
  EXPECT_EQ(scene.camera.height, subject.view.image.height / 2);
  const scene::Scene whole =
      scene_at(subject, {Method::kernel, Compositing::cd, own_knobs(subject)}).value();
  EXPECT_EQ(scene.camera.half_height, whole.camera.half_height);
  EXPECT_EQ(scene.camera.eye, whole.camera.eye);
}

// Of a store with levels lines may have the vectors of one stride alone.
TEST(Scene, OfAStoreHasTheVectorsOfEachStride) {
  namespace of_store = frame::of_store;
  auto dataset = std::make_shared<data::Dataset>(of_store::store(100 * of_store::samples_bytes));
  protocol::View view = of_store::of_one_voxel();
  view.camera.height = 0.6;
  view.scalars->front().stride = 2;
  view.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
  view.vector.stride = 4;
  view.vector.length = 0.05;
  const Subject subject = make_subject("store", dataset, view, {40, 30}).value();
  ThreadPool pool(1);
  for (const auto& [stride, apart] : {std::pair{4, 4}, std::pair{8, 8}, std::pair{12, 1}}) {
    Setting setting{Method::kernel, Compositing::analytic, own_knobs(subject)};
    setting.knobs.stride = stride;
    scene::Scene scene = scene_at(subject, setting).value();
    EXPECT_EQ(scene.vector->stride, stride);
    EXPECT_EQ(scene.scalars.at(0).stride, stride / 2);
    EXPECT_EQ(scene.vector->field_stride, apart);
    const auto drawn = engine::render(scene, pool, CancelToken()).value();
    EXPECT_GT(drawn.work.pixel_updates, 0);
    scene.vector->field = dataset->volume("wind", 0).value();
    scene.vector->field_stride = 1;
    EXPECT_EQ(drawn.image.rgba, engine::render(scene, pool, CancelToken()).value().image.rgba);
  }
}

// soft and dense are named after the optical depth of their deepest row of samples.
TEST(Scene, HasTheNamedOpticalDepth) {
  for (const auto& [name, depth] : {std::pair{"soft", 1.0}, std::pair{"dense", 10.0}}) {
    const Subject subject = standard_subject(name, true).value();
    const scene::Scene scene =
        scene_at(subject, {Method::kernel, Compositing::analytic, own_knobs(subject)}).value();
    const data::Volume& volume = *scene.scalars.at(0).field;
    const double per_value = scene.scalars[0].extinction.back()[1];
    double deepest = 0;
    const int n = volume.dims[0];
    for (int z = 0; z < n; ++z) {
      for (int x = 0; x < n; ++x) {
        double sum = 0;
        for (int y = 0; y < n; ++y) sum += volume.values[(z * n + y) * n + x] * per_value;
        deepest = std::max(deepest, sum * scene.lattice.spacing[1][0]);
      }
    }
    EXPECT_NEAR(deepest, depth, 1e-6 * depth) << name;
  }
}

// The reference is the picture of the setting itself, then with a known offset in one channel.
TEST(Measure, IsTheDistanceFromTheGivenReference) {
  const Subject subject = standard_subject("soft", true).value();
  const Setting setting{Method::kernel, Compositing::analytic, own_knobs(subject)};
  ThreadPool pool(1);
  const engine::Image own = draw(subject, setting, pool, CancelToken()).value();
  Picture truth{own.width, own.height, {own.rgba.begin(), own.rgba.end()}};
  const Measurement same = measure(subject, setting, truth, pool, CancelToken()).value();
  EXPECT_EQ(same.rmse, 0);
  EXPECT_EQ(same.flip, 0);
  EXPECT_TRUE(same.stable);
  EXPECT_GT(same.ms_min, 0);
  EXPECT_LE(same.ms_min, same.ms);
  EXPECT_LE(same.ms, same.ms_max);
  for (std::size_t i = 1; i < truth.rgba.size(); i += 4) truth.rgba[i] += 0.1;
  const Measurement off = measure(subject, setting, truth, pool, CancelToken()).value();
  EXPECT_NEAR(off.rmse, 0.05, 1e-9);
  EXPECT_NEAR(off.max, 0.1, 1e-9);
  EXPECT_GT(off.flip, 0);
}

TEST(Measure, SmallerPictureIsComparedAtTheReferenceSize) {
  const Subject subject = standard_subject("soft", true).value();
  Setting setting{Method::kernel, Compositing::analytic, own_knobs(subject)};
  ThreadPool pool(1);
  const engine::Image own = draw(subject, setting, pool, CancelToken()).value();
  const Picture truth{own.width, own.height, {own.rgba.begin(), own.rgba.end()}};
  setting.knobs.width /= 2;
  const engine::Image half = draw(subject, setting, pool, CancelToken()).value();
  ASSERT_EQ(half.width * 2, own.width);
  const auto larger = resample(half.rgba, half.width, half.height, own.width, own.height);
  EXPECT_NEAR(measure(subject, setting, truth, pool, CancelToken()).value().rmse,
              frame::difference_of(larger, truth.rgba).rmse, 1e-12);
}

// The ripple of overlapping footprints is 1 % peak to peak on axis to 4 % at 45 degrees, of tau =
// 1: an error of alpha below 4 % / e, and above zero.
TEST(Ripple, IsBetweenZeroAndTheRippleOfTheFootprint) {
  ThreadPool pool(1);
  const double floor =
      reconstruction_ripple(standard_subject("scalar", true).value(), pool, CancelToken()).value();
  EXPECT_GT(floor, 1e-6);
  EXPECT_LT(floor, 0.5 * 0.039 / std::exp(1.0));
}

TEST(Ripple, IsAbsentForCurvedLatticesAndSlices) {
  ThreadPool pool(1);
  const Subject flat = standard_subject("climate", true).value();
  EXPECT_TRUE(std::isfinite(reconstruction_ripple(flat, pool, CancelToken()).value()));
  Subject bent = flat;
  bent.view.geometry.mapping = protocol::GeometryMapping::sphere;
  EXPECT_TRUE(std::isnan(reconstruction_ripple(bent, pool, CancelToken()).value()));
  Subject slice = flat;
  slice.view.geometry.slice = protocol::SliceView{};
  EXPECT_TRUE(std::isnan(reconstruction_ripple(slice, pool, CancelToken()).value()));
}

// Heights bend the lattice and change its box; the orbit of the study views the changed box.
TEST(Scene, FramesHeightsUnlessTheViewSetsItsFrame) {
  const auto terrain = [] {
    auto source = std::make_unique<scene::FakeSource>(
        scene::atmosphere_grid(),
        std::vector<data::FieldInfo>{scene::wind_info(), scene::scalar_info("z", "m")}, 1);
    source->values = [](const std::string& field, std::size_t n) {
      return field == "z" ? 1e5 * static_cast<double>(n) : 1.0;
    };
    return std::shared_ptr<data::Dataset>(scene::dataset_of(std::move(source)));
  };
  protocol::View view;
  view.geometry.height_field = "z";
  const auto own = terrain();
  const Subject subject = make_subject("terrain", own, view, {40, 30}).value();
  protocol::View framed = subject.view;
  scene::orbit(framed, scene::place_dataset(view.geometry, *own).value()->lattice, 30, 25, 1);
  EXPECT_EQ(subject.view.camera.eye, framed.camera.eye);
  EXPECT_EQ(subject.view.camera.height, framed.camera.height);

  view.camera.target = protocol::Vec3{0.25, 0, 0};
  EXPECT_EQ(make_subject("t", own, view, {40, 30}).value().view.camera.target, view.camera.target);
  view.camera.target.reset();
  view.camera.height = 0.75;
  EXPECT_EQ(make_subject("t", own, view, {40, 30}).value().view.camera.height, 0.75);
}

TEST(Encoding, HigherQualityReducesErrorAndIncreasesBytes) {
  ThreadPool pool(1);
  const auto all =
      measure_encoding(standard_subject("dense", true).value(), pool, CancelToken()).value();
  ASSERT_GT(all.size(), 2U);
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_LT(all[i].rmse, all[i - 1].rmse);
    EXPECT_GT(all[i].bytes, all[i - 1].bytes);
  }
}

}  // namespace
}  // namespace windsplat::study
