// Nearer content hides farther content, from every direction and from inside.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

// Two opaque splats, red at sample a and green at b; the centre pixel shows one of them when the
// view direction is along the line through both.
scene::Scene two_splats(const scene::Lattice& lattice, std::array<int, 3> red,
                        std::array<int, 3> green) {
  scene::Scene scene;
  scene.lattice = lattice;
  const auto volume = [&](std::array<int, 3> at) {
    auto values = std::make_shared<data::Volume>();
    values->dims = lattice.dims;
    values->values = std::vector<float>(values->samples(), 0.0F);
    values
        ->values[static_cast<std::size_t>(at[0]) +
                 static_cast<std::size_t>(lattice.dims[0]) *
                     (static_cast<std::size_t>(at[1]) + static_cast<std::size_t>(lattice.dims[1]) *
                                                            static_cast<std::size_t>(at[2]))] =
        1e4F;
    return values;
  };
  scene.scalars.push_back(medium(volume(red), {1.0F, 0.0F, 0.0F}));
  scene.scalars.push_back(medium(volume(green), {0.0F, 1.0F, 0.0F}));
  return scene;
}

glm::dvec3 place(const scene::Lattice& lattice, std::array<int, 3> at) {
  return {lattice.positions[0][at[0]], lattice.positions[1][at[1]], lattice.positions[2][at[2]]};
}

TEST(Visibility, NearerHidesFartherFromTwentySixDirections) {
  const scene::Lattice lattice = even_lattice({21, 21, 21}, {0.1, 0.07, 0.15});
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        if (dx == 0 && dy == 0 && dz == 0) continue;
        const std::array<int, 3> red{10 - 5 * dx, 10 - 5 * dy, 10 - 5 * dz};
        const std::array<int, 3> green{10 + 4 * dx, 10 + 4 * dy, 10 + 4 * dz};
        scene::Scene scene = two_splats(lattice, red, green);
        const glm::dvec3 forward = place(lattice, green) - place(lattice, red);
        for (const bool perspective : {false, true}) {
          // From outside, and from inside the box between its centre and the red splat, which ends
          // 1.37 of 9 cells behind its centre.
          for (const double distance : {4.0, 0.8 * glm::length(forward)}) {
            scene.camera = look(place(lattice, green), forward, distance, 15, 15, perspective, 0.1);
            const bool behind_eye = perspective && distance < glm::length(forward);
            const engine::Image image = render(scene).image;
            const float* middle = pixel(image, 7, 7);
            EXPECT_EQ(middle[behind_eye ? 1 : 0], 1.0F)
                << dx << dy << dz << " " << perspective << " " << distance;
            EXPECT_LT(middle[behind_eye ? 0 : 1], 1e-3F);
          }
        }
      }
    }
  }
}

TEST(Visibility, HoldsForEveryPairSeenFromTheCenter) {
  const scene::Lattice lattice = even_lattice({17, 17, 17}, {0.1, 0.1, 0.1});
  const glm::dvec3 eye{0.01, -0.02, 0.03};
  std::mt19937 random(5);
  std::uniform_int_distribution<int> at(0, 16);
  int tried = 0;
  while (tried < 60) {
    const std::array<int, 3> near{at(random), at(random), at(random)};
    const glm::dvec3 to = place(lattice, near) - eye;
    if (glm::length(to) < 0.25 || glm::length(to) > 0.4) continue;
    // The nearest sample at twice the distance in the same direction.
    std::array<int, 3> far{};
    bool inside = true;
    for (int a = 0; a < 3; ++a) {
      far[a] = static_cast<int>(std::lround((eye[a] + 2 * to[a]) / 0.1)) + 8;
      inside = inside && far[a] >= 0 && far[a] < 17;
    }
    if (!inside) continue;
    ++tried;
    scene::Scene scene = two_splats(lattice, near, far);
    scene.camera = look(place(lattice, near), to, glm::length(to), 9, 9, true, 0.01);
    scene.camera.eye = eye;
    const engine::Image image = render(scene).image;
    EXPECT_EQ(pixel(image, 4, 4)[0], 1.0F);
    EXPECT_LT(pixel(image, 4, 4)[1], 1e-3F);
  }
}

TEST(Visibility, OpaqueMediumHidesLinesBehindIt) {
  scene::Scene scene;
  scene.lattice = even_lattice({9, 9, 9}, {0.2, 0.2, 0.2});
  const auto wind = make_volume(scene.lattice, 3, [](int c, double, double y, double) {
    return c == 0 && y > 0.3 ? 1.0F : 0.0F;
  });
  const auto wall = make_volume(
      scene.lattice, 1, [](int, double, double y, double) { return y < -0.3 ? 1e3F : 0.0F; });
  scene.vector = plain_lines(wind, {0.0F, 1.0F, 0.0F});
  scene.vector->length = 0.5;
  scene.scalars.push_back(medium(wall, {1.0F, 0.0F, 0.0F}));
  for (const int stride : {1, 2}) {
    scene.vector->stride = stride;
    scene.camera = look({0, 0, 0}, {0, 1, 0}, 4, 40, 40, true, 0.1);
    const engine::Image front = render(scene).image;
    EXPECT_LT(pixel(front, 20, 20)[1], 1e-3F);
    scene.camera = look({0, 0, 0}, {0, -1, 0}, 4, 40, 40, true, 0.1);
    const engine::Image back = render(scene).image;
    float green = 0;
    for (int i = 0; i < 40 * 40; ++i) green = std::max(green, back.rgba[4 * i + 1]);
    EXPECT_GT(green, 0.5F);
  }
}

}  // namespace
}  // namespace windsplat::test
