// Boxes of the data are reduced to the bits of the same box of the whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/model/coarsen.hpp"

namespace windsplat::data {
namespace {

using Indices = std::array<int, 3>;

// A third of the samples is masked, and a region throughout.
Volume gappy_volume(const Indices& dims, int components) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> any(-3, 7);
  Volume out;
  out.dims = dims;
  out.components = components;
  std::vector<float> values(out.samples() * static_cast<std::size_t>(components));
  for (float& v : values) v = any(random) < -1 ? std::nanf("") : any(random);
  std::fill_n(values.begin(), out.samples() / 4, std::nanf(""));
  out.values = std::move(values);
  finish_volume(out);
  return out;
}

Coarsening uneven_coarsening(const Indices& dims, const Indices& halvings, Reduction reduction) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> width(0.2, 3.0);
  Coarsening how{halvings, {}, reduction};
  for (std::size_t a = 0; a < 3; ++a) {
    how.widths[a].resize(static_cast<std::size_t>(dims[a]));
    for (double& w : how.widths[a]) w = width(random);
  }
  return how;
}

// Firsts and ends of boxes of two groups and of all that remains, along an axis.
std::vector<std::array<int, 2>> ranges_of(int samples, int halvings) {
  const int group = 1 << halvings;
  std::vector<std::array<int, 2>> out;
  for (int first = 0; first < samples; first += group) {
    out.push_back({first, std::min(first + 2 * group, samples)});
    if (out.back()[1] < samples) out.push_back({first, samples});
  }
  return out;
}

Indices halved_indices(const Indices& of, const Indices& halvings) {
  return {of[0] >> halvings[0], of[1] >> halvings[1], of[2] >> halvings[2]};
}

// Of every box, as many as there are.
int expect_bits_of_the_whole(const Volume& fine, Coarsening how) {
  const Volume whole = coarsen(fine, how);
  int boxes = 0;
  how.data_dims = fine.dims;
  for (const auto& z : ranges_of(fine.dims[2], how.halvings[2])) {
    for (const auto& y : ranges_of(fine.dims[1], how.halvings[1])) {
      for (const auto& x : ranges_of(fine.dims[0], how.halvings[0])) {
        how.first = {x[0], y[0], z[0]};
        const Box box{how.first, {x[1] - x[0], y[1] - y[0], z[1] - z[0]}};
        const Volume part = coarsen(cut(fine, box), how);
        ++boxes;
        EXPECT_EQ(part.components, whole.components);
        const Indices first = halved_indices(how.first, how.halvings);
        for (int c = 0; c < part.components; ++c) {
          for (int k = 0; k < part.dims[2]; ++k) {
            for (int j = 0; j < part.dims[1]; ++j) {
              const auto row = static_cast<std::size_t>((k * part.dims[1] + j) * part.dims[0]);
              const auto same = static_cast<std::size_t>(
                  ((first[2] + k) * whole.dims[1] + first[1] + j) * whole.dims[0] + first[0]);
              const auto bytes = sizeof(float) * static_cast<std::size_t>(part.dims[0]);
              const bool is_equal =
                  std::memcmp(part.component(c) + row, whole.component(c) + same, bytes) == 0;
              EXPECT_TRUE(is_equal)
                  << key_of(box) << ", component " << c << ", row " << j << ' ' << k;
              if (!is_equal) return boxes;
            }
          }
        }
      }
    }
  }
  return boxes;
}

constexpr std::array<Indices, 5> some_halvings{
    {{1, 1, 1}, {2, 1, 0}, {0, 2, 3}, {3, 3, 2}, {5, 0, 1}}};
constexpr Indices odd_dims{21, 14, 11};

TEST(CoarsenBoxes, GiveTheTwoValuesAndMeansOfTheWhole) {
  const Volume fine = gappy_volume(odd_dims, 1);
  int boxes = 0;
  for (const Indices& halvings : some_halvings) {
    for (const Reduction reduction : {Reduction::two_values, Reduction::mean}) {
      boxes += expect_bits_of_the_whole(fine, uneven_coarsening(odd_dims, halvings, reduction));
    }
  }
  EXPECT_GT(boxes, 4000);
}

TEST(CoarsenBoxes, GiveTheMeanMagnitudesOfTheWhole) {
  for (const int components : {2, 3}) {
    const Volume fine = gappy_volume(odd_dims, components);
    for (const Indices& halvings : some_halvings) {
      expect_bits_of_the_whole(fine,
                               uneven_coarsening(odd_dims, halvings, Reduction::mean_magnitude));
    }
  }
}

