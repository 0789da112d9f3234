// Stores with levels: what is read is what coarsen() makes of level 0, and attributes and arrays
// that do not fit together are refused.
#include <gmock/gmock.h>

#include <algorithm>

#include "server/data/model/middles.hpp"
#include "server/data/model/stored.hpp"
#include "tests/unit/data/formats/level_store.hpp"

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::size_t index_of(const DatasetInfo& info, const std::string& name) {
  const FieldInfo* const field = info.find(name);
  EXPECT_NE(field, nullptr) << name;
  return field == nullptr ? 0 : static_cast<std::size_t>(field - info.fields.data());
}

void expect_equal(const Volume& found, const Volume& wanted, const std::string& what) {
  ASSERT_EQ(found.dims, wanted.dims) << what;
  ASSERT_EQ(found.components, wanted.components) << what;
  EXPECT_EQ(found.range, wanted.range) << what;
  EXPECT_EQ(found.masked, wanted.masked) << what;
  for (std::size_t n = 0; n < wanted.values.size(); ++n) {
    const float a = found.values[n];
    const float b = wanted.values[n];
    ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << what << ' ' << n;
  }
}

TEST(ZarrLevels, AreThoseThatAreComputedFromLevelZero) {
  const LevelStore store;
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  ASSERT_NE(info.stored, nullptr);
  EXPECT_EQ(info.stored->levels, LevelStore::levels());
  for (const std::string name : {"cloud", "wind"}) {
    const std::size_t field = index_of(info, name);
    const bool drawn = name == "wind";
    for (std::size_t step = 0; step < LevelStore::steps; ++step) {
      const Volume fine = volume_of(store.plain(), name, step);
      ASSERT_GT(fine.masked, 0);
      const StoredRange* const range = stored_range(info, field, step);
      ASSERT_NE(range, nullptr);
      EXPECT_EQ(range->range, fine.range);
      EXPECT_EQ(range->masked, fine.masked);
      for (std::size_t level = 1; level < LevelStore::levels().size(); ++level) {
        const std::string what = name + " at level " + std::to_string(level);
        const Coarsening how = LevelStore::how(level, drawn);
        const auto part = stored_level(info, field, how);
        ASSERT_TRUE(part) << what;
        const auto found = source->read_part(field, step, *part);
        ASSERT_TRUE(found) << found.error().message;
        expect_equal(*found, coarsen(fine, how), what);
      }
    }
  }
}

TEST(ZarrLevels, BoxesOfLevelsAreCutOutOfThem) {
  const LevelStore store;
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  const std::size_t field = index_of(source->info(), "wind");
  const Box box{{2, 1, 3}, {7, 4, 2}};
  const auto found = source->read_part(field, 1, {box, 1, StoredAs::drawn});
  ASSERT_TRUE(found) << found.error().message;
  const Volume fine = volume_of(store.plain(), "wind", 1);
  expect_equal(*found, cut(coarsen(fine, LevelStore::how(1, true)), box), "a box");
  for (const StoredPart& beyond : {StoredPart{{{5, 0, 0}, {7, 1, 1}}, 1, StoredAs::drawn},
                                   StoredPart{{{0, 0, 0}, {1, 1, 1}}, 4, StoredAs::drawn},
                                   StoredPart{{{0, 0, 0}, {1, 1, 1}}, 3, StoredAs::strided},
                                   StoredPart{{{0, 0, 0}, {1, 1, 1}}, 1, StoredAs::two_values},
                                   StoredPart{{{0, 0, 0}, {1, 1, 1}}, 0, StoredAs::drawn}}) {
    const auto refused = source->read_part(field, 0, beyond);
    ASSERT_FALSE(refused) << key_of(beyond.box) << " of level " << beyond.level;
    EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  }
}

