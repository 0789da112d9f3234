// Small random scenes for comparison with the brute-force integral.
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::test {

// Lines and media of uneven cells, some curved, some with strides, in a picture of few pixels. The
// eye lies outside the box or, `inside`, anywhere within it.
scene::Scene random_scene(std::uint32_t seed, bool inside);

// The picture of the reference.
std::vector<double> reference_picture(const scene::Scene& scene, double tolerance = 1e-9);

}  // namespace windsplat::test
