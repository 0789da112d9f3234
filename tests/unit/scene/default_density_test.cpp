// Lines, colours and opacities of default views by measures: separation, coverage, range, depth.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/defaults/opacity.hpp"
#include "server/scene/defaults/some_samples.hpp"
#include "server/scene/defaults/spacing.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using Dims = std::array<int, 3>;

Lattice box_lattice(const Dims& dims) {
  data::Grid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> at;
    for (int n = 0; n < dims[a]; ++n) at.push_back(0.1 * n);
    grid.axes[a] = axis(data::AxisKind::cartesian, "m", at);
  }
  auto lattice = place_lattice(grid, {});
  EXPECT_TRUE(lattice);
  return *lattice;
}

// A volume of one component; x, y and z from -1 to 1 over the samples of each axis.
data::Volume volume_of(const Dims& dims,
                       const std::function<double(double x, double y, double z)>& value) {
  data::Volume volume;
  volume.dims = dims;
  const auto at = [&](int n, std::size_t a) { return 2.0 * n / std::max(1, dims[a] - 1) - 1; };
  std::vector<float> values;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) {
        values.push_back(static_cast<float>(value(at(x, 0), at(y, 1), at(z, 2))));
      }
    }
  }
  volume.values = std::move(values);
  data::finish_volume(volume);
  return volume;
}

const std::vector<Dims> dense_boxes = {{32, 32, 32},   {64, 64, 64},   {128, 128, 128},
                                       {200, 100, 40}, {320, 160, 19}, {300, 300, 1},
                                       {400, 1, 90},   {90, 40, 12}};

TEST(DefaultSpacing, LinesStayApartAndCoverLessThanTheBox) {
  for (const Dims& dims : dense_boxes) {
    const Lattice lattice = box_lattice(dims);
    const LineSpacing spacing = default_spacing(lattice, std::nullopt);
    const LineDensity density = line_density(spacing, lattice, std::nullopt);
    const std::string what = std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x " +
                             std::to_string(dims[2]) + ", stride " + std::to_string(spacing.stride);
    EXPECT_LE(density.coverage, 0.8) << what;
    EXPECT_GE(density.gap, 3 - 1e-9) << what;
    EXPECT_GE(spacing.length * 1.01, 2 * spacing.stride * cell_size(lattice, 0)) << what;
  }
}

// A smaller stride would bring them closer than that.
TEST(DefaultSpacing, TheStrideIsTheSmallestThatSuffices) {
  for (const Dims& dims : dense_boxes) {
    const Lattice lattice = box_lattice(dims);
    const int stride = default_spacing(lattice, std::nullopt).stride;
    ASSERT_GT(stride, 1);
    const LineSpacing denser{stride - 1, spaced_length(2, stride - 1, lattice, std::nullopt)};
    const LineDensity density = line_density(denser, lattice, std::nullopt);
    // Lines as long as the coverage and the gap allow, in widths of 2 pixels.
    const double longer = std::min({0.8 / density.coverage, density.gap / 3, 2.5});
    const double widths = density.apart_px * density.apart_px / (4 * density.gap) * longer;
    EXPECT_TRUE(density.coverage > 0.76 || density.gap < 3.15 || widths < 25.2) << dims[0];
  }
}

// Mean length of the lines drawn by default over their width of 2 pixels, in the plane of the
// picture.
double mean_widths(const Lattice& lattice, const data::Volume& speeds) {
  const LineSpacing spacing = default_spacing(lattice, std::nullopt);
  const protocol::Range range = default_magnitude_range(speeds);
  const double least = default_min_magnitude(range, spacing, speeds, lattice, std::nullopt);
  const LineDensity density = line_density(spacing, lattice, std::nullopt);
  double sum = 0;
  double lines = 0;
  for_some_samples(speeds, std::nullopt, [&](std::size_t, double speed) {
    if (speed < least) return;
    sum += std::min(speed / range[1], 1.0);
    ++lines;
  });
  return sum / lines * density.apart_px * density.apart_px / (4 * density.gap);
}

