// Coarser volumes: conservation, masks, and sharing of levels by a dataset.
#include "server/data/model/coarsen.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "server/data/resident/store.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::data {
namespace {

constexpr float masked = std::numeric_limits<float>::quiet_NaN();

Volume volume_of(std::array<int, 3> dims, int components, std::vector<float> values) {
  Volume volume;
  volume.dims = dims;
  volume.components = components;
  volume.values = std::move(values);
  finish_volume(volume);
  return volume;
}

std::vector<double> uneven(int count, std::mt19937& random) {
  std::uniform_real_distribution<double> width(0.2, 3.0);
  std::vector<double> out(static_cast<std::size_t>(count));
  for (double& w : out) w = width(random);
  return out;
}

std::vector<double> sums(const std::vector<double>& widths, int halvings) {
  std::vector<double> out;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    if (i % (std::size_t{1} << static_cast<unsigned>(halvings)) == 0) out.push_back(0);
    out.back() += widths[i];
  }
  return out;
}

// The integral over space of a scalar, or of a function of it, over unmasked samples only.
double integral(
    const Volume& volume, const std::array<std::vector<double>, 3>& widths,
    const std::function<double(double)>& of = [](double v) { return v; }) {
  double sum = 0;
  std::size_t n = 0;
  for (const double z : widths[2]) {
    for (const double y : widths[1]) {
      for (const double x : widths[0]) {
        double value = 0;
        if (volume.components == 1) {
          value = of(volume.component(0)[n]);
        } else {
          value =
              of(volume.component(TwoValues::low)[n]) * volume.component(TwoValues::low_share)[n] +
              of(volume.component(TwoValues::high)[n]) * volume.component(TwoValues::high_share)[n];
        }
        if (!std::isnan(value)) sum += x * y * z * value;
        ++n;
      }
    }
  }
  return sum;
}

Coarsening drawn(const std::array<int, 3>& halvings) { return {halvings, {}, Reduction::drawn}; }

// No sample where the place that is drawn lies beyond the end of an axis.
TEST(CoarsenByDrawing, TakesAtMostOneSampleOfEachGroupWithAllItsComponents) {
  const std::array<int, 3> dims{9, 6, 5};
  std::vector<float> values;
  for (int c = 0; c < 3; ++c) {
    for (int n = 0; n < 9 * 6 * 5; ++n) values.push_back(static_cast<float>(1000 * c + n));
  }
  const Volume fine = volume_of(dims, 3, std::move(values));
  const Volume coarse = coarsen(fine, drawn({1, 2, 1}));
  ASSERT_EQ(coarse.dims, (std::array{5, 2, 3}));
  std::size_t n = 0;
  int empty = 0;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 5; ++i, ++n) {
        if (std::isnan(coarse.component(0)[n])) {
          EXPECT_TRUE(i == 4 || j == 1 || k == 2) << "a whole group";
          EXPECT_TRUE(std::isnan(coarse.component(1)[n]) && std::isnan(coarse.component(2)[n]));
          ++empty;
          continue;
        }
        const auto from = static_cast<int>(coarse.component(0)[n]);
        EXPECT_EQ(from % 9 / 2, i);
        EXPECT_EQ(from / 9 % 6 / 4, j);
        EXPECT_EQ(from / 54 / 2, k);
        EXPECT_EQ(coarse.component(1)[n], static_cast<float>(from + 1000));
        EXPECT_EQ(coarse.component(2)[n], static_cast<float>(from + 2000));
      }
    }
  }
  EXPECT_EQ(coarse.masked, empty);
}

// Rows of three samples: the second group has one. Of n draws with probability 1/2 the standard
// deviation is sqrt(n) / 2; six of them are allowed.
TEST(CoarsenByDrawing, DrawsEverySampleOfAnIncompleteGroupAsOftenAsOthers) {
  const int rows = 64 * 64;
  std::vector<float> values;
  for (int n = 0; n < 3 * rows; ++n) values.push_back(static_cast<float>(n % 3));
  const Volume coarse = coarsen(volume_of({3, 64, 64}, 1, std::move(values)), drawn({1, 0, 0}));
  std::array<int, 3> count{};
  for (const float v : coarse.values) {
    if (!std::isnan(v)) ++count.at(static_cast<std::size_t>(v));
  }
  for (const int n : count) EXPECT_NEAR(n, rows / 2, 6 * std::sqrt(rows) / 2);
}