TEST(ZarrLevels, StridedDrawsComeFromMiddlesOfKernels) {
  const LevelStore store;
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  const std::size_t field = index_of(source->info(), "wind");
  const Volume fine = volume_of(store.plain(), "wind");
  for (const int stride : {2, 4}) {
    const auto part = stored_middles(source->info(), field, stride);
    ASSERT_TRUE(part) << stride;
    const auto middles = source->read_part(field, 0, *part);
    ASSERT_TRUE(middles) << middles.error().message;
    for (std::size_t level = 1; level < LevelStore::levels().size(); ++level) {
      const Coarsening how = LevelStore::how(level, true, stride);
      expect_equal(draw(*middles, how, fine.dims), coarsen(fine, how),
                   "stride " + std::to_string(stride) + " at level " + std::to_string(level));
    }
  }
  EXPECT_FALSE(stored_middles(source->info(), field, 3));
  EXPECT_FALSE(stored_middles(source->info(), field, 8));
}

TEST(ZarrLevels, OfOtherWeightsAreNotTaken) {
  const LevelStore store;
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  Coarsening how = LevelStore::how(1, false);
  for (double& width : how.widths[2]) width *= 1e-4;  // in another unit
  EXPECT_TRUE(stored_level(info, index_of(info, "cloud"), how));
  how.widths[2][3] *= 1.01;
  EXPECT_FALSE(stored_level(info, index_of(info, "cloud"), how));
  how = LevelStore::how(1, false);
  how.widths[0][0] *= 2;
  EXPECT_FALSE(stored_level(info, index_of(info, "cloud"), how)) << "x is even in the store";
  how = LevelStore::how(1, true);
  how.widths[2][3] *= 1.01;
  EXPECT_TRUE(stored_level(info, index_of(info, "wind"), how)) << "draws have no weights";
  how.halvings = {1, 1, 0};
  EXPECT_FALSE(stored_level(info, index_of(info, "wind"), how));
  how = LevelStore::how(3, true, 2);
  EXPECT_FALSE(stored_level(info, index_of(info, "wind"), how));
}

TEST(ZarrLevels, GroupsThatAreKernelsHaveTheirMiddles) {
  const LevelStore store;
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  const std::size_t field = index_of(info, "wind");
  const Volume fine = volume_of(store.plain(), "wind", 1);
  for (const int stride : {2, 4}) {  // no level halves all axes twice
    const Coarsening how = middles_of(stride);
    const auto part = stored_level(info, field, how);
    ASSERT_TRUE(part) << stride;
    EXPECT_EQ(part->as, StoredAs::strided);
    const auto found = source->read_part(field, 1, *part);
    ASSERT_TRUE(found) << found.error().message;
    expect_equal(*found, coarsen(fine, how), std::to_string(stride));
    for (int n = 0; n < found->dims[0]; ++n) {
      const int x = strided_sample(n, stride, fine.dims[0]);
      const int y = strided_sample(0, stride, fine.dims[1]) * fine.dims[0];
      const int z = strided_sample(0, stride, fine.dims[2]) * fine.dims[0] * fine.dims[1];
      EXPECT_EQ(found->component(1)[n], fine.component(1)[x + y + z]) << n;
    }
  }
  EXPECT_FALSE(stored_level(info, field, middles_of(8)));
  EXPECT_FALSE(stored_level(info, index_of(info, "cloud"), middles_of(2)));
}

TEST(ZarrLevels, OnlyTheFieldsOfLevelZeroAreShown) {
  const LevelStore store;
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  std::vector<std::string> names;
  for (const FieldInfo& field : source->info().fields) {
    if (!field.derived) names.push_back(field.name);
  }
  std::sort(names.begin(), names.end());
  EXPECT_THAT(names, ElementsAre("cloud", "u", "v", "w", "wind"));
  EXPECT_TRUE(source->info().left_out.empty()) << source->info().left_out.front().name;
  EXPECT_FALSE(has_note(source->info(), "multiscales"));
  EXPECT_TRUE(
      has_note(source->info(), "coarser levels are stored (3), the last of 3 x 4 x 3 samples"));
  expect_equal(volume_of(*source, "wind", 1), volume_of(store.plain(), "wind", 1), "level 0");
}