// With an exponential distribution of magnitudes their mean is a quarter of the top of the range.
TEST(DefaultSpacing, LinesAreLongEnoughToTellHeadFromTail) {
  for (const Dims& dims : {Dims{64, 64, 64}, Dims{200, 100, 40}, Dims{320, 160, 19},
                           Dims{300, 300, 1}, Dims{90, 40, 12}}) {
    std::size_t n = 0;
    const data::Volume speeds = volume_of(dims, [&](double, double, double) {
      return -10 * std::log(1 - std::fmod(0.6180339887498949 * static_cast<double>(++n), 1.0));
    });
    EXPECT_GE(mean_widths(box_lattice(dims), speeds), 5.5) << dims[0] << ' ' << dims[2];
  }
}

// As drawn: foreshortened, and smaller where they are farther away. Winds are level.
TEST(DefaultSpacing, LinesOfTheClimateAreSixWidthsLongInThePicture) {
  auto dataset = sample_dataset("climate");
  const auto full = complete({}, *dataset);
  ASSERT_TRUE(full);
  const protocol::VectorView& vector = full->view().vector;
  const auto wind = dataset->volume(vector.field.name, 0);
  ASSERT_TRUE(wind);
  const Camera& camera = full->camera();
  const Lattice& lattice = full->lattice();
  double sum = 0;
  double lines = 0;
  for_some_samples(**wind, std::nullopt, [&](std::size_t at, double speed) {
    if (speed < *vector.min_magnitude) return;
    const auto row = static_cast<std::size_t>(lattice.dims[0]);
    const auto rows = static_cast<std::size_t>(lattice.dims[1]);
    const glm::dvec3 place(lattice.positions[0][at % row], lattice.positions[1][at / row % rows],
                           lattice.positions[2][at / (row * rows)]);
    const glm::dvec3 way(static_cast<double>((*wind)->component(0)[at]),
                         static_cast<double>((*wind)->component(1)[at]), 0);
    const double part = std::min(speed / (*vector.magnitude_range)[1], 1.0);
    const glm::dvec3 line = *vector.length * part * glm::normalize(way);
    const double across = glm::length(line - glm::dot(line, camera.forward) * camera.forward);
    const double depth = glm::dot(place - camera.eye, camera.forward);
    sum += 0.5 * camera.height / camera.half_height * across / depth;
    ++lines;
  });
  EXPECT_GE(sum / lines / (vector.r1 + vector.r2), 6);
}

TEST(DefaultSpacing, FewSamplesKeepAllTheirLinesAtFiveSpacings) {
  const Lattice lattice = box_lattice({8, 8, 8});
  const LineSpacing spacing = default_spacing(lattice, std::nullopt);
  EXPECT_EQ(spacing.stride, 1);
  EXPECT_NEAR(spacing.length, 5 * cell_size(lattice, 0), 0.05 * spacing.length);
}

TEST(DefaultSpacing, AxesOfFewSamplesKeepTheirLayers) {
  const auto layers = [](int samples) {
    const int stride = default_spacing(box_lattice({500, 500, samples}), std::nullopt).stride;
    return (samples + stride - 1) / stride;
  };
  for (const int samples : {5, 6, 7, 9, 14, 30}) EXPECT_GE(layers(samples), 3) << samples;
  for (const int samples : {2, 3, 4}) EXPECT_GE(layers(samples), 2) << samples;
}

TEST(DefaultSpacing, ASliceHasASpacingOfItsOwn) {
  const Lattice lattice = box_lattice({64, 64, 64});
  const Slice slice{2, 10};
  const LineSpacing whole = default_spacing(lattice, std::nullopt);
  const LineSpacing layer = default_spacing(lattice, slice);
  EXPECT_LT(layer.stride, whole.stride) << "no other layers are before it";
  EXPECT_GE(line_density(layer, lattice, slice).gap, 3 - 1e-9);
}

