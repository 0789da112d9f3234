// Descriptions with stored levels, as the daemon takes them from a loader.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "server/data/loader/messages.hpp"

namespace windsplat::data::loader {
namespace {

// A vector that is not read by boxes, and a scalar with a level, on 3 x 2 x 4 samples.
DatasetInfo with_levels() {
  DatasetInfo info;
  info.grid.axes[0].coordinates = {0, 1, 2};
  info.grid.axes[1].coordinates = {0, 1};
  info.grid.axes[2].coordinates = {0, 1, 3, 6};
  info.fields.resize(2);
  info.fields[0].name = "wind";
  info.fields[0].kind = FieldKind::vector;
  info.fields[0].components = {"u", "v"};
  info.fields[0].component_units = {"m/s", "m/s"};
  info.fields[1].name = "heat";
  info.fields[1].components = {"heat"};
  info.fields[1].component_units = {"K"};
  info.fields[1].box_chunk = {3, 1, 2};
  info.steps.resize(2);
  StoredLevels stored;
  stored.levels = {{0, 0, 0}, {1, 1, 1}};
  stored.widths[2] = {1, 2, 3, 4};
  stored.bytes = {96, 24};
  stored.fields.resize(2);
  stored.fields[1].has_levels = true;
  stored.fields[1].ranges = {{{1, 2}, 3}, {{0, 0}, 24}};
  info.stored = std::make_shared<const StoredLevels>(stored);
  return info;
}

TEST(LoaderMessages, LevelsThatNoStoreHasAreRefused) {
  const std::vector<std::pair<const char*, void (*)(StoredLevels&)>> lies{
      {"no level", [](StoredLevels& s) { s.levels.clear(); }},
      {"halvings of level 0", [](StoredLevels& s) { s.levels[0][1] = 1; }},
      {"a level again",
       [](StoredLevels& s) {
         s.levels.push_back({1, 1, 1});
       }},
      {"fewer halvings",
       [](StoredLevels& s) {
         s.levels.push_back({2, 2, 0});
       }},
      {"too many halvings",
       [](StoredLevels& s) {
         s.levels.push_back({8, 1, 1});
       }},
      {"negative halvings", [](StoredLevels& s) { s.levels[1][0] = -1; }},
      {"too many levels",
       [](StoredLevels& s) {
         s.levels.resize(stored_levels_max + 1, {1, 1, 1});
       }},
      {"widths of another number", [](StoredLevels& s) { s.widths[2].pop_back(); }},
      {"a width of 0", [](StoredLevels& s) { s.widths[2][1] = 0; }},
      {"a width that is not a number", [](StoredLevels& s) { s.widths[2][1] = NAN; }},
      {"an infinite width", [](StoredLevels& s) { s.widths[2][1] = INFINITY; }},
      {"bytes of one level of two", [](StoredLevels& s) { s.bytes = {7}; }},
      {"more fields than there are", [](StoredLevels& s) { s.fields.resize(3); }},
      {"levels of a field that is not read by boxes",
       [](StoredLevels& s) { s.fields[0].has_levels = true; }},
      {"middles of a scalar", [](StoredLevels& s) { s.fields[1].strided = 1; }},
      {"a negative number of middles", [](StoredLevels& s) { s.fields[0].strided = -1; }},
      {"two values without a range", [](StoredLevels& s) { s.fields[1].ranges.clear(); }},
      {"ranges of one step only", [](StoredLevels& s) { s.fields[1].ranges.pop_back(); }},
      {"a range that descends", [](StoredLevels& s) { s.fields[1].ranges[0].range[1] = 0; }},
      {"a range without an end", [](StoredLevels& s) { s.fields[1].ranges[0].range[0] = NAN; }},
      {"more masked samples than samples",
       [](StoredLevels& s) { s.fields[1].ranges[1].masked = 25; }},
      {"fewer than no masked samples", [](StoredLevels& s) { s.fields[1].ranges[1].masked = -1; }},
  };
  const auto sound = decode_info(encode_info(with_levels()));
  ASSERT_TRUE(sound);
  EXPECT_EQ(sound->stored->bytes, (std::vector<std::uint64_t>{96, 24}));
  for (const auto& [what, lie] : lies) {
    DatasetInfo info = with_levels();
    StoredLevels stored = *info.stored;
    lie(stored);
    info.stored = std::make_shared<const StoredLevels>(stored);
    EXPECT_FALSE(decode_info(encode_info(info))) << what;
  }
}

}  // namespace
}  // namespace windsplat::data::loader