TEST(ZarrLevels, AttributesThatDoNotFitAreRefused) {
  const LevelStore store;
  struct Change {
    const char* from;
    const char* to;
    const char* message;
  };
  for (const auto& [from, to, message] : std::vector<Change>{
           {R"("store":1)", R"("store":2)",
            "'windsplat': version 2 needs windsplat 9.9.9 or later; this is"},
           {R"("store":1)", R"("store":"1")", "/store is not a version"},
           {R"([2,2,1])", R"([2,2,8])", "/levels/2/halvings/2 is not an integer from 0 to 7"},
           {R"([2,2,1])", R"([2,2])", "/levels/2/halvings is not a list of three"},
           {R"([2,2,1])", R"([2,0,1])", "the halvings of level 2 do not ascend"},
           {R"([0,0,0])", R"([0,0,1])", "the first has halvings"},
           {R"([3,2,2])", R"([3,3,2])",
            "'3/u': has the shape (2, 3, 4, 3), its level (2, 3, 2, 3)"},
           {R"([2,2,1])", R"([2,2,1],"storedBytes":-1)", "/levels/2/storedBytes is not a number"},
           {R"([2,2,1])", R"([2,2,1],"storedBytes":"7")", "/levels/2/storedBytes is not a number"},
           {R"("path":"3")", R"("path":"../3")", "/levels/3/path is not the path of a group"},
           {R"("path":"3")", R"("path":"4")", "'4/u': the array is missing"},
           {R"("strided":2)", R"("strided":3)", "'3/u_strided': the array is missing"},
           {R"("strided":2)", R"("strided":5)", "/fields/0/strided is not an integer from 0 to 4"},
           {R"("strided":2)", R"("strided":4)", "/fields/0/strided is beyond the last level"},
           {R"(["u","v","w"])", R"(["u","v"])", "level 0 has no field of 'u'"},
           {R"(["u","v","w"])", R"(["u","v","a/w"])", "/fields/0/components has what is not"},
           {R"("two_values")", R"("drawn")", "/fields/1/levels is not \"two_values\""},
           {R"("0/lev_widths")", R"("0/lat")", "'0/lat': has the shape (13), its level (9)"},
           {R"("0/lev_widths")", R"(7)", "/widths/z is not the path of an array"},
           {R"("statistics":"statistics")", R"("statistics":null)",
            "'cloud': its ranges are not stored"},
           {R"("statistics":"statistics")", R"("statistics":"s")",
            "'s/wind_range': the array is missing"}}) {
    store.write_root(replaced(LevelStore::attribute(), from, to));
    EXPECT_THAT(refusal(store.path()), HasSubstr(message)) << from << " -> " << to;
  }
}

TEST(ZarrLevels, OfAFieldThatIsNamedTwiceAreRefused) {
  const LevelStore store;
  const std::string wind = R"({"name":"wind","components":["u","v","w"],"levels":"drawn"},)";
  const std::string twice =
      replaced(LevelStore::attribute(), R"({"name":"wind")", wind + R"({"name":"wind")");
  // Without ranges, which would be too many.
  const std::string cloud = R"({"name":"cloud","components":["cloud"],"levels":"two_values"})";
  const std::string bare = replaced(
      replaced(twice, R"("statistics":"statistics")", R"("statistics":null)"), "," + cloud, "");
  for (const std::string& attribute : {twice, bare}) {
    store.write_root(attribute);
    EXPECT_THAT(refusal(store.path()),
                HasSubstr("the attribute 'windsplat': /fields has 'wind' twice"));
  }
}

// The other levels are neither turned nor converted.
TEST(ZarrLevels, OfALevelZeroThatIsNotReadAsItIsStoredAreRefused) {
  const LevelStore store;
  std::vector<double> lat(LevelStore::sides[1]);
  for (std::size_t n = 0; n < lat.size(); ++n) lat[n] = 46 - 0.5 * static_cast<double>(n);
  store.write_array("0/lat", {lat.size()}, "float64", bytes_of_items(lat), {"lat"},
                    R"({"units":"degrees_north"})");
  EXPECT_THAT(refusal(store.path()), HasSubstr("'0/lat': its order is not that of a dataset"));
  const std::vector<std::size_t> shape{2, 9, 13, 21};
  const LevelStore packed;
  packed.write_array("0/cloud", shape, "float32", "", {"time", "lev", "lat", "lon"},
                     R"({"units":"kg kg-1","scale_factor":2})");
  EXPECT_THAT(refusal(packed.path()),
              HasSubstr("'0/cloud': has the attribute scale_factor, its levels have not"));
  const LevelStore turned;
  turned.write_array("0/v", {2, 9, 21, 13}, "float32", "", {"time", "lev", "lon", "lat"},
                     R"({"units":"m s-1","windsplat_vector":"wind 1"})");
  EXPECT_THAT(refusal(turned.path()), HasSubstr("'0/v': its dimensions are not those of levels"));
}

