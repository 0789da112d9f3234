// Histograms, percentiles and ranges compared with closed forms.
#include "server/data/model/measure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace windsplat::data {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

Volume volume_of(std::vector<float> values, int components = 1) {
  Volume volume;
  volume.components = components;
  volume.dims = {static_cast<int>(values.size()) / components, 1, 1};
  volume.values = std::move(values);
  finish_volume(volume);
  return volume;
}

// 0, 1, ..., count - 1, neither ascending nor descending.
Volume ramp(int count) {
  std::vector<float> values(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    values[static_cast<std::size_t>(i)] = static_cast<float>(static_cast<long>(i) * 7919 % count);
  }
  return volume_of(std::move(values));
}

Histogram made(const Volume& volume, const HistogramRequest& request) {
  auto made = histogram(volume, request, CancelToken());
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return made ? *made : Histogram{};
}

std::int64_t total(const Histogram& h) {
  return std::accumulate(h.counts.begin(), h.counts.end(), std::int64_t{0});
}

TEST(Histogram, RampFillsItsBinsEvenly) {
  const Histogram h = made(ramp(1000), {.bins = 10, .range = std::array{0.0, 1000.0}});
  EXPECT_THAT(h.counts, Each(100));
  EXPECT_THAT(h.edges, testing::Pointwise(testing::DoubleNear(1e-9),
                                          {0, 100, 200, 300, 400, 500, 600, 700, 800, 900, 1000}));
  EXPECT_EQ(h.below + h.above + h.masked, 0);
}

TEST(Histogram, RangeHasNoNegativeZeroInAnyOrderOfSamples) {
  for (const float first : {0.0F, -0.0F}) {
    const Volume volume = volume_of({first, -first});
    EXPECT_FALSE(std::signbit(volume.range[0]) || std::signbit(volume.range[1]));
  }
}

TEST(Histogram, DefaultRangeIsThatOfTheVolumeIncludingItsUpperEdge) {
  const Histogram h = made(ramp(5), {.bins = 2});
  EXPECT_THAT(*h.range, ElementsAre(0, 4));
  EXPECT_THAT(h.counts, ElementsAre(2, 3)) << "0 1 | 2 3 4";
}

TEST(Histogram, OutsideAndMaskedSamplesAreCountedSeparately) {
  const Volume volume = volume_of({-5, -1, 0, 1, 2, nan, 3, 4, 9, nan, nan});
  const Histogram h = made(volume, {.bins = 4, .range = std::array{0.0, 4.0}});
  EXPECT_EQ(h.below, 2);
  EXPECT_EQ(h.above, 1);
  EXPECT_EQ(h.masked, 3);
  EXPECT_THAT(h.counts, ElementsAre(1, 1, 1, 2));
  EXPECT_EQ(total(h) + h.below + h.above + h.masked, 11);
}

TEST(Histogram, VectorsAreCountedByMagnitude) {
  // (3,4), (0,0), (-6,8) and a masked sample.
  const Volume volume = volume_of({3, 0, -6, 1, 4, 0, 8, nan}, 2);
  const Histogram h = made(volume, {.bins = 2});
  EXPECT_THAT(*h.range, ElementsAre(0, 10));
  EXPECT_THAT(h.counts, ElementsAre(1, 2));
  EXPECT_EQ(h.masked, 1);
}

