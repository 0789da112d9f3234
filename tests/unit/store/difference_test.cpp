// Handles whose fields are differences: values against closed forms, keys, memory and refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/resident/store.hpp"

namespace windsplat::data {
namespace {

using testing::HasSubstr;

constexpr std::array<std::size_t, 3> wave_dims{5, 4, 3};
constexpr std::size_t wave_samples = 5 * 4 * 3;
constexpr std::uint64_t wave_bytes = wave_samples * sizeof(float);

struct WavePlace {
  double x, y, z;
};

WavePlace place_of(std::size_t n) {
  return {static_cast<double>(n % 5), static_cast<double>(n / 5 % 4),
          100.0 * static_cast<double>(n / 20)};
}

// Scalar q = a (x y + s z^2 / 100), vector (a x, s y, a s z); sample 7 of step 1 is missing.
class Waves final : public Source {
 public:
  explicit Waves(double amplitude, std::size_t steps = 4) : amplitude_(amplitude) {
    for (std::size_t a = 0; a < 3; ++a) {
      Axis& axis = info_.grid.axes.at(a);
      axis.name = std::string(1, "xyz"[a]);
      axis.units = a == 2 ? "m" : "km";
      for (std::size_t n = 0; n < wave_dims.at(a); ++n) {
        axis.coordinates.push_back((a == 2 ? 100.0 : 1.0) * static_cast<double>(n));
      }
    }
    info_.fields = {field("q", {"q"}, "K"), field("v", {"u", "v", "w"}, "m s-1")};
    info_.fields[1].kind = FieldKind::vector;
    info_.steps.resize(steps);
    info_.digest = std::to_string(amplitude);
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  DatasetInfo& change() { return info_; }

  Result<Volume> read(std::size_t field, std::size_t step) override {
    Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = field == 0 ? 1 : 3;
    std::vector<float> values;
    for (int c = 0; c < volume.components; ++c) {
      for (std::size_t n = 0; n < wave_samples; ++n) {
        values.push_back(static_cast<float>(value(field, step, c, place_of(n))));
      }
    }
    if (step == 1) values[7] = std::numeric_limits<float>::quiet_NaN();
    volume.values = std::move(values);
    finish_volume(volume);
    return volume;
  }

 private:
  static FieldInfo field(const std::string& name, std::vector<std::string> components,
                         const std::string& units) {
    FieldInfo out;
    out.name = name;
    out.component_units.assign(components.size(), units);
    out.components = std::move(components);
    out.units = units;
    return out;
  }
  [[nodiscard]] double value(std::size_t field, std::size_t step, int c, const WavePlace& p) const {
    const auto s = static_cast<double>(step);
    if (field == 0) return amplitude_ * (p.x * p.y + s * p.z * p.z / 100);
    return c == 0 ? amplitude_ * p.x : c == 1 ? s * p.y : amplitude_ * s * p.z;
  }

  double amplitude_;
  DatasetInfo info_;
};

Dataset waves(double amplitude = 1, std::uint64_t bytes_max = 1 << 20) {
  return {std::make_unique<Waves>(amplitude), "waves", bytes_max};
}

TEST(DifferenceOfDatasets, OfTwoStepsIsTheClosedFormAtEverySample) {
  const Dataset dataset = waves();
  Dataset difference = dataset.minus(dataset, 0).value();
  const auto scalar = difference.volume("q", 3).value();
  const auto vector = difference.volume("v", 3).value();
  for (std::size_t n = 0; n < wave_samples; ++n) {
    const WavePlace p = place_of(n);
    EXPECT_FLOAT_EQ(scalar->values[n], static_cast<float>(3 * p.z * p.z / 100)) << n;
    EXPECT_FLOAT_EQ(vector->component(0)[n], 0) << n;
    EXPECT_FLOAT_EQ(vector->component(1)[n], static_cast<float>(3 * p.y)) << n;
    EXPECT_FLOAT_EQ(vector->component(2)[n], static_cast<float>(3 * p.z)) << n;
  }
  EXPECT_EQ(scalar->range, (std::array{0.0F, 1200.0F}));
  EXPECT_FLOAT_EQ(vector->range[1], std::hypot(9.0F, 600.0F)) << "of magnitudes";
  EXPECT_FLOAT_EQ((*Dataset(dataset).volume("q", 3))->range[1], 1212) << "the field itself remains";
}

TEST(DifferenceOfDatasets, FollowsTheStepUnlessOneIsNamed) {
  const Dataset dataset = waves(3);
  Dataset members = dataset.minus(waves(1), std::nullopt).value();
  Dataset fixed = dataset.minus(waves(1), 2).value();
  for (const std::size_t step : {0U, 2U, 3U}) {
    const auto same = members.volume("q", step).value();
    const auto second = fixed.volume("q", step).value();
    for (std::size_t n = 0; n < wave_samples; ++n) {
      const auto [x, y, z] = place_of(n);
      const double own = 3 * (x * y + static_cast<double>(step) * z * z / 100);
      EXPECT_FLOAT_EQ(same->values[n], static_cast<float>(own * 2 / 3)) << n << " at " << step;
      EXPECT_NEAR(second->values[n], own - (x * y + 2 * z * z / 100), 1e-4) << n << " at " << step;
    }
  }
}

TEST(DifferenceOfDatasets, SamplesThatEitherMissesAreMissing) {
  const Dataset dataset = waves();
  for (const auto& [step, minus] : {std::pair<std::size_t, std::size_t>{1, 0}, {2, 1}}) {
    Dataset difference = dataset.minus(dataset, minus).value();
    const auto scalar = difference.volume("q", step).value();
    EXPECT_EQ(scalar->masked, 1) << step;
    EXPECT_TRUE(std::isnan(scalar->values[7]));
    const auto vector = difference.volume("v", step).value();
    EXPECT_EQ(vector->masked, 1) << step;
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isnan(vector->component(c)[7])) << c;
  }
}

TEST(DifferenceOfDatasets, IsKeptOnceAndNeverLoadedByTheRenderer) {
  Dataset dataset = waves();
  Dataset difference = dataset.minus(dataset, 0).value();
  Dataset resident = difference.resident_only();
  EXPECT_EQ(resident.volume("q", 2).error().kind, ErrorKind::not_resident);
  ASSERT_TRUE(dataset.volume("q", 2));
  ASSERT_TRUE(dataset.volume("q", 0));
  EXPECT_EQ(resident.volume("q", 2).error().kind, ErrorKind::not_resident)
      << "a subtraction is no task of the renderer";
  const auto made = difference.volume("q", 2).value();
  EXPECT_EQ(resident.volume("q", 2).value(), made);
  EXPECT_EQ(difference.prefetching().volume("q", 2).value(), made);
  EXPECT_EQ(dataset.resident_bytes(), 3 * wave_bytes) << "both steps and their difference";
  EXPECT_EQ(dataset.loads(), 2U);
  Dataset other = dataset.minus(dataset, 1).value();
  EXPECT_NE(other.volume("q", 2).value(), made);
  EXPECT_EQ(dataset.minuend().volume("q", 2).value(), dataset.volume("q", 2).value());
}

TEST(DifferenceOfDatasets, LevelsAndRememberedNumbersAreThoseOfTheDifference) {
  Dataset dataset = waves();
  Dataset difference = dataset.minus(dataset, 0).value();
  const Derivation sum{"sum", sizeof(float), [](const Volume& volume) {
                         Volume out;
                         out.dims = {1, 1, 1};
                         float total = 0;
                         for (const float value : volume.values) total += value;
                         out.values = {total};
                         return out;
                       }};
  const float own = dataset.derived("q", 3, sum).value()->values[0];
  EXPECT_FLOAT_EQ(own, 60 * 3 + 20 * 3 * 500) << "mean of x y is 3";
  EXPECT_FLOAT_EQ(difference.derived("q", 3, sum).value()->values[0], 20 * 3 * 500);
  EXPECT_NE(dataset.key_of("q", 3, sum), difference.key_of("q", 3, sum));
  const auto one = [] { return Result<std::vector<double>>(std::vector{1.0}); };
  const auto two = [] { return Result<std::vector<double>>(std::vector{2.0}); };
  EXPECT_EQ(dataset.remembered("top", one).value().front(), 1);
  EXPECT_EQ(difference.remembered("top", two).value().front(), 2);
}

TEST(DifferenceOfDatasets, NeedsRoomForBothStepsAndTheResult) {
  const Dataset small = waves(1, 3 * wave_bytes);
  Dataset difference = small.minus(small, 0).value();
  EXPECT_EQ(difference.loading_bytes("q"), 3 * wave_bytes);
  EXPECT_EQ(small.loading_bytes("q"), wave_bytes);
  EXPECT_TRUE(difference.volume("q", 2));
  const Dataset less = waves(1, 3 * wave_bytes - 1);
  const auto refused = less.minus(less, 0).value().volume("q", 2);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
}

TEST(DifferenceOfDatasets, DifferentGridsAreRefusedWithTheAxisAndItsValues) {
  const auto refusal = [](const auto& change) {
    auto source = std::make_unique<Waves>(1);
    change(source->change());
    const Dataset other(std::move(source), "other", 1 << 20);
    const auto difference = waves().minus(other, std::nullopt);
    return difference ? std::string() : difference.error().message;
  };
  EXPECT_EQ(refusal([](DatasetInfo&) {}), "");
  EXPECT_EQ(refusal([](DatasetInfo& info) { info.grid.axes[2].coordinates[1] = 110; }),
            "the grids differ along z ('z'): sample 1 is at 100 here, at 110 in 'other'");
  EXPECT_EQ(refusal([](DatasetInfo& info) { info.grid.axes[0].coordinates.push_back(5); }),
            "the grids differ along x ('x'): 5 samples here, 6 in 'other'");
  EXPECT_EQ(refusal([](DatasetInfo& info) { info.grid.axes[1].units = "m"; }),
            "the grids differ along y ('y'): 'km' here, 'm' in 'other'");
  EXPECT_EQ(refusal([](DatasetInfo& info) { info.grid.axes[2].kind = AxisKind::height; }),
            "the grids differ along z ('z'): coordinates here, heights in 'other'");
  EXPECT_EQ(refusal([](DatasetInfo& info) { info.grid.axes[0].coordinates[3] = 3.0000002; }), "")
      << "the rounding of float";
  EXPECT_THAT(refusal([](DatasetInfo& info) {
                Columns columns;
                columns.longitude.assign(20, 0);
                columns.latitude.assign(20, 0);
                info.grid.columns = std::make_shared<const Columns>(std::move(columns));
              }),
              HasSubstr("longitudes and latitudes of columns in 'other' only"));
}

TEST(DifferenceOfDatasets, FieldsThatMeasureSomethingElseAreRefused) {
  auto source = std::make_unique<Waves>(1);
  source->change().fields[0].units = source->change().fields[0].component_units[0] = "degC";
  source->change().fields[1].component_units.assign(3, "m/s");
  const Dataset other(std::move(source), "other", 1 << 20);
  Dataset difference = waves().minus(other, std::nullopt).value();
  const auto refused = difference.volume("q", 0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "the units of 'q' differ: 'K' here, 'degC' in 'other'");
  EXPECT_TRUE(difference.volume("v", 0)) << "m/s is m s-1";
  auto lacking = std::make_unique<Waves>(1);
  lacking->change().fields.erase(lacking->change().fields.begin());
  const auto absent =
      waves().minus(Dataset(std::move(lacking), "other", 1 << 20), std::nullopt)->volume("q", 0);
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message, HasSubstr("dataset 'other' has no field 'q' to subtract"));
}

TEST(DifferenceOfDatasets, StepsThatDoNotExistAreRefused) {
  const Dataset dataset = waves();
  EXPECT_THAT(dataset.minus(dataset, 4).error().message, HasSubstr("has steps 0 to 3"));
  const Dataset shorter(std::make_unique<Waves>(1, 2), "shorter", 1 << 20);
  Dataset difference = dataset.minus(shorter, std::nullopt).value();
  EXPECT_TRUE(difference.volume("q", 1));
  EXPECT_EQ(difference.volume("q", 2).error().message,
            "dataset 'shorter' has no step 2; its last step is 1");
}

}  // namespace
}  // namespace windsplat::data