// Of n draws with probability 1/8 the expected count is n / 8 with a standard deviation of
// sqrt(n 7/64); six of them are allowed.
TEST(CoarsenByDrawing, DrawsEverySampleOfAGroupEquallyOften) {
  const int side = 64;
  std::vector<float> values;
  for (int n = 0; n < side * side * side; ++n) {
    const int x = n % side & 1;
    const int y = n / side % side & 1;
    const int z = n / side / side & 1;
    values.push_back(static_cast<float>(x + 2 * y + 4 * z));
  }
  const Volume coarse =
      coarsen(volume_of({side, side, side}, 1, std::move(values)), drawn({1, 1, 1}));
  std::array<int, 8> count{};
  for (const float v : coarse.values) ++count.at(static_cast<std::size_t>(v));
  const double groups = side * side * side / 8.0;
  for (const int n : count) EXPECT_NEAR(n, groups / 8, 6 * std::sqrt(groups * 7 / 64));
}

TEST(CoarsenByDrawing, IsMaskedWhereTheDrawnSampleIs) {
  std::vector<float> values(32 * 32 * 32, 1);
  for (std::size_t n = 0; n < values.size(); n += 2) values[n] = masked;
  const Volume coarse = coarsen(volume_of({32, 32, 32}, 1, std::move(values)), drawn({1, 0, 0}));
  int there = 0;
  for (const float v : coarse.values) there += v == 1 ? 1 : 0;
  EXPECT_NEAR(there, 32 * 32 * 8, 6 * std::sqrt(32 * 32 * 16 / 4.0));
}

// Samples in the middle of every `stride` of `count`, the lower of two; at the end of the rest.
std::set<int> middles_of(int count, int stride) {
  std::set<int> out;
  for (int first = 0; first < count; first += stride) {
    out.insert((first + std::min(first + stride, count) - 1) / 2);
  }
  return out;
}

// Groups no wider than a stride have at most one of these samples: each is there once.
TEST(CoarsenByDrawing, KeepsTheSamplesOfStridedKernels) {
  const std::array<int, 3> dims{22, 13, 9};
  std::vector<float> values(22 * 13 * 9);
  std::iota(values.begin(), values.end(), 0.0F);
  const Volume fine = volume_of(dims, 1, std::move(values));
  using Levels = std::vector<std::array<int, 3>>;
  for (const auto& [stride, levels] : std::map<int, Levels>{{2, {{1, 1, 1}, {0, 1, 0}}},
                                                            {3, {{1, 1, 1}, {1, 0, 1}}},
                                                            {4, {{1, 1, 1}, {2, 1, 2}}},
                                                            {5, {{2, 2, 1}}}}) {
    for (const auto& halvings : levels) {
      Coarsening how = drawn(halvings);
      how.stride = stride;
      const Volume coarse = coarsen(fine, how);
      std::set<int> found;
      for (std::size_t n = 0; n < coarse.values.size(); ++n) {
        if (std::isnan(coarse.values[n])) continue;
        const int from = static_cast<int>(coarse.values[n]);
        EXPECT_TRUE(found.insert(from).second) << from;
        EXPECT_EQ(static_cast<int>(n) % coarse.dims[0], (from % 22) >> halvings[0]);
      }
      std::set<int> expected;
      for (const int k : middles_of(9, stride)) {
        for (const int j : middles_of(13, stride)) {
          for (const int i : middles_of(22, stride)) expected.insert(i + 22 * (j + 13 * k));
        }
      }
      EXPECT_EQ(found, expected) << stride;
    }
  }
}