// Also with the strides of stored lines, and with those that groups are no multiple of.
TEST(CoarsenBoxes, GiveTheSamplesThatAreDrawnOfTheWhole) {
  const Volume fine = gappy_volume(odd_dims, 3);
  for (const Indices& halvings : some_halvings) {
    for (const int stride : {1, 2, 3, 4, 5, 8, 16}) {
      Coarsening how = uneven_coarsening(odd_dims, halvings, Reduction::drawn);
      how.stride = stride;
      expect_bits_of_the_whole(fine, how);
    }
  }
}

// The middle of each kernel of a stride of 2^level, of any axes.
TEST(CoarsenBoxes, OfAStrideOfAGroupHaveTheMiddlesOfKernels) {
  Volume fine;
  fine.dims = odd_dims;
  fine.values = Samples(fine.samples());
  for (std::size_t n = 0; n < fine.samples(); ++n) fine.values[n] = static_cast<float>(n);
  finish_volume(fine);
  Coarsening how{{2, 2, 2}, {}, Reduction::drawn, 4};
  how.data_dims = odd_dims;
  how.first = {20, 12, 8};
  const Volume part = coarsen(cut(fine, {how.first, {1, 2, 3}}), how);
  ASSERT_EQ(part.dims, (Indices{1, 1, 1}));
  // The last kernel of each axis: of the samples 20, 12 to 13, 8 to 10.
  EXPECT_EQ(part.values[0], static_cast<float>(20 + 21 * (12 + 14 * 9)));
}

TEST(CoarsenBoxes, RefuseBoxesThatCutGroups) {
  const Volume fine = gappy_volume({8, 8, 8}, 1);
  Coarsening how = uneven_coarsening({8, 8, 8}, {2, 0, 0}, Reduction::two_values);
  how.data_dims = {8, 8, 8};
  how.first = {2, 0, 0};
  EXPECT_THROW((void)coarsen(cut(fine, {how.first, {6, 8, 8}}), how), std::logic_error);
  how.first = {0, 0, 0};
  EXPECT_THROW((void)coarsen(cut(fine, {how.first, {6, 8, 8}}), how), std::logic_error);
}

Volume plain_volume(const Indices& dims, int components, std::vector<float> values) {
  Volume out;
  out.dims = dims;
  out.components = components;
  out.values = std::move(values);
  finish_volume(out);
  return out;
}

TEST(CoarsenToMeans, WeightsByCellsAndLeavesMaskedSamplesOut) {
  const float masked = std::numeric_limits<float>::quiet_NaN();
  const Volume fine = plain_volume({4, 2, 1}, 1,
                                   {1, 5, masked, masked,  //
                                    3, masked, masked, masked});
  Coarsening how{{1, 1, 0}, {}, Reduction::mean};
  how.widths = {std::vector<double>{3, 1, 1, 1}, {1, 1}, {1}};
  const Volume coarse = coarsen(fine, how);
  ASSERT_EQ(coarse.dims, (Indices{2, 1, 1}));
  ASSERT_EQ(coarse.components, 1);
  EXPECT_FLOAT_EQ(coarse.values[0], (3 * 1 + 1 * 5 + 3 * 3) / 7.0F);
  EXPECT_TRUE(std::isnan(coarse.values[1]));
  EXPECT_EQ(coarse.masked, 1);
  EXPECT_EQ(coarse.range, (std::array{coarse.values[0], coarse.values[0]}));
}

TEST(CoarsenToMeans, OfVectorsAreThoseOfMagnitudes) {
  const Volume fine = plain_volume({2, 1, 1}, 3, {3, -1, 0, 2, 4, -2});
  Coarsening how{{1, 0, 0}, {}, Reduction::mean_magnitude};
  how.widths[0] = {1, 3};
  const Volume coarse = coarsen(fine, how);
  ASSERT_EQ(coarse.components, 1);
  EXPECT_FLOAT_EQ(coarse.values[0], (5 + 3 * 3) / 4.0F);
}

TEST(CoarsenToMeans, HaveKeysOfTheirOwn) {
  std::vector<std::string> keys;
  for (const Reduction reduction :
       {Reduction::two_values, Reduction::drawn, Reduction::mean, Reduction::mean_magnitude}) {
    keys.push_back(key_of({{0, 0, 0}, {}, reduction}));
  }
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::unique(keys.begin(), keys.end()), keys.end());
}

}  // namespace
}  // namespace windsplat::data