TEST(ZarrLevels, BytesOfFilesAreKnownIfAllLevelsHaveThem) {
  const LevelStore store;
  std::string attribute =
      replaced(LevelStore::attribute(), "[2,2,1]", R"([2,2,1],"storedBytes":7)");
  store.write_root(attribute);
  auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->info().stored->bytes.empty());
  for (const char* const level : {"[0,0,0]", "[1,1,1]", "[3,2,2]"}) {
    attribute = replaced(attribute, level, std::string(level) + R"(,"storedBytes":9)");
  }
  store.write_root(attribute);
  source = opened(store.path());
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().stored->bytes, ElementsAre(9, 9, 7, 9));
}

TEST(ZarrLevels, ArraysOfOtherShapesAndTypesAreRefused) {
  const LevelStore store;
  const std::vector<std::string> names{"time", "lev", "lat", "lon"};
  store.write_array("1/cloud_low", {2, 5, 7, 10}, "float32", "", names);
  EXPECT_THAT(refusal(store.path()),
              HasSubstr("'1/cloud_low': has the shape (2, 5, 7, 10), its level (2, 5, 7, 11)"));
  store.write_array("1/cloud_low", {1, 5, 7, 11}, "float32", "", names);
  EXPECT_THAT(refusal(store.path()), HasSubstr("its level (2, 5, 7, 11)"));
  store.write_array("1/cloud_low", {2, 5, 7, 11}, "float64", "", names);
  EXPECT_THAT(refusal(store.path()), HasSubstr("does not have the type of what it stores"));
  const LevelStore other;
  other.write_array("statistics/cloud_masked", {2}, "uint32",
                    bytes_of_items<std::uint32_t>({1, 1U << 20}), {"time"}, "{}", "0");
  EXPECT_THAT(refusal(other.path()), HasSubstr("counts more samples than there are"));
  const LevelStore third;
  third.write_array("statistics/cloud_range", {2, 2}, "float32",
                    bytes_of_items<float>({0, 1, 2, -1}), {"time", "end"});
  EXPECT_THAT(refusal(third.path()), HasSubstr("'cloud': a range is not one of numbers"));
  const LevelStore fourth;
  fourth.write_array("0/lev_widths", {9}, "float64",
                     bytes_of_items<double>({1, 2, 3, 0, 1, 1, 1, 1, 1}), {"lev"});
  EXPECT_THAT(refusal(fourth.path()), HasSubstr("are not positive numbers"));
}

TEST(ZarrLevels, SharesBeyondOneAreNotRead) {
  const LevelStore store;
  const std::vector<std::string> names{"time", "lev", "lat", "lon"};
  std::vector<float> shares(std::size_t{2} * 5 * 7 * 11, 0.5F);
  shares[5 * 7 * 11 + 3] = 1.5F;  // of the second step
  store.write_array("1/cloud_high_share", {2, 5, 7, 11}, "float32", bytes_of_items(shares), names);
  const auto source = opened(store.path());
  ASSERT_NE(source, nullptr);
  const std::size_t field = index_of(source->info(), "cloud");
  const StoredPart part{whole_box({11, 7, 5}), 1, StoredAs::two_values};
  const auto refused = source->read_part(field, 1, part);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(refused.error().message,
              HasSubstr("'1/cloud_high_share': has a share that is not between 0 and 1"));
  EXPECT_TRUE(source->read_part(field, 0, part));
}

TEST(ZarrLevels, AChosenEntryHasNoLevels) {
  const LevelStore store;
  auto source = open_file(store.path() + "?field=cloud");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().stored, nullptr);
}

}  // namespace
}  // namespace windsplat::data::test