TEST(DefaultLeastMagnitude, LeavesOnlyLinesOutThatShowNoDirectionWhereTheStrideSuffices) {
  const Dims dims = {64, 64, 64};
  const Lattice lattice = box_lattice(dims);
  const data::Volume speeds =
      volume_of(dims, [](double x, double y, double) { return 10 * std::hypot(x, y); });
  const protocol::Range range = default_magnitude_range(speeds);
  const LineSpacing spacing = default_spacing(lattice, std::nullopt);
  const double least = default_min_magnitude(range, spacing, speeds, lattice, std::nullopt);
  // Lines are 2 pixels wide and keep `gap` widths apart.
  const LineDensity density = line_density(spacing, lattice, std::nullopt);
  const double longest = density.apart_px * density.apart_px / (2 * density.gap);
  EXPECT_NEAR(least / range[1] * longest, 4, 1.5);
}

TEST(DefaultLeastMagnitude, KeepsHalfOfTheLinesWhereMostAreShort) {
  const Dims dims = {64, 64, 64};
  const Lattice lattice = box_lattice(dims);
  const data::Volume speeds = volume_of(dims, [](double x, double y, double z) {
    return 0.3 + 20 * std::exp(-9 * (x * x + y * y + z * z));
  });
  const LineSpacing spacing = default_spacing(lattice, std::nullopt);
  const double least = default_min_magnitude(default_magnitude_range(speeds), spacing, speeds,
                                             lattice, std::nullopt);
  EXPECT_LE(hidden_share(least, speeds), 0.55);
}

// Two levels keep every sample: the weakest lines give way to the others.
TEST(DefaultLeastMagnitude, TheLinesLeftCoverFourFifthsOfTheBox) {
  const Dims dims = {400, 200, 2};
  const Lattice lattice = box_lattice(dims);
  const data::Volume speeds =
      volume_of(dims, [](double x, double y, double) { return 20 + 10 * std::sin(3 * x + y); });
  const protocol::Range range = default_magnitude_range(speeds);
  const LineSpacing spacing = default_spacing(lattice, std::nullopt);
  ASSERT_EQ(spacing.stride, 1);
  const double least = default_min_magnitude(range, spacing, speeds, lattice, std::nullopt);
  // Lines of the mean length that the coverage assumes have three quarters of the longest.
  const double whole = line_density(spacing, lattice, std::nullopt).coverage / 0.75;
  double covered = 0;
  for (const float speed : speeds.values) {
    const auto magnitude = static_cast<double>(speed);
    if (magnitude >= least) covered += std::min(magnitude / range[1], 1.0);
  }
  covered *= whole / static_cast<double>(speeds.samples());
  EXPECT_GT(whole, 2) << "more than there is room for";
  EXPECT_NEAR(covered, 0.8, 0.08);
}

// Whether the stride suffices, or lines give way to others: those of the greatest magnitude stay,
// though no number as readable as the threshold lies just below it.
TEST(DefaultLeastMagnitude, IsBelowTheMagnitudeOfAUniformFlow) {
  for (const Dims& dims : {Dims{40, 30, 20}, Dims{400, 200, 2}, Dims{9, 1, 1}, Dims{1, 1, 1}}) {
    const Lattice lattice = box_lattice(dims);
    const LineSpacing spacing = default_spacing(lattice, std::nullopt);
    for (const double speed : {0.123, 0.35, 1.0, 5.196, 7.77, 31.99, 1e-12, 3e30}) {
      const data::Volume speeds = volume_of(dims, [&](double, double, double) { return speed; });
      const double least = default_min_magnitude(default_magnitude_range(speeds), spacing, speeds,
                                                 lattice, std::nullopt);
      EXPECT_LT(least, speeds.range[0]) << speed;
    }
  }
}

double cube_of(double value) { return value * value * value; }

