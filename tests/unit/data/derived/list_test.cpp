// Which derived fields a dataset lists, and what they read.
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/data/derived/formula_source.hpp"

namespace windsplat::data::derived_test {
namespace {

const std::vector<std::string> velocity(3, "m s-1");
Vec zero(std::size_t, std::size_t, std::size_t) { return {}; }

Grid box() {
  Grid grid;
  for (Axis& axis : grid.axes) axis = axis_of(AxisKind::cartesian, "m", evenly(0, 1, 3));
  return grid;
}

using Names = std::vector<std::string>;

Names names_of(const DatasetInfo& info) {
  Names names;
  for (const FieldInfo& field : info.fields) {
    if (field.derived) names.push_back(field.name);
  }
  return names;
}

Names names_of(const Grid& grid, const std::vector<std::string>& units) {
  auto source = std::make_unique<FormulaSource>(grid);
  source->add("v", units, zero);
  return names_of(derive(std::move(source))->info());
}

const Names all_of_velocity{
    "v_speed",      "v_horizontal_speed", "v_vorticity", "v_vertical_vorticity",
    "v_divergence", "v_q_criterion",      "v_helicity"};

TEST(DerivedFields, AVelocityInSpaceHasSeven) {
  EXPECT_EQ(names_of(box(), velocity), all_of_velocity);
}

// 8192 x 1024 x 512 samples.
TEST(DerivedFields, OfMoreThan16GiBAreLeftOutByName) {
  Grid grid = box();
  grid.axes[0] = axis_of(AxisKind::cartesian, "m", evenly(0, 1, 8192));
  grid.axes[1] = axis_of(AxisKind::cartesian, "m", evenly(0, 1, 1024));
  grid.axes[2] = axis_of(AxisKind::cartesian, "m", evenly(0, 1, 512));
  auto source = std::make_unique<FormulaSource>(grid);
  source->add("v", velocity, zero);
  const auto derived = derive(std::move(source));
  Names left;
  for (const LeftOut& one : derived->info().left_out) {
    left.push_back(one.name);
    EXPECT_EQ(one.reason, "computed as a whole, of more than 16 GiB a step");
  }
  EXPECT_EQ(left, Names{"v_vorticity"});
  EXPECT_EQ(names_of(derived->info()).size(), all_of_velocity.size() - 1);
}

TEST(DerivedFields, AHorizontalVelocityHasThoseOfTheLevels) {
  EXPECT_EQ(names_of(box(), {"m s-1", "m s-1"}),
            (Names{"v_speed", "v_vertical_vorticity", "v_divergence"}));
}

TEST(DerivedFields, OmegaIsNoVelocity) {
  EXPECT_EQ(names_of(box(), {"m s-1", "m s-1", "Pa s-1"}),
            (Names{"v_horizontal_speed", "v_vertical_vorticity", "v_divergence"}));
}

TEST(DerivedFields, OtherVectorsHaveMagnitudeDivergenceAndCurl) {
  auto source = std::make_unique<FormulaSource>(box());
  source->add("E", {"V m-1", "V m-1", "V m-1"}, zero);
  source->add("n", {"", "", ""}, zero);
  const auto derived = derive(std::move(source));
  EXPECT_EQ(names_of(derived->info()),
            (Names{"E_magnitude", "E_divergence", "E_curl", "n_magnitude"}));
  EXPECT_EQ(derived->info().find("E_curl")->units, "V m-2");
  EXPECT_EQ(derived->info().find("E_magnitude")->units, "V m-1");
}

TEST(DerivedFields, ALengthThatIsNotKnownLeavesOutWhatNeedsIt) {
  Grid grid = box();
  grid.axes[2] = axis_of(AxisKind::level, "1", evenly(1, 1, 3));
  EXPECT_EQ(names_of(grid, velocity),
            (Names{"v_speed", "v_horizontal_speed", "v_vertical_vorticity", "v_divergence"}));
  grid.axes[0].units = "";
  EXPECT_EQ(names_of(grid, velocity), (Names{"v_speed", "v_horizontal_speed"}));
}

TEST(DerivedFields, OneLayerHasThoseOfTheLevelsOnly) {
  Grid grid = box();
  grid.axes[2].coordinates = {0};
  EXPECT_EQ(names_of(grid, velocity),
            (Names{"v_speed", "v_horizontal_speed", "v_vertical_vorticity", "v_divergence"}));
}

TEST(DerivedFields, ASectionHasSpeedsOnly) {
  for (const std::size_t normal : {0U, 1U}) {
    Grid grid = box();
    grid.axes.at(normal).coordinates = {0};
    EXPECT_EQ(names_of(grid, velocity), (Names{"v_speed", "v_horizontal_speed"})) << normal;
  }
}

TEST(DerivedFields, ANameOfTheFileIsLeftToIt) {
  auto source = std::make_unique<FormulaSource>(box());
  source->add("v", velocity, zero);
  source->add("v_speed", {"m s-1"}, zero);
  const auto derived = derive(std::move(source));
  EXPECT_FALSE(derived->info().find("v_speed")->derived);
  EXPECT_EQ(names_of(derived->info()).size(), all_of_velocity.size() - 1);
}

TEST(DerivedFields, AreThoseOfTheFirstFourVectorsAfterAllOthers) {
  auto source = std::make_unique<FormulaSource>(box());
  for (const char* name : {"a", "b", "c", "d", "e"}) source->add(name, velocity, zero);
  source->add("s", {"1"}, zero);
  const auto derived = derive(std::move(source));
  const auto& fields = derived->info().fields;
  EXPECT_EQ(fields[5].name, "s");
  EXPECT_EQ(fields.size(), 6 + 4 * all_of_velocity.size());
  EXPECT_EQ(derived->info().find("e_speed"), nullptr);
}

TEST(DerivedFields, HorizontalOnesAreNotRepeatedForAVectorThatDiffersInItsThirdComponent) {
  auto source = std::make_unique<FormulaSource>(box());
  source->add("v", {"m s-1", "m s-1", "Pa s-1"}, zero);
  source->add("v_m", velocity, zero);
  source->change().fields[1].components = {"v0", "v1", "w"};
  EXPECT_EQ(names_of(derive(std::move(source))->info()),
            (Names{"v_horizontal_speed", "v_vertical_vorticity", "v_divergence", "v_m_speed",
                   "v_m_vorticity", "v_m_divergence", "v_m_q_criterion", "v_m_helicity"}));
}

TEST(DerivedFields, ReadNothingUntilOneIsReadAndThenOnlyItsInputs) {
  auto source = std::make_unique<FormulaSource>(box());
  source->add("v", velocity, zero);
  source->add("w", velocity, zero);
  FormulaSource& own = *source;
  const auto derived = derive(std::move(source));
  EXPECT_EQ(own.reads, 0);
  volume_of(*derived, "v_vorticity");
  EXPECT_EQ(own.reads, 1);
}

TEST(DerivedFields, StateWhatReadingThemDecodesAndHolds) {
  auto source = std::make_unique<FormulaSource>(box());
  source->add("v", velocity, zero);
  source->change().fields[0].decoded_bytes = 5000;
  source->change().fields[0].chunk_bytes = 10;
  const auto derived = derive(std::move(source));
  const FieldInfo& speed = *derived->info().find("v_speed");
  EXPECT_EQ(speed.decoded_bytes, 5000U);
  EXPECT_EQ(speed.chunk_bytes, 27U * 3 * 4);
  EXPECT_NE(speed.long_name.find("speed of v"), std::string::npos);
}

}  // namespace
}  // namespace windsplat::data::derived_test
