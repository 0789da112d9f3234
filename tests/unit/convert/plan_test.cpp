// Bricks, regions, units and their order, from the dimensions of a grid alone.
#include "server/convert/plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "server/convert/finish.hpp"
#include "server/convert/memory.hpp"
#include "server/convert/open_bricks.hpp"
#include "tests/unit/convert/made_source.hpp"

namespace windsplat::convert {
namespace {

using test::made_info;

std::vector<data::Coarsening> chain_of(const Three& dims, const std::vector<Three>& halvings) {
  std::vector<data::Coarsening> out;
  for (const Three& h : halvings) {
    data::Coarsening how;
    how.halvings = h;
    for (std::size_t a = 0; a < 3; ++a) {
      if (h[a] > 0) how.widths.at(a).assign(static_cast<std::size_t>(dims[a]), 2.0);
    }
    out.push_back(std::move(how));
  }
  return out;
}

Options options_of() {
  Options options;
  options.memory_bytes = std::uint64_t{1} << 30;
  options.memory_text = [](std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; };
  return options;
}

Plan plan_of(const Three& dims, const std::vector<Three>& halvings, const Options& options,
             std::size_t steps = 1) {
  return make_plan(made_info(dims, steps), chain_of(dims, halvings), options).value();
}

const std::vector<Three> cubes{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}};

TEST(ConvertPlan, LongAxesAreDividedAndShortOnesAreWhole) {
  EXPECT_EQ(plan_of({1000, 900, 800}, cubes, options_of()).levels[0].brick, (Three{64, 64, 64}));
  EXPECT_EQ(plan_of({1000, 128, 129}, cubes, options_of()).levels[0].brick, (Three{64, 128, 64}));
  // As many samples as in a small brick of three long axes, x enlarged first.
  EXPECT_EQ(plan_of({1000, 900, 10}, cubes, options_of()).levels[0].brick, (Three{128, 64, 10}));
  EXPECT_EQ(plan_of({5000, 4000, 1}, cubes, options_of()).levels[0].brick, (Three{512, 256, 1}));
}

TEST(ConvertPlan, ShardsOfLevelsUpToThreeCoverTheUnit) {
  const Plan plan = plan_of({1536, 1536, 1024}, cubes, options_of());
  EXPECT_EQ(plan.unit, (Three{512, 512, 512}));
  EXPECT_EQ(plan.units_along, (Three{3, 3, 2}));
  EXPECT_EQ(plan.pencil, (Three{512, 64, 64}));
  for (std::size_t n = 0; n < 4; ++n) {
    const int length = 512 >> n;
    EXPECT_EQ(plan.levels[n].region, (Three{length, length, length}));
    EXPECT_TRUE(plan.levels[n].by_unit);
  }
  EXPECT_FALSE(plan.levels[4].by_unit);
  EXPECT_EQ(plan.levels[4].region, (Three{64, 64, 64}));
}

TEST(ConvertPlan, AllLevelsAreOfTheUnitIfThereIsOne) {
  const Plan plan = plan_of({300, 200, 100}, cubes, options_of());
  EXPECT_EQ(plan.units_along, (Three{1, 1, 1}));
  EXPECT_TRUE(std::ranges::all_of(plan.levels, &Level::by_unit));
  EXPECT_EQ(plan.levels[4].brick, (Three{19, 13, 7}));
}

TEST(ConvertPlan, ArraysHaveTheShapesOfTheirLevels) {
  const Plan plan = plan_of({1000, 900, 100}, {{0, 0, 0}, {1, 1, 0}}, options_of(), 3);
  std::map<std::string, const data::zarr::WrittenArray*> arrays;
  for (const auto& array : plan.arrays) arrays[array.path] = &array;
  using Shape = std::vector<std::size_t>;
  ASSERT_TRUE(arrays.contains("0/q"));
  EXPECT_EQ(arrays["0/q"]->shape, (Shape{3, 100, 900, 1000}));
  EXPECT_EQ(arrays["0/q"]->chunk, (Shape{1, 100, 64, 64}));
  EXPECT_EQ(arrays["0/q"]->shard, (Shape{1, 100, 512, 512}));
  EXPECT_EQ(arrays["1/q_low_share"]->shape, (Shape{3, 100, 450, 500}));
  EXPECT_EQ(arrays["1/q_low_share"]->shard, (Shape{1, 100, 256, 256}));
  EXPECT_EQ(arrays["1/wind_magnitude"]->shape, (Shape{3, 100, 450, 500}));
  // Of kernels of stride 2 along all axes, also along z, which is not halved.
  EXPECT_EQ(arrays["1/u_strided"]->shape, (Shape{3, 50, 450, 500}));
  EXPECT_EQ(arrays["1/u_strided"]->shard, (Shape{1, 50, 256, 256}));
  using Names = std::vector<std::string>;
  EXPECT_EQ(arrays["1/u_strided"]->dimensions, (Names{"time", "z_strided", "y", "x"}));
  EXPECT_EQ(arrays["1/u"]->dimensions, (Names{"time", "z", "y", "x"}));
  EXPECT_EQ(arrays["statistics/0/wind_histogram"]->shape, (Shape{3, 1, 15, 16, 32}));
}

TEST(ConvertPlan, EvenWidthsAreNotStored) {
  const Three dims{300, 200, 100};
  auto chain = chain_of(dims, {{0, 0, 0}, {1, 1, 1}});
  chain[1].widths[1][7] = 3;
  const Plan plan = make_plan(made_info(dims), chain, options_of()).value();
  EXPECT_TRUE(plan.widths[0].empty());
  EXPECT_EQ(plan.widths[1], chain[1].widths[1]);
}

TEST(ConvertPlan, MortonOrderVisitsEveryPencilOnceAndSquaresTogether) {
  EXPECT_EQ(morton(0, 0), 0U);
  EXPECT_EQ(morton(1, 0), 1U);
  EXPECT_EQ(morton(0, 1), 2U);
  EXPECT_EQ(morton(5, 3), 0b011011U);
  const Plan plan = plan_of({512, 500, 300}, cubes, options_of());
  const data::Box unit = plan.box_of({0, 0, {0, 0, 0}});
  std::vector<Three> alone;
  for (const Reading& reading : readings(plan, unit, {0, 0})) {
    ASSERT_EQ(reading.pencils.size(), 1U);
    EXPECT_EQ(reading.box, reading.pencils[0]);
    alone.push_back(reading.box.first);
  }
  EXPECT_EQ(std::set(alone.begin(), alone.end()).size(), 8U * 5U);
  std::vector<Three> together;
  std::size_t samples = 0;
  for (const Reading& reading : readings(plan, unit, {2, 1})) {
    samples += reading.box.samples();
    for (const data::Box& pencil : reading.pencils) together.push_back(pencil.first);
  }
  EXPECT_EQ(together, alone);  // the order does not depend on what is read at once
  EXPECT_EQ(samples, unit.samples());
}

TEST(ConvertPlan, UnitsOfAFieldAtAStepAreTogether) {
  const Plan plan = plan_of({1000, 900, 600}, cubes, options_of(), 2);
  ASSERT_EQ(plan.units.size(), 2U * 2U * 8U);
  std::set<std::tuple<std::size_t, std::size_t, Three>> all;
  std::size_t samples = 0;
  for (const Unit& unit : plan.units) {
    all.insert({unit.step, unit.field, unit.place});
    samples += plan.box_of(unit).samples();
  }
  EXPECT_EQ(all.size(), plan.units.size());
  EXPECT_EQ(samples, 4U * 1000U * 900U * 600U);
  EXPECT_EQ(plan.units[8].step, 0U);
  EXPECT_EQ(plan.units[8].field, 1U);
  EXPECT_EQ(plan.units[16].step, 1U);
}

TEST(ConvertPlan, WhatDoesNotExistOrCollidesIsRefused) {
  const Three dims{20, 20, 20};
  const auto refusal = [&](const data::DatasetInfo& info, const Options& options) {
    const auto plan = make_plan(info, chain_of(dims, {{0, 0, 0}}), options);
    return plan ? std::string("accepted") : plan.error().message;
  };
  Options options = options_of();
  options.fields = {"r"};
  EXPECT_NE(refusal(made_info(dims), options).find("no field 'r'"), std::string::npos);
  options = options_of();
  options.steps = {0, 4};
  EXPECT_NE(refusal(made_info(dims), options).find("no step 4"), std::string::npos);
  options = options_of();
  options.compression = "zstd:22";
  EXPECT_NE(refusal(made_info(dims), options).find("'zstd:22' is not"), std::string::npos);
  auto info = made_info(dims);
  info.fields[0].components = {"x"};  // as the axis
  EXPECT_NE(refusal(info, options_of()).find("'0/x'"), std::string::npos);
}

TEST(ConvertPlan, WhatTheReaderWouldNotOpenIsRefused) {
  const Three dims{20, 20, 20};
  auto info = made_info(dims);
  data::FieldInfo field = info.fields[0];
  field.long_name = std::string(400'000, 'q');
  const auto plan_of_fields = [&](int count) {
    info.fields.clear();
    for (int n = 0; n < count; ++n) {
      info.fields.push_back(field);
      info.fields.back().name = info.fields.back().components[0] = "q" + std::to_string(n);
    }
    return make_plan(info, chain_of(dims, {{0, 0, 0}}), options_of()).value();
  };
  EXPECT_TRUE(check_metadata(info, plan_of_fields(10)));
  const auto large = check_metadata(info, plan_of_fields(30));
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().kind, ErrorKind::invalid);
  EXPECT_NE(large.error().message.find("KiB are read; choose fewer fields by --field"),
            std::string::npos)
      << large.error().message;
  field.long_name.clear();
  const auto many = check_metadata(info, plan_of_fields(3000));
  ASSERT_FALSE(many);
  EXPECT_NE(many.error().message.find("at most 8192 are read"), std::string::npos)
      << many.error().message;
}

TEST(ConvertPlan, AnAxisWithTheNameOfTheStepsIsRefused) {
  auto info = made_info({20, 20, 20});
  info.grid.axes[0].name = "time";
  const auto plan = make_plan(info, chain_of({20, 20, 20}, {{0, 0, 0}}), options_of());
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("'0/time'"), std::string::npos) << plan.error().message;
}