// A pole is not a flow that is zero nearly everywhere: at half the box from it lines are drawn.
TEST(DefaultMagnitudes, OfFieldsThatFallOverDecadesShowMoreThanThePole) {
  const auto off_center = [](double x, double y, double z) {
    return 1 / cube_of(std::hypot(x - 0.31, y + 0.22, z - 0.13) + 1e-3);
  };
  const auto dipole = [](double x, double y, double z) {
    const double r = std::hypot(x, y, z);
    return std::sqrt(1 + 3 * z * z / (r * r)) / cube_of(r);
  };
  for (const auto& field : {std::function<double(double, double, double)>(off_center),
                            std::function<double(double, double, double)>(dipole)}) {
    const Dims dims = {64, 64, 64};
    const data::Volume speeds = volume_of(dims, field);
    const protocol::Range range = default_magnitude_range(speeds);
    EXPECT_LT(range[1], 1e-2 * static_cast<double>(speeds.range[1]));
    EXPECT_GT(range[1], quantiles(speeds, 0.97, 0.97)[0]);
    const Lattice lattice = box_lattice(dims);
    const double least = default_min_magnitude(range, default_spacing(lattice, std::nullopt),
                                               speeds, lattice, std::nullopt);
    EXPECT_LT(hidden_share(least, speeds), 0.6);
    EXPECT_LT(default_color_top(speeds), 3 * range[1]);
  }
}

TEST(DefaultMagnitudes, OfAFlowInAHundredthOfTheBoxAreThoseOfThatFlow) {
  const data::Volume jet = volume_of({60, 60, 60}, [](double x, double y, double) {
    return 1e-4 + 20 * std::exp(-(x * x + y * y) / 0.002);
  });
  EXPECT_GE(default_magnitude_range(jet)[1], 0.15 * static_cast<double>(jet.range[1]));
  EXPECT_LE(default_magnitude_range(jet)[1], 1.2 * static_cast<double>(jet.range[1]));
}

// Zero at the first step, afterwards a ramp up to 0.002.
class LateSource final : public data::Source {
 public:
  explicit LateSource(int steps, bool ever,
                      const data::FieldInfo& field = scalar_info("qc", "kg kg-1"))
      : ever_(ever) {
    info_ = FakeSource(atmosphere_grid(), {field}, steps).info();
  }
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<data::Volume> read(std::size_t, std::size_t step) override {
    ++reads;
    if (on_read) on_read();
    if (step >= unreadable_from) return make_error(ErrorKind::bad_data, "the file ends");
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(info_.fields.front().components.size());
    std::vector<float> values;
    for (std::size_t n = 0; n < volume.samples() * info_.fields.front().components.size(); ++n) {
      const double share = static_cast<double>(n) / static_cast<double>(volume.samples());
      values.push_back(step > 0 && ever_ ? static_cast<float>(0.002 * share) : 0.0F);
    }
    volume.values = std::move(values);
    data::finish_volume(volume);
    return volume;
  }
  int reads = 0;
  std::function<void()> on_read;
  std::size_t unreadable_from = std::numeric_limits<std::size_t>::max();

 private:
  data::DatasetInfo info_;
  bool ever_;
};

TEST(DefaultStep, CloudsThatFormLaterHaveTheirOwnRangeAtEveryStep) {
  auto dataset = dataset_of(std::make_unique<LateSource>(12, true));
  for (const int step : {0, 3, 11}) {
    protocol::View view;
    view.step = step;
    const auto full = complete(view, *dataset);
    ASSERT_TRUE(full);
    const auto& scalars = *full->view().scalars;
    ASSERT_EQ(scalars.size(), 1U);
    EXPECT_NEAR((*scalars.front().color.range)[1], 0.002, 0.0004) << step;
    EXPECT_LT(scalars.front().extinction->back()[0], 0.003) << step;
  }
}

TEST(DefaultStep, AFieldThatNeverVariesIsReadAtFiveStepsAtMost) {
  auto source = std::make_unique<LateSource>(400, false);
  LateSource& late = *source;
  auto dataset = dataset_of(std::move(source));
  for (int round = 0; round < 2; ++round) {
    const auto full = complete({}, *dataset);
    ASSERT_TRUE(full);
    EXPECT_EQ((*full->view().scalars->front().color.range)[1], 1);
  }
  EXPECT_LE(late.reads, 5);
}

// As of a file that is still being written.
TEST(DefaultStep, StepsThatCannotBeReadAreLeftOut) {
  auto source = std::make_unique<LateSource>(12, true);
  source->unreadable_from = 9;
  auto dataset = dataset_of(std::move(source));
  const auto full = complete({}, *dataset);
  ASSERT_TRUE(full) << full.error().message;
  EXPECT_NEAR((*full->view().scalars->front().color.range)[1], 0.002, 0.0004) << "that of step 5";
}

