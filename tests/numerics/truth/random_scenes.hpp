// Small random scenes for comparison with the brute-force integral.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::test {

// Uniform random numbers for scenes.
class Draws {
 public:
  explicit Draws(std::uint32_t seed) : random_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  // `count` cells, each `low` to `high` times as wide as `cell`.
  std::vector<double> widths(int count, double cell, double low, double high) {
    std::vector<double> out;
    for (int i = 0; i < count; ++i) out.push_back(cell * between(low, high));
    return out;
  }

 private:
  std::mt19937 random_;
};

// Lines and media of uneven cells, some curved, some with strides, in a picture of few pixels. The
// eye lies outside the box or, `inside`, anywhere within it.
scene::Scene random_scene(std::uint32_t seed, bool inside);

// The picture of the reference.
std::vector<double> reference_picture(const scene::Scene& scene, double tolerance = 1e-9);

}  // namespace windsplat::test
