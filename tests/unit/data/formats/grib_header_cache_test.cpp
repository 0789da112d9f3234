// Headers of messages that differ in their times only agree with those that ecCodes decodes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#ifdef WINDSPLAT_GRIB
#include "server/data/formats/grib/fields.hpp"
#include "server/data/formats/grib/header_cache.hpp"
#include "tests/unit/data/formats/grib_maker.hpp"

namespace windsplat::data::test {
namespace {

using Bytes = std::vector<unsigned char>;

struct Made {
  int edition = 2;
  std::string quantity = "t";
  long date = 20200101;
  long time = 0;
  std::string range = "0";
  std::string type = "instant";
  std::string level_type = "isobaricInhPa";
  long level = 500;
  long unit = 1;  // code table 4.4
};

Bytes made(const Made& wanted) {
  Maker maker(wanted.edition == 1 ? "regular_ll_pl_grib1" : "regular_ll_pl_grib2");
  maker.set("dataDate", wanted.date);
  maker.set("dataTime", wanted.time);
  maker.set("typeOfLevel", wanted.level_type);
  maker.set("level", wanted.level);
  maker.set("shortName", wanted.quantity);
  maker.set("indicatorOfUnitOfTimeRange", wanted.unit);
  maker.set("stepType", wanted.type);
  maker.set("stepRange", wanted.range);
  const std::string bytes = maker.bytes();
  return {bytes.begin(), bytes.end()};
}

std::size_t length_at(const Bytes& bytes, std::size_t at, std::size_t count) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes.at(at + i);
  return value;
}

// To the end of section 4 of edition 2, or of section 2 of edition 1.
Bytes head(int edition, const Bytes& message) {
  std::size_t end = edition == 1 ? 8 : 16;
  if (edition == 1) {
    end += length_at(message, end, 3);
    end += length_at(message, end, 3);
  } else {
    while (message.at(end + 4) != 5) end += length_at(message, end, 4);
  }
  return {message.begin(), message.begin() + static_cast<std::ptrdiff_t>(end)};
}

// The header of the other, if it follows from the first.
std::optional<grib::Header> follow(const Made& first, const Made& other) {
  grib::HeaderCache cache;
  const Bytes message = made(first);
  const auto header = grib::read_header(message);
  EXPECT_TRUE(header);
  EXPECT_FALSE(cache.find(first.edition, head(first.edition, message)));
  cache.remember(first.edition, head(first.edition, message), *header);
  return cache.find(other.edition, head(other.edition, made(other)));
}

void expect_same(const Made& first, const Made& other) {
  const auto found = follow(first, other);
  const auto truth = grib::read_header(made(other));
  ASSERT_TRUE(truth);
  ASSERT_TRUE(found) << other.date << ' ' << other.range;
  EXPECT_DOUBLE_EQ(found->hours, truth->hours);
  EXPECT_DOUBLE_EQ(found->reference, truth->reference);
  EXPECT_EQ(found->short_name, truth->short_name);
  EXPECT_EQ(found->level_type, truth->level_type);
  EXPECT_EQ(found->level, truth->level);
  EXPECT_EQ(found->product.key, truth->product.key);
  EXPECT_EQ(found->grid_key, truth->grid_key);
}

TEST(GribHeaderCache, HeadersFollowFromThoseOfOtherTimes) {
  for (const int edition : {1, 2}) {
    SCOPED_TRACE(edition);
    Made first;
    first.edition = edition;
    Made other = first;
    other.range = "9";
    expect_same(first, other);
    other.date = 19991231;
    other.time = 1830;
    expect_same(first, other);
    other.range = "240";
    expect_same(first, other);
  }
}

TEST(GribHeaderCache, AveragesOfOneLengthFollowAndOthersDoNot) {
  Made first;
  first.type = "avg";
  first.range = "0-6";
  Made other = first;
  other.date = 20200228;
  other.range = "18-24";
  expect_same(first, other);
  other.range = "18-21";
  EXPECT_FALSE(follow(first, other));
}

TEST(GribHeaderCache, HeadersFollowFromThoseOfOtherPressuresAndHybridLevels) {
  for (const int edition : {1, 2}) {
    for (const char* type : {"isobaricInhPa", "hybrid"}) {
      SCOPED_TRACE(type);
      Made first;
      first.edition = edition;
      first.level_type = type;
      Made other = first;
      other.level = 70;
      other.range = "9";
      expect_same(first, other);
    }
  }
}

TEST(GribHeaderCache, OtherQuantitiesLevelsAndTemplatesDoNotFollow) {
  for (const int edition : {1, 2}) {
    SCOPED_TRACE(edition);
    Made first;
    first.edition = edition;
    Made other = first;
    other.quantity = "u";
    EXPECT_FALSE(follow(first, other));
    Made ground = first;
    ground.level_type = "heightAboveGround";
    other = ground;
    other.level = 10;
    EXPECT_FALSE(follow(ground, other));
    other = first;
    other.type = "avg";
    other.range = "0-6";
    EXPECT_FALSE(follow(first, other));
    EXPECT_FALSE(follow(other, first));
  }
}

TEST(GribHeaderCache, MonthsAreLeftToTheLibrary) {
  Made first;
  first.unit = 3;
  EXPECT_FALSE(follow(first, first));
}

TEST(GribHeaderCache, ShortAndMalformedHeadsDoNotFollow) {
  const Bytes whole = head(2, made(Made{}));
  grib::HeaderCache cache;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(cache.find(1, cut));
    EXPECT_FALSE(cache.find(2, cut));
  }
  Bytes zero = whole;
  std::fill(zero.begin() + 16, zero.end(), 0);
  EXPECT_FALSE(cache.find(2, zero));
}

}  // namespace
}  // namespace windsplat::data::test

#endif