TEST(DefaultStep, VectorsThatAreNotShownAreCountedAtTheStepThatIsNamed) {
  auto dataset = dataset_of(std::make_unique<LateSource>(12, true, wind_info()));
  const auto full = complete({}, *dataset);
  ASSERT_TRUE(full) << full.error().message;
  protocol::View view = full->view();
  view.vector.min_magnitude = 1;  // none is as long
  const std::string text = hidden_vectors(view, *dataset).value();
  EXPECT_NE(text.find("100 % of those at step 11"), std::string::npos) << text;
}

TEST(DefaultStep, ACancelledRequestReadsNoFurtherStep) {
  auto source = std::make_unique<LateSource>(400, false);
  LateSource& late = *source;
  auto dataset = dataset_of(std::move(source));
  CancelToken cancel;
  late.on_read = [&] { cancel.cancel(); };
  data::Dataset handle = dataset->cancelled_by(cancel);
  const auto none = complete({}, handle);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(late.reads, 1);
}

TEST(DefaultColors, ReachTheGreatestMagnitude) {
  for (const double most : {7.3, 57.0, 116.0, 0.42}) {
    const data::Volume speeds = volume_of({40, 40, 20}, [&](double x, double y, double z) {
      return most * std::exp(-2 * std::abs(x * y * z)) * std::abs(z);
    });
    const double top = default_color_top(speeds);
    EXPECT_GE(top, speeds.range[1]) << most;
    EXPECT_LE(top, 1.1 * speeds.range[1]) << most;
  }
}

// At the pole of 1 / r^2 the greatest magnitude is a matter of where samples lie.
TEST(DefaultColors, LeaveAFewFarBeyondToTheTriangleOfTheLegend) {
  const data::Volume speeds = volume_of(
      {48, 48, 48}, [](double x, double y, double z) { return 1 / (x * x + y * y + z * z); });
  const double top = default_color_top(speeds);
  const auto beyond = std::count_if(speeds.values.begin(), speeds.values.end(),
                                    [&](float speed) { return static_cast<double>(speed) > top; });
  EXPECT_GT(beyond, 0);
  EXPECT_LT(static_cast<double>(beyond), 0.02 * static_cast<double>(speeds.samples()));
  EXPECT_LT(top, 2.6 * quantiles(speeds, 0.98, 0.98)[0]);
}

TEST(DefaultColors, AStatedMagnitudeRangeIsThatOfTheColors) {
  auto dataset = sample_dataset("tornado", {24, 24, 24});
  protocol::View view;
  const auto plain = complete(view, *dataset);
  view.vector.magnitude_range = protocol::Range{0, 40};
  const auto stated = complete(view, *dataset);
  ASSERT_TRUE(plain && stated);
  EXPECT_EQ((*stated->view().vector.color.range)[1], 40);
  EXPECT_GT((*plain->view().vector.color.range)[1], 40);
}

using Extinction = std::vector<std::array<double, 2>>;

// The optical depth of the mean ray of the default picture.
double depth_of(const Extinction& curve, const data::Volume& volume, const Lattice& lattice) {
  return mean_extinction(curve, volume, lattice) * mean_chord(lattice);
}

double extinction_at(const Extinction& curve, double value) {
  data::Volume one;
  one.dims = {1, 1, 1};
  one.values = {static_cast<float>(value)};
  data::finish_volume(one);
  return mean_extinction(curve, one, box_lattice({1, 1, 1}));
}