// Of n values, a fraction c excludes floor(c n) at either end.
TEST(Histogram, ClippingOmitsTheShareAtEitherEnd) {
  const Volume volume = ramp(10'000);
  for (const auto& [clip, dropped] :
       {std::pair{0.01, 100}, {0.25, 2500}, {0.00015, 1}, {0.4999, 4999}}) {
    const Histogram h = made(volume, {.bins = 7, .clip = clip});
    EXPECT_THAT(*h.range, ElementsAre(dropped, 9999 - dropped)) << clip;
    EXPECT_EQ(h.below, dropped);
    EXPECT_EQ(h.above, dropped);
    EXPECT_EQ(total(h), 10'000 - 2 * dropped);
  }
}

TEST(Histogram, PercentilesEqualThoseOfSorting) {
  std::vector<float> values;
  for (int i = 0; i < 4001; ++i) {
    const int mixed = i * 2741 % 4001 - 2000;
    values.push_back(
        static_cast<float>(std::copysign(std::exp(std::abs(mixed) * 0.04 - 40), mixed)));
  }
  values[7] = -0.0F;
  std::vector<float> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const Histogram h = made(volume_of(values), {.bins = 3, .clip = 0.1});
  EXPECT_THAT(*h.range,
              ElementsAre(static_cast<double>(sorted[400]), static_cast<double>(sorted[3600])));
}

TEST(Histogram, OutlierDoesNotDecideTheRange) {
  std::vector<float> values(999, 1.0F);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 10);
  values.push_back(3e38F);
  EXPECT_THAT(*made(volume_of(values), {.bins = 4}).range, ElementsAre(0, testing::Gt(1e38)));
  const Histogram h = made(volume_of(values), {.bins = 4, .clip = 0.001});
  EXPECT_THAT(*h.range, ElementsAre(0, 9));
  EXPECT_EQ(h.above, 1);
}

TEST(Histogram, LogarithmicBinsOfAGeometricSeriesAreEven) {
  std::vector<float> values{0, -1, nan};
  for (int i = 0; i < 16; ++i) values.push_back(std::ldexp(1.0F, i));  // 1, 2, ..., 32768
  const Histogram h =
      made(volume_of(values), {.bins = 4, .range = std::array{1.0, 65536.0}, .logarithmic = true});
  EXPECT_THAT(h.counts, Each(4));
  for (std::size_t i = 0; i < h.edges.size(); ++i) {
    EXPECT_NEAR(h.edges[i], std::pow(16.0, static_cast<double>(i)), 1e-9 * h.edges[i]);
  }
  EXPECT_EQ(h.below, 2) << "0 and -1 have no logarithm";
  EXPECT_EQ(h.masked, 1);
  const Histogram own = made(volume_of(values), {.bins = 3, .logarithmic = true});
  EXPECT_THAT(*own.range, ElementsAre(1, 32768)) << "of the positive values";
  EXPECT_THAT(own.counts, ElementsAre(5, 5, 6));
}

// A bin contains the values between its edges, even where bin arithmetic would round otherwise.
TEST(Histogram, CountsMatchTheReturnedEdges) {
  std::vector<float> values;
  for (int i = 0; i <= 3000; ++i) values.push_back(static_cast<float>(i) / 1000.0F + 0.1F);
  const Volume volume = volume_of(values);
  for (const bool logarithmic : {false, true}) {
    const Histogram h = made(volume, {.bins = 997, .logarithmic = logarithmic});
    std::vector<std::int64_t> counts(997, 0);
    for (const float value : values) {
      const auto at =
          std::upper_bound(h.edges.begin(), h.edges.end() - 1, static_cast<double>(value));
      ++counts[std::min<std::size_t>(996, static_cast<std::size_t>(at - h.edges.begin()) - 1)];
    }
    EXPECT_EQ(h.counts, counts) << logarithmic;
  }
}

TEST(Histogram, ExtremeAndDegenerateVolumes) {
  const Histogram same = made(volume_of({5, 5, 5}), {.bins = 3});
  EXPECT_THAT(same.counts, ElementsAre(3, 0, 0));
  EXPECT_THAT(*same.range, ElementsAre(5, 5));
  const Histogram none = made(volume_of({nan, nan}), {.bins = 3});
  EXPECT_FALSE(none.range);
  EXPECT_THAT(none.counts, Each(0));
  EXPECT_EQ(none.masked, 2);
  const Histogram negative = made(volume_of({-1, 0, nan}), {.bins = 3, .logarithmic = true});
  EXPECT_FALSE(negative.range);
  EXPECT_EQ(negative.below, 2);
  constexpr float most = std::numeric_limits<float>::max();
  const Histogram wide = made(volume_of({-most, 0, most}), {.bins = 2});
  EXPECT_THAT(wide.counts, ElementsAre(1, 2));
  constexpr double far = std::numeric_limits<double>::max();
  EXPECT_THAT(made(volume_of({-1, 1}), {.bins = 2, .range = std::array{-far, far}}).counts,
              ElementsAre(1, 1));
  constexpr float least = std::numeric_limits<float>::denorm_min();
  EXPECT_EQ(total(made(volume_of({0, least}), {.bins = 5})), 2);
}

TEST(Histogram, InvalidRequestsAreRefused) {
  const Volume volume = ramp(4);
  const auto refused = [&](const HistogramRequest& request, const CancelToken& cancel = {}) {
    const auto h = histogram(volume, request, cancel);
    return h ? std::pair(ErrorKind::internal, std::string("made"))
             : std::pair(h.error().kind, h.error().message);
  };
  EXPECT_EQ(refused({.range = std::array{1.0, 1.0}}).first, ErrorKind::invalid);
  EXPECT_EQ(refused({.range = std::array{2.0, 1.0}}).first, ErrorKind::invalid);
  const auto zero = refused({.range = std::array{0.0, 1.0}, .logarithmic = true});
  EXPECT_EQ(zero.first, ErrorKind::invalid);
  EXPECT_THAT(zero.second, HasSubstr("above 0"));
  const CancelToken gone;
  gone.cancel();
  EXPECT_EQ(refused({}, gone).first, ErrorKind::cancelled);
  EXPECT_EQ(refused({.clip = 0.1}, gone).first, ErrorKind::cancelled);
}

TEST(FieldRange, CoversTheStepsAndSkipsFullyMaskedOnes) {
  FieldRange over;
  over.add(volume_of({nan, nan}));
  EXPECT_FALSE(over.range);
  over.add(volume_of({2, nan, 3}));
  over.add(volume_of({-1, 2.5}));
  EXPECT_THAT(*over.range, ElementsAre(-1, 3));
  EXPECT_EQ(over.masked, 3);
}

TEST(ValueAt, ComponentsInOrderAndNoneWhereMasked) {
  Volume volume;
  volume.dims = {2, 3, 2};
  volume.components = 2;
  std::vector<float> values(24);
  std::iota(values.begin(), values.end(), 0.0F);
  values[5] = nan;
  volume.values = std::move(values);
  finish_volume(volume);
  EXPECT_THAT(*value_at(volume, {1, 0, 0}), ElementsAre(1, 13));
  EXPECT_THAT(*value_at(volume, {0, 2, 0}), ElementsAre(4, 16));
  EXPECT_THAT(*value_at(volume, {1, 1, 1}), ElementsAre(9, 21));
  EXPECT_FALSE(value_at(volume, {1, 2, 0}));
}

}  // namespace
}  // namespace windsplat::data
