// Small random scenes for comparison with the brute-force integral.
#include "tests/numerics/truth/random_scenes.hpp"

#include <cmath>
#include <memory>
#include <stdexcept>

#include "server/engine/reference/reference.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {

namespace {

class Maker : private Draws {
 public:
  using Draws::Draws;

  scene::Scene make(bool inside) {
    scene::Scene scene;
    std::array<std::vector<double>, 3> spacing;
    for (auto& axis : spacing) {
      const double cell = between(0.1, 0.4);
      const int count = whole(2, 6);
      axis = widths(count, cell, 0.7, 1.4);
    }
    scene.lattice = make_lattice(spacing);
    if (whole(0, 3) == 0) bend(scene.lattice);
    const glm::dvec3 forward{between(-1, 1), between(-1, 1), between(-1, 1)};
    const bool perspective = inside || whole(0, 2) != 0;
    scene.camera = look({0, 0, 0}, forward, between(2.5, 4), 10, 8, perspective, 0.5);
    scene.camera.near = 0.01;
    if (inside) {
      scene.camera.half_height = between(0.3, 1.5);
      for (int a = 0; a < 3; ++a) {
        scene.camera.eye[a] = between(scene.lattice.box_min[a], scene.lattice.box_max[a]);
      }
    }
    if (whole(0, 3) != 0) scene.vector = lines(scene.lattice);
    if (whole(0, 5) != 0 || !scene.vector) {
      scene.scalars.push_back(medium(wave(scene.lattice, 1), {0.3F, 0.8F, 1.0F}));
      scene.scalars[0].color = ramp_color(0, 2, {0.9F, 0.2F, 0.1F}, {0.2F, 0.5F, 1.0F});
      scene.scalars[0].stride = whole(0, 3) == 0 ? 2 : 1;
    }
    return scene;
  }

 private:
  std::shared_ptr<const data::Volume> wave(const scene::Lattice& lattice, int components) {
    const double phase = between(0, 6);
    const double k = between(2, 7);
    return make_volume(lattice, components, [=](int c, double x, double y, double z) {
      const double a = phase + 2.1 * c;
      return static_cast<float>(std::sin(k * x + a) * std::cos(k * y - a) + std::sin(k * z + a));
    });
  }

  // Shears, so that cells are not parallel to the axes.
  void bend(scene::Lattice& lattice) {
    auto places = std::make_shared<std::vector<std::array<float, 3>>>();
    for (const double z : lattice.positions[2]) {
      for (const double y : lattice.positions[1]) {
        for (const double x : lattice.positions[0]) {
          places->push_back({static_cast<float>(x + 0.4 * z), static_cast<float>(y - 0.3 * x),
                             static_cast<float>(z + 0.05 * std::sin(4 * x + 3 * y))});
        }
      }
    }
    lattice.places = places;
  }

  scene::VectorLayer lines(const scene::Lattice& lattice) {
    scene::VectorLayer layer = plain_lines(wave(lattice, whole(2, 3)), {1.0F, 0.9F, 0.2F});
    layer.length = between(0.2, 1.2);
    layer.magnitude_range = {0, between(0.5, 2)};
    layer.opacity = between(0.3, 1);
    layer.r1 = between(0, 1);
    layer.r2 = layer.r1 + between(1, 2);
    layer.span = between(2, 7);
    layer.jitter_center = between(0, 1);
    layer.jitter_stride = between(0, 1);
    layer.head_desaturation = 0.6;
    layer.color_by = static_cast<scene::LineColor>(whole(0, 4));
    layer.color = ramp_color(-0.5, 1, {0.1F, 0.3F, 0.9F}, {1.0F, 0.8F, 0.1F});
    layer.moving = whole(0, 3) == 0;
    layer.motion_cycles = between(-2, 2);
    layer.seed = static_cast<std::uint32_t>(whole(0, 1 << 30));
    layer.stride = whole(0, 3) == 0 ? 2 : 1;
    return layer;
  }
};

}  // namespace

scene::Scene random_scene(std::uint32_t seed, bool inside) { return Maker(seed).make(inside); }

std::vector<double> reference_picture(const scene::Scene& scene, double tolerance) {
  ThreadPool pool(2);
  auto picture = engine::reference::render(scene, pool, CancelToken(), {tolerance});
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(picture->rgba);
}

}  // namespace windsplat::test