TEST(DefaultOpacity, TheMeanRayIsHalfTransparent) {
  const Dims dims = {40, 30, 20};
  const Lattice lattice = box_lattice(dims);
  const std::vector<data::Volume> volumes = {
      volume_of(dims, [](double x, double y, double z) { return x + 0.4 * y - 0.3 * z; }),
      volume_of(dims, [](double x, double, double z) { return std::tanh(5 * z + x); }),
      volume_of(dims, [](double x, double y, double z) { return std::sin(4 * x) * y * z; }),
      volume_of(dims, [](double x, double, double) { return x > -0.8 ? 1 : 0; })};
  const data::FieldInfo heat = scalar_info("heat", "K");
  const data::FieldInfo humidity = scalar_info("q", "kg kg-1");
  for (const data::Volume& volume : volumes) {
    for (const data::FieldInfo& field : {heat, humidity}) {
      const protocol::Range range = default_scalar_range(field, volume);
      const Extinction curve = transparent_extinction(scalar_style(field), range, volume, lattice);
      EXPECT_LE(depth_of(curve, volume, lattice), 1 + 1e-9) << field.name;
      EXPECT_GT(depth_of(curve, volume, lattice), 0.1) << field.name;
    }
  }
}

// A small body stays as opaque as its style allows.
TEST(DefaultOpacity, ASmallBodyIsNotMadeFaint) {
  for (const Dims& dims : {Dims{40, 40, 40}, Dims{40, 40, 33}}) {
    const Lattice lattice = box_lattice(dims);
    const data::FieldInfo field = scalar_info("s", "1");
    const data::Volume blob = volume_of(
        dims, [](double x, double y, double z) { return std::exp(-40 * (x * x + y * y + z * z)); });
    const protocol::Range range = default_scalar_range(field, blob);
    double most = 0;
    for (const auto& [value, extinction] :
         transparent_extinction(scalar_style(field), range, blob, lattice)) {
      most = std::max(most, extinction);
    }
    EXPECT_GT(most * 0.3, 0.5) << "optical depth through the body";
    EXPECT_LE(most * dims[2] * cell_size(lattice, 2), 8 * (1 + 1e-9)) << "through the box";
  }
}

TEST(DefaultOpacity, BoundariesAreSeenAndBodiesOfOneValueSeenThrough) {
  const Dims dims = {32, 32, 32};
  const Lattice lattice = box_lattice(dims);
  const data::FieldInfo field = scalar_info("heat", "K");
  const data::Volume layers =
      volume_of(dims, [](double, double, double z) { return 290 + 10 * std::tanh(4 * (z - 0.1)); });
  const Extinction curve = transparent_extinction(
      scalar_style(field), default_scalar_range(field, layers), layers, lattice);
  EXPECT_EQ(extinction_at(curve, 281), 0) << "below the median";
  EXPECT_GT(extinction_at(curve, 295), 1.5 * extinction_at(curve, 300));
  EXPECT_GT(extinction_at(curve, 300), 0);
}

// They are seen along their normal, and have no depth.
TEST(DefaultOpacity, DataOfOneLayerAreOpaque) {
  data::Grid grid = atmosphere_grid();
  grid.axes[0].coordinates = {0};
  auto dataset = dataset_of(std::make_unique<FakeSource>(
      grid, std::vector<data::FieldInfo>{scalar_info("heat", "K")}, 1));
  const auto full = complete(protocol::View{}, *dataset);
  ASSERT_TRUE(full);
  const double top = full->view().scalars->front().extinction->back()[1];
  EXPECT_GE(top * cell_size(full->lattice(), 0), 7.9);
}

TEST(DefaultOpacity, MasksAndConstantsHaveACurve) {
  const Dims dims = {6, 5, 4};
  const Lattice lattice = box_lattice(dims);
  const data::FieldInfo field = scalar_info("s", "1");
  for (const double value : {0.0, -3.0, 1e-35, 1e30, std::nan("")}) {
    const data::Volume volume = volume_of(dims, [&](double, double, double) { return value; });
    const protocol::Range range = default_scalar_range(field, volume);
    const Extinction curve = transparent_extinction(scalar_style(field), range, volume, lattice);
    for (std::size_t n = 0; n < curve.size(); ++n) {
      EXPECT_TRUE(std::isfinite(curve[n][0]) && curve[n][1] >= 0 && curve[n][1] < 1e6) << value;
      if (n == 0) continue;
      EXPECT_GE(curve[n][0] - curve[n - 1][0], 1e-30) << value;
    }
  }
}

}  // namespace
}  // namespace windsplat::scene