// Four samples hold two kernels of a stride of two, of which one is drawn, and one or two of a
// stride of three: of the 8 in 24 samples, each is drawn with probability 1/2.
TEST(CoarsenByDrawing, DrawsKernelsOfAStrideEquallyOften) {
  const int rows = 64 * 64;
  for (const int stride : {2, 3}) {
    const int side = 64 * stride;
    std::vector<float> values;
    for (int n = 0; n < 24 * side * side; ++n) values.push_back(static_cast<float>(n % 24));
    Coarsening how = drawn({2, 0, 0});
    how.stride = stride;
    const Volume coarse = coarsen(volume_of({24, side, side}, 1, std::move(values)), how);
    std::map<int, int> count;
    for (const float v : coarse.values) {
      if (!std::isnan(v)) ++count[static_cast<int>(v)];
    }
    ASSERT_EQ(count.size(), middles_of(24, stride).size());
    for (const auto& [sample, n] : count) {
      EXPECT_TRUE(middles_of(24, stride).contains(sample)) << sample;
      EXPECT_NEAR(n, rows / 2, 6 * std::sqrt(rows) / 2) << sample;
    }
  }
}

TEST(CoarsenByDrawing, HasAKeyOfItsOwn) {
  const std::array<std::vector<double>, 3> widths{std::vector<double>(8, 1.0), {}, {}};
  EXPECT_NE(key_of({{1, 0, 0}, widths}), key_of({{1, 0, 0}, widths, Reduction::drawn}));
  EXPECT_EQ(key_of(drawn({1, 0, 0})), key_of({{1, 0, 0}, widths, Reduction::drawn}));
  EXPECT_NE(key_of(drawn({1, 0, 0})), key_of({{1, 0, 0}, {}, Reduction::drawn, 2}));
}

TEST(CoarsenToTwoValues, KeepsTheIntegralOverUnevenCells) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(-2, 5);
  const std::array<int, 3> dims{11, 6, 5};
  for (const std::array<int, 3> halvings :
       {std::array{1, 1, 1}, {0, 1, 0}, {2, 0, 1}, {4, 2, 0}, {0, 0, 3}}) {
    for (const bool gaps : {false, true}) {
      Coarsening how{halvings, {}};
      for (std::size_t a = 0; a < 3; ++a) how.widths[a] = uneven(dims[a], random);
      std::vector<float> values(11 * 6 * 5);
      for (float& v : values) v = value(random);
      for (std::size_t n = 0; gaps && n < values.size(); n += 3) values[n] = masked;
      const Volume fine = volume_of(dims, 1, values);
      const Volume coarse = coarsen(fine, how);
      std::array<std::vector<double>, 3> widths;
      for (std::size_t a = 0; a < 3; ++a) {
        widths[a] = sums(how.widths[a], halvings[a]);
        ASSERT_EQ(coarse.dims[a], static_cast<int>(widths[a].size()));
      }
      ASSERT_EQ(coarse.components, TwoValues::components);
      const double whole = integral(fine, how.widths);
      EXPECT_NEAR(integral(coarse, widths), whole, 1e-5 * std::abs(whole) + 1e-3);
    }
  }
}

// A step between the two values of a field keeps its integral; it is lost if the values are
// averaged first.
TEST(CoarsenToTwoValues, KeepsTheIntegralOfAStepBetweenThem) {
  std::mt19937 random(11);
  std::bernoulli_distribution is_high(0.2);
  const std::array<int, 3> dims{16, 12, 8};
  std::vector<float> values(16 * 12 * 8);
  for (float& v : values) v = is_high(random) ? 1 : 0.25F;
  Coarsening how{{2, 1, 1}, {}};
  for (std::size_t a = 0; a < 3; ++a) how.widths[a] = uneven(dims[a], random);
  const Volume fine = volume_of(dims, 1, values);
  std::array<std::vector<double>, 3> widths;
  for (std::size_t a = 0; a < 3; ++a) widths[a] = sums(how.widths[a], how.halvings[a]);
  const auto step = [](double v) { return v > 0.9 ? 1.0 : 0.0; };
  const double whole = integral(fine, how.widths, step);
  ASSERT_GT(whole, 1);
  EXPECT_NEAR(integral(coarsen(fine, how), widths, step), whole, 1e-5 * whole);
}

