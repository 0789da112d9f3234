// Grid sizes, look-up by name, and guarantees of finish_volume.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kMax = std::numeric_limits<float>::max();

Volume make_volume(std::array<int, 3> dims, int components, std::vector<float> values) {
  Volume volume;
  volume.dims = dims;
  volume.components = components;
  volume.values = std::move(values);
  finish_volume(volume);
  return volume;
}

TEST(Grid, MultipliesItsAxesWithoutOverflow) {
  Grid grid;
  grid.axes[0].coordinates.resize(3000);
  grid.axes[1].coordinates.resize(2000);
  grid.axes[2].coordinates.resize(1000);
  EXPECT_EQ(grid.dims(), (std::array<int, 3>{3000, 2000, 1000}));
  EXPECT_EQ(grid.samples(), 6'000'000'000U);
}

TEST(DatasetInfo, FindsFieldsByNameAndKind) {
  DatasetInfo info;
  info.fields.resize(3);
  info.fields[0].name = "cloud";
  info.fields[1].name = "wind";
  info.fields[1].kind = FieldKind::vector;
  info.fields[2].name = "temperature";
  EXPECT_EQ(info.find("temperature"), &info.fields[2]);
  EXPECT_EQ(info.find("Temperature"), nullptr);
  EXPECT_EQ(info.first(FieldKind::scalar), &info.fields[0]);
  EXPECT_EQ(info.first(FieldKind::vector), &info.fields[1]);
  info.fields.erase(info.fields.begin() + 1);
  EXPECT_EQ(info.first(FieldKind::vector), nullptr);
}

TEST(FinishVolume, MasksInfinityAndNanAndComputesTheRange) {
  const Volume volume = make_volume({3, 2, 1}, 1, {4, kNan, -2, kInfinity, 7, -kInfinity});
  EXPECT_EQ(volume.masked, 3);
  EXPECT_EQ(volume.range, (std::array<float, 2>{-2, 7}));
  for (const int i : {1, 3, 5}) {
    EXPECT_TRUE(std::isnan(volume.values[static_cast<std::size_t>(i)])) << i;
  }
}

TEST(FinishVolume, UnitesTheMasksOfAVectorAndRangesItsMagnitude) {
  // Sample 0 is (3, 4, 12): length 13. Samples 1 and 2 lack one component each. Sample 3 is zero.
  const Volume volume = make_volume({4, 1, 1}, 3, {3, kNan, 5, 0, 4, 1, 5, 0, 12, 1, kInfinity, 0});
  EXPECT_EQ(volume.masked, 2);
  EXPECT_EQ(volume.range, (std::array<float, 2>{0, 13}));
  for (int c = 0; c < 3; ++c) {
    EXPECT_TRUE(std::isnan(volume.component(c)[1])) << c;
    EXPECT_TRUE(std::isnan(volume.component(c)[2])) << c;
    EXPECT_FALSE(std::isnan(volume.component(c)[0])) << c;
  }
}

TEST(FinishVolume, HugeComponentsDoNotOverflowTheMagnitude) {
  // 3e38 squared is beyond float32, and the length of (max, max) beyond its largest value.
  EXPECT_FLOAT_EQ(make_volume({1, 1, 1}, 2, {1.8e38F, 2.4e38F}).range[1], 3e38F);
  EXPECT_EQ(make_volume({1, 1, 1}, 2, {kMax, kMax}).range[1], kMax);
  // Tiny components do not vanish: (3e-30, 4e-30) has length 5e-30, although its square underflows.
  EXPECT_FLOAT_EQ(make_volume({1, 1, 1}, 2, {3e-30F, 4e-30F}).range[1], 5e-30F);
}

TEST(FinishVolume, FullyMaskedVolumeHasRangeZero) {
  const Volume volume = make_volume({2, 1, 1}, 2, {kNan, kNan, 1, 2});
  EXPECT_EQ(volume.masked, 2);
  EXPECT_EQ(volume.range, (std::array<float, 2>{0, 0}));
}

TEST(FinishVolume, RefusesAVolumeOfTheWrongSize) {
  Volume volume;
  volume.dims = {2, 2, 2};
  volume.values = Samples(7);
  EXPECT_THROW(finish_volume(volume), std::logic_error);
}

TEST(DatasetInfo, AbsentFieldsOnOtherGridsAreExplained) {
  DatasetInfo info;
  info.left_out = {{"pr", "on another grid (lat 3, lon 4)"},
                   {"lon_bnds", "bounds of a coordinate"}};
  EXPECT_EQ(absence_text(info, "pr"),
            ": it lies on another grid (lat 3, lon 4); to show it, append ?field=pr to the file's "
            "name (&field= behind other entries)");
  EXPECT_EQ(absence_text(info, "lon_bnds"), ": it is left out, bounds of a coordinate");
  EXPECT_EQ(absence_text(info, "none"), "");
}

}  // namespace
}  // namespace windsplat::data