TEST(ConvertMemory, TheLimitDecidesOnTheNumberOfWorkers) {
  const Plan plan = plan_of({1536, 1536, 1024}, cubes, options_of());
  const auto info = made_info({1536, 1536, 1024});
  Options options = options_of();
  options.threads = 16;
  const auto wide = share_memory(info, plan, options);
  ASSERT_TRUE(wide);
  EXPECT_GT(wide->workers, 2U);
  EXPECT_LT(wide->workers, 9U);
  options.memory_bytes = std::uint64_t{128} << 20;
  const auto none = share_memory(info, plan, options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::out_of_memory);
  EXPECT_NE(none.error().message.find("MiB would suffice"), std::string::npos);
  const std::string& text = none.error().message;
  const std::string after = text.substr(text.find("worker; ") + 8);
  options.memory_bytes = std::stoull(after) << 20;
  const auto one = share_memory(info, plan, options);
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->workers, 1U);
  options.memory_bytes -= std::uint64_t{1} << 20;
  EXPECT_FALSE(share_memory(info, plan, options));
}

TEST(ConvertMemory, LayersAsChunksAreReadInLargerBoxesWhereMemoryAllows) {
  const Three dims{1000, 1000, 600};
  auto info = made_info(dims);
  for (data::FieldInfo& field : info.fields) {
    field.box_chunk = {1000, 1000, 1};
    field.chunk_bytes = 4'000'000;
  }
  Options options = options_of();
  options.memory_bytes = std::uint64_t{400} << 20;
  const Plan plan = make_plan(info, chain_of(dims, cubes), options).value();
  const auto narrow = share_memory(info, plan, options);
  ASSERT_TRUE(narrow) << narrow.error().message;
  options.memory_bytes = std::uint64_t{16} << 30;
  const auto wide = share_memory(info, plan, options);
  ASSERT_TRUE(wide);
  EXPECT_GT(narrow->decoded, 8);
  EXPECT_NEAR(wide->decoded, 4, 0.1);  // by the four units beside each other
}

}  // namespace
}  // namespace windsplat::convert