TEST(CoarsenToTwoValues, WeightsNeighborsByTheirCells) {
  const Volume fine = volume_of({3, 1, 1}, 1, {1, 5, 7});
  const Volume coarse = coarsen(fine, {{1, 0, 0}, {std::vector<double>{3, 1, 2}, {}, {}}});
  EXPECT_EQ(coarse.dims, (std::array{2, 1, 1}));
  const auto at = [&](int component, std::size_t n) { return coarse.component(component)[n]; };
  // The mean of the first group is (3 * 1 + 1 * 5) / 4 = 2.
  EXPECT_FLOAT_EQ(at(TwoValues::low, 0), 1);
  EXPECT_FLOAT_EQ(at(TwoValues::high, 0), 5);
  EXPECT_FLOAT_EQ(at(TwoValues::low_share, 0), 0.75F);
  EXPECT_FLOAT_EQ(at(TwoValues::high_share, 0), 0.25F);
  // The last group has one sample.
  EXPECT_FLOAT_EQ(at(TwoValues::high, 1), 7);
  EXPECT_FLOAT_EQ(at(TwoValues::low_share, 1) + at(TwoValues::high_share, 1), 1);
}

TEST(CoarsenToTwoValues, ConstantStaysConstant) {
  std::mt19937 random(3);
  const std::array<int, 3> dims{9, 7, 4};
  Coarsening how{{2, 1, 1}, {}};
  for (std::size_t a = 0; a < 3; ++a) how.widths[a] = uneven(dims[a], random);
  for (const float value : {0.0F, 0.3F, -1e30F, std::numeric_limits<float>::max() / 1.0001F}) {
    const Volume coarse = coarsen(volume_of(dims, 1, std::vector<float>(9 * 7 * 4, value)), how);
    EXPECT_EQ(coarse.masked, 0);
    for (std::size_t n = 0; n < coarse.samples(); ++n) {
      EXPECT_NEAR(coarse.component(TwoValues::low)[n], value, 1e-5 * std::abs(value));
      EXPECT_NEAR(coarse.component(TwoValues::high)[n], value, 1e-5 * std::abs(value));
    }
  }
}

TEST(CoarsenToTwoValues, ZerosOfEitherSignAreEqual) {
  const Volume fine = volume_of({2, 1, 1}, 1, {-0.0F, 0.0F});
  Coarsening how;
  how.halvings = {1, 0, 0};
  how.widths[0] = {1, 1};
  const Volume coarse = coarsen(fine, how);
  EXPECT_EQ(coarse.component(TwoValues::low_share)[0], 0);
  EXPECT_EQ(coarse.component(TwoValues::high_share)[0], 1);
}

// Layers of a level depend on their own samples only, whichever thread computes them.
TEST(CoarsenToTwoValues, LargeVolumesHaveTheLevelsOfTheirParts) {
  constexpr int side = 160;  // several million samples, for several threads
  constexpr int part = 8;    // layers, for one
  constexpr std::size_t layer = std::size_t{side} * side;
  std::vector<float> values(layer * side);
  std::mt19937 random(4);
  std::uniform_real_distribution<float> any(-1, 1);
  for (float& v : values) v = any(random) < -0.8F ? masked : any(random);
  Coarsening how;
  how.halvings = {2, 2, 2};
  for (auto& widths : how.widths) widths.assign(side, 1.0);
  const Volume whole = coarsen(volume_of({side, side, side}, 1, values), how);
  how.widths[2].assign(part, 1.0);
  for (int k = 0; k < side; k += part) {
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(layer) * k;
    const Volume alone = coarsen(
        volume_of({side, side, part}, 1, {from, from + static_cast<std::ptrdiff_t>(layer) * part}),
        how);
    for (int c = 0; c < TwoValues::components; ++c) {
      const float* const here = whole.component(c) + layer / 16 * static_cast<std::size_t>(k / 4);
      for (std::size_t n = 0; n < alone.samples(); ++n) {
        const float expected = alone.component(c)[n];
        ASSERT_TRUE(here[n] == expected || (std::isnan(here[n]) && std::isnan(expected)))
            << "layer " << k << ", component " << c << ", sample " << n;
      }
    }
  }
}

