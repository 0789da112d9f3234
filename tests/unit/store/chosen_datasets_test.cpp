// Which of the datasets that were opened by choosing entries are closed, and when.
#include "server/data/resident/chosen_datasets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

namespace windsplat::data {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const ChosenDatasets::Clock::time_point begin{};

// The second of two datasets named e.nc.
TEST(ChosenEntries, OtherEntriesAreOneDatasetHoweverTheyAreWrittenAndKeepItsId) {
  DatasetInfo info;
  info.id = "e-2";
  info.choices = {{"number", 4, {"0", "1.5", "3", "7"}, "0"}};
  Location location;
  location.stem = "e";
  for (const char* text : {"3", "3.0", "03", "3e0"}) {
    const auto chosen = choose_entries(info, location, {{"number", text}});
    ASSERT_TRUE(chosen) << text;
    EXPECT_EQ(chosen->shown.at("number"), "3") << text;
    EXPECT_EQ(chosen->location.wanted_id(), "e-2,number=3") << text;
  }
  info.id = "e-2,number=3";
  info.choices[0].chosen = "3";
  location.selection = {{"number", "3"}};
  const auto chosen = choose_entries(info, location, {{"number", "7"}});
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->location.wanted_id(), "e-2,number=7");
  EXPECT_EQ(choose_entries(info, location, {{"number", "3.5"}})->shown.at("number"), "3.5");
}

TEST(ChosenDatasets, OnesThatAreNotUsedAreClosedAfterFiveMinutes) {
  ChosenDatasets chosen;
  chosen.add("a", begin);
  chosen.add("b", begin);
  chosen.touch("b", begin + minutes(1));
  EXPECT_THAT(chosen.take_unused(begin + minutes(5) - seconds(1)), IsEmpty());
  EXPECT_THAT(chosen.take_unused(begin + minutes(5)), ElementsAre("a"));
  EXPECT_TRUE(chosen.was_closed("a"));
  EXPECT_FALSE(chosen.was_closed("b"));
  EXPECT_THAT(chosen.take_unused(begin + minutes(6)), ElementsAre("b"));
  EXPECT_THAT(chosen.take_unused(begin + minutes(60)), IsEmpty());
  chosen.add("a", begin);
  EXPECT_FALSE(chosen.was_closed("a")) << "it is open again";
}

TEST(ChosenDatasets, OneInUseIsKeptAndTheTimeBeginsWithItsLastUse) {
  ChosenDatasets chosen;
  chosen.add("a", begin);
  auto use = chosen.use("a");
  ASSERT_NE(use, nullptr);
  EXPECT_THAT(chosen.take_unused(begin + minutes(30)), IsEmpty());
  use.reset();
  EXPECT_THAT(chosen.take_unused(begin + minutes(34)), IsEmpty());
  EXPECT_THAT(chosen.take_unused(begin + minutes(35)), ElementsAre("a"));
}

TEST(ChosenDatasets, OnesThatAreNamedRemain) {
  ChosenDatasets chosen;
  chosen.add("a", begin);
  chosen.remove("a");
  EXPECT_EQ(chosen.use("a"), nullptr);
  EXPECT_THAT(chosen.take_unused(begin + minutes(30)), IsEmpty());
}

TEST(ChosenDatasets, BeyondTheLimitTheOneThatWasUnusedLongestMakesRoom) {
  ChosenDatasets chosen;
  std::vector<ChosenDatasets::Use> uses;
  for (std::size_t n = 0; n < ChosenDatasets::count_max; ++n) {
    const auto room = chosen.make_room();
    ASSERT_TRUE(room);
    EXPECT_FALSE(room->has_value());
    chosen.add(std::to_string(n), begin + seconds(n));
    uses.push_back(chosen.use(std::to_string(n)));
  }
  const auto refused = chosen.make_room();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::busy);
  EXPECT_THAT(refused.error().message, HasSubstr("16 other entries"));
  uses[7].reset();
  uses[3].reset();
  EXPECT_TRUE(chosen.check_room());
  EXPECT_FALSE(chosen.was_closed("3")) << "looking for room closes nothing";
  EXPECT_EQ(chosen.make_room()->value(), "3");
  EXPECT_TRUE(chosen.was_closed("3"));
  EXPECT_FALSE(chosen.make_room()->has_value());
}

}  // namespace
}  // namespace windsplat::data
