// Ranges of magnitudes that a few samples do not decide: bad ones, and those at poles.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <utility>
#include <vector>

#include "server/scene/defaults.hpp"
#include "server/scene/defaults/spacing.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using BoxDims = std::array<int, 3>;

data::Volume speeds_of(const BoxDims& dims, std::vector<float> values) {
  data::Volume volume;
  volume.dims = dims;
  volume.values = std::move(values);
  data::finish_volume(volume);
  return volume;
}

// Speeds of places from -1 to 1 along each axis.
data::Volume speeds_at(int samples, const std::function<double(const glm::dvec3&)>& speed) {
  const auto at = [&](int n) { return 2.0 * n / (samples - 1) - 1; };
  std::vector<float> values;
  for (int z = 0; z < samples; ++z) {
    for (int y = 0; y < samples; ++y) {
      for (int x = 0; x < samples; ++x) {
        values.push_back(static_cast<float>(speed({at(x), at(y), at(z)})));
      }
    }
  }
  return speeds_of({samples, samples, samples}, std::move(values));
}

// Between 0.4 and 2.8, without a pattern along the axes.
std::vector<float> noisy_speeds(const BoxDims& dims) {
  std::vector<float> values;
  const auto count = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                     static_cast<std::size_t>(dims[2]);
  for (std::size_t n = 1; n <= count; ++n) {
    const double share = std::fmod(0.7548776662466927 * static_cast<double>(n), 1.0);
    values.push_back(static_cast<float>(0.4 + 2.4 * share));
  }
  return values;
}

// The share of the vectors that a default picture leaves out.
double share_left_out(const data::Volume& speeds) {
  data::Grid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> at;
    for (int n = 0; n < speeds.dims[a]; ++n) at.push_back(0.1 * n);
    grid.axes[a] = axis(data::AxisKind::cartesian, "m", at);
  }
  const auto lattice = place_lattice(grid, {});
  EXPECT_TRUE(lattice);
  const LineSpacing spacing = default_spacing(*lattice, std::nullopt);
  const double least = default_min_magnitude(default_magnitude_range(speeds), spacing, speeds,
                                             *lattice, std::nullopt);
  return hidden_share(least, speeds);
}

// One of them is greater than the sum of all others.
TEST(DefaultMagnitudes, OfANoisyFlowAreNotThoseOfAFewBadSamples) {
  for (const BoxDims& dims : {BoxDims{60, 60, 12}, BoxDims{64, 64, 64}, BoxDims{20, 20, 20}}) {
    const data::Volume plain = speeds_of(dims, noisy_speeds(dims));
    const std::size_t row = static_cast<std::size_t>(dims[0]);
    const std::size_t layer = row * static_cast<std::size_t>(dims[1]);
    std::vector<std::size_t> block;
    for (std::size_t n = 0; n < 27; ++n) block.push_back(n / 9 * layer + n / 3 % 3 * row + n % 3);
    // The first sample is among those from which defaults follow.
    const std::vector<std::vector<std::size_t>> bad = {{0}, {0, layer + 1, 3 * layer}, block};
    for (const std::vector<std::size_t>& places : bad) {
      std::vector<float> values = noisy_speeds(dims);
      for (const std::size_t at : places) values[at] = 1.7e6F;
      const data::Volume speeds = speeds_of(dims, std::move(values));
      EXPECT_EQ(default_magnitude_range(speeds)[1], default_magnitude_range(plain)[1])
          << places.size() << ' ' << dims[0];
      EXPECT_LT(share_left_out(speeds), 0.6) << places.size() << ' ' << dims[0];
      EXPECT_LT(default_color_top(speeds), 8) << places.size() << ' ' << dims[0];
    }
  }
}

// The magnitudes of 1 / r^4 near the pole are those of a few samples.
TEST(DefaultMagnitudes, OfASteepPoleShowMoreThanThePole) {
  for (const double power : {1.0, 2.0, 3.0, 4.0}) {
    const data::Volume speeds = speeds_at(64, [&](const glm::dvec3& at) {
      return std::pow(glm::length(at - glm::dvec3(-0.4, 0.27, 0.21)), -power);
    });
    EXPECT_LT(share_left_out(speeds), 0.7) << power;
  }
}

TEST(DefaultMagnitudes, OfAFewSamplesThatAloneMoveAreTheirs) {
  const data::Volume drop =
      speeds_at(30, [](const glm::dvec3& at) { return glm::length(at) < 0.1 ? 3.0 : 0.0; });
  EXPECT_EQ(default_magnitude_range(drop)[1], 3);
}

}  // namespace
}  // namespace windsplat::scene