TEST(CoarsenToTwoValues, IsMaskedOnlyWhereAllSamplesAre) {
  const Volume fine =
      volume_of({4, 2, 1}, 1, {1, masked, masked, masked, 3, masked, masked, masked});
  const std::vector<double> even(4, 1.0);
  const Volume coarse = coarsen(fine, {{1, 1, 0}, {even, {1, 3}, {}}});
  ASSERT_EQ(coarse.dims, (std::array{2, 1, 1}));
  // The mean is (1 * 1 + 3 * 3) / 4 = 2.5; half of the volume is masked.
  EXPECT_FLOAT_EQ(coarse.component(TwoValues::low)[0], 1);
  EXPECT_FLOAT_EQ(coarse.component(TwoValues::high)[0], 3);
  EXPECT_FLOAT_EQ(coarse.component(TwoValues::low_share)[0], 0.125F);
  EXPECT_FLOAT_EQ(coarse.component(TwoValues::high_share)[0], 0.375F);
  for (int c = 0; c < TwoValues::components; ++c) EXPECT_TRUE(std::isnan(coarse.component(c)[1]));
  EXPECT_EQ(coarse.masked, 1);
}

class Levels : public testing::Test {
 protected:
  // Scalars of 16^3: 16 KiB at level 0, two values and their shares of 8^3, 8 KiB, at level 1.
  static constexpr std::uint64_t fine_bytes = 4 * 16 * 16 * 16;
  static constexpr std::uint64_t coarse_bytes = TwoValues::components * fine_bytes / 8;

  static std::unique_ptr<Dataset> dataset_within(std::uint64_t bytes) {
    return std::make_unique<Dataset>(*open_sample("tornado", {16, 16, 16}, 4), "t", bytes);
  }
  static Coarsening halves(double last_width = 1) {
    Coarsening how{{1, 1, 1}, {}};
    for (auto& widths : how.widths) widths.assign(16, 1.0);
    how.widths[2].back() = last_width;
    return how;
  }
};

TEST_F(Levels, AreAveragedOnceSharedAndCounted) {
  const auto dataset = dataset_within(1U << 20U);
  const auto coarse = dataset->level("vorticity", 1, halves());
  ASSERT_TRUE(coarse) << coarse.error().message;
  EXPECT_EQ((*coarse)->dims, (std::array{8, 8, 8}));
  EXPECT_EQ(dataset->resident_bytes(), fine_bytes + coarse_bytes);
  EXPECT_EQ(dataset->level("vorticity", 1, halves())->get(), coarse->get());
  EXPECT_NE(dataset->level("vorticity", 1, halves(2))->get(), coarse->get());
  EXPECT_EQ(dataset->resident_bytes(), fine_bytes + 2 * coarse_bytes);
  EXPECT_EQ(dataset->loads(), 1U);
  EXPECT_EQ(dataset->levels(), 2U);
  const auto& fine = *dataset->volume("vorticity", 1).value();
  const auto first = [&](int component) { return (*coarse)->component(component)[0]; };
  EXPECT_FLOAT_EQ(first(TwoValues::low) * first(TwoValues::low_share) +
                      first(TwoValues::high) * first(TwoValues::high_share),
                  (fine.values[0] + fine.values[1] + fine.values[16] + fine.values[17] +
                   fine.values[256] + fine.values[257] + fine.values[272] + fine.values[273]) /
                      8);
}

TEST_F(Levels, LevelZeroIsTheVolumeItself) {
  const auto dataset = dataset_within(1U << 20U);
  const auto same = dataset->level("cloud", 0, Coarsening{});
  ASSERT_TRUE(same);
  EXPECT_EQ(same->get(), dataset->volume("cloud", 0)->get());
  EXPECT_EQ(dataset->resident_bytes(), fine_bytes);
}

TEST_F(Levels, StayWithinTheMemoryLimit) {
  EXPECT_EQ(dataset_within(fine_bytes)->level("cloud", 0, halves()).error().kind,
            ErrorKind::out_of_memory);
  // Memory for a volume and its level: the next step evicts both.
  const auto dataset = dataset_within(fine_bytes + coarse_bytes);
  ASSERT_TRUE(dataset->level("cloud", 0, halves()));
  ASSERT_TRUE(dataset->level("cloud", 1, halves()));
  EXPECT_EQ(dataset->resident_bytes(), fine_bytes + coarse_bytes);
  EXPECT_EQ(dataset->loads(), 2U);
}

TEST_F(Levels, DoNotEvictTheirSourceVolume) {
  const auto dataset = dataset_within(fine_bytes + coarse_bytes - 1);
  ASSERT_TRUE(dataset->volume("cloud", 0));
  for (int again = 0; again < 2; ++again) {
    EXPECT_EQ(dataset->level("cloud", 0, halves()).error().kind, ErrorKind::out_of_memory);
    EXPECT_EQ(dataset->resident_bytes(), fine_bytes);
  }
  EXPECT_EQ(dataset->loads(), 1U) << "lack of memory for a level must not cause another read";
}

TEST_F(Levels, DoNotDependOnTheUnitOfWidth) {
  const auto dataset = dataset_within(1U << 20U);
  const auto coarse = dataset->level("cloud", 0, halves(2));
  for (const double unit : {1e-3, 1 / 3.0, 0.1, 7.3}) {
    Coarsening how = halves(2);
    for (auto& widths : how.widths) {
      for (double& width : widths) width *= unit;
    }
    EXPECT_EQ(dataset->level("cloud", 0, how)->get(), coarse->get()) << unit;
  }
  EXPECT_EQ(dataset->resident_bytes(), fine_bytes + coarse_bytes);
}

TEST_F(Levels, OutliveTheirSourceVolume) {
  const auto dataset = dataset_within(fine_bytes + 2 * coarse_bytes);
  const auto held = dataset->level("cloud", 0, halves());
  ASSERT_TRUE(held);
  ASSERT_TRUE(dataset->level("vorticity", 0, halves()));
  EXPECT_EQ(dataset->loads(), 2U);
  EXPECT_EQ(dataset->level("cloud", 0, halves())->get(), held->get());
  EXPECT_EQ(dataset->loads(), 2U) << "the cloud is not read again";
}

TEST_F(Levels, UnknownNamesAndStepsAreNotFound) {
  const auto dataset = dataset_within(1U << 20U);
  EXPECT_EQ(dataset->level("fog", 0, halves()).error().kind, ErrorKind::not_found);
  EXPECT_EQ(dataset->level("cloud", 4, halves()).error().kind, ErrorKind::not_found);
  EXPECT_EQ(dataset->resident_bytes(), 0U);
}

TEST(SizedSample, ReportsTheSizeOfASample) {
  EXPECT_EQ(sized_sample("tornado")->dims, (std::array{0, 0, 0}));
  EXPECT_EQ(sized_sample("tornado:256")->name, "tornado");
  EXPECT_EQ(sized_sample("tornado:256")->dims, (std::array{256, 256, 256}));
  EXPECT_EQ(sized_sample("climate:8x6x19")->dims, (std::array{8, 6, 19}));
  for (const char* no :
       {"", "fog", "fog:4", "tornado:", "tornado:0", "tornado:4x", "tornado:4x4", "tornado:4x4x",
        "tornado:4x4x4x4", "tornado:-4", "tornado:4 ", "tornado:4x4x99999999999", "./tornado:4"}) {
    EXPECT_FALSE(sized_sample(no)) << no;
  }
}

TEST(SizedSample, IsADatasetWithItsOwnName) {
  Store store(1U << 20U);
  const auto dataset = store.add("tornado:12x10x8");
  ASSERT_TRUE(dataset) << dataset.error().message;
  EXPECT_EQ((*dataset)->info().id, "tornado:12x10x8");
  EXPECT_EQ((*dataset)->info().grid.dims(), (std::array{12, 10, 8}));
  EXPECT_EQ(store.add("tornado:99999").error().kind, ErrorKind::invalid);
}

}  // namespace
}  // namespace windsplat::data
