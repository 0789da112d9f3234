// A globe has no seam: its picture does not depend on the longitude at which the grid begins.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "server/scene/lattice.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using data::AxisKind;
using scene::Scene;

constexpr int columns_around = 18;

struct Globe {
  double first = 0;              // longitude of the first column
  int repeated = 0;              // columns at the end that repeat the first ones
  bool two_dimensional = false;  // longitudes and latitudes by column
  int stride = 1;
};

scene::Lattice place(const Globe& globe) {
  data::Grid grid;
  grid.axes[0].kind = AxisKind::longitude;
  for (int i = 0; i < columns_around + globe.repeated; ++i) {
    grid.axes[0].coordinates.push_back(globe.first + 20 * i);
  }
  grid.axes[1].kind = AxisKind::latitude;
  for (int j = 0; j < 9; ++j) grid.axes[1].coordinates.push_back(20 * (j - 4));
  grid.axes[2].kind = AxisKind::height;
  grid.axes[2].coordinates = {0, 1000, 2000};
  if (globe.two_dimensional) {
    auto columns = std::make_shared<data::Columns>();
    for (const double latitude : grid.axes[1].coordinates) {
      for (const double longitude : grid.axes[0].coordinates) {
        columns->longitude.push_back(longitude);
        columns->latitude.push_back(latitude);
      }
    }
    grid.columns = columns;
  }
  protocol::GeometryView geometry;
  geometry.mapping = protocol::GeometryMapping::sphere;
  auto lattice = scene::place_lattice(grid, geometry);
  if (!lattice) throw std::runtime_error(lattice.error().message);
  return std::move(*lattice);
}

// A medium of constant extinction and lines of a solid rotation.
Scene scene_of(const Globe& globe) {
  Scene scene;
  scene.lattice = place(globe);
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 4, 64, 48, true, 0.3);
  scene.scalars = {medium(uniform(scene.lattice, 2), {0.3F, 0.6F, 1})};
  scene.scalars[0].stride = globe.stride;
  const auto rotation = make_volume(scene.lattice, 3, [](int c, double, double y, double) {
    return static_cast<float>(c == 0 ? std::cos(y) : 0);
  });
  scene.vector = plain_lines(rotation, {1, 0.8F, 0.2F});
  scene.vector->length = 0.3;
  scene.vector->span = 2;
  scene.vector->stride = globe.stride;
  scene.stop_transmittance = 0;
  return scene;
}

std::vector<std::vector<double>> pictures_of(const Globe& globe) {
  Scene scene = scene_of(globe);
  std::vector<std::vector<double>> pictures{reference_picture(scene)};
  for (const scene::Method method : {scene::Method::kernel, scene::Method::slab}) {
    scene.method = method;
    const std::vector<float> rgba = render(scene).image.rgba;
    pictures.emplace_back(rgba.begin(), rgba.end());
  }
  return pictures;
}

void expect_same_pictures(const Globe& a, const Globe& b) {
  const auto some = pictures_of(a);
  const auto others = pictures_of(b);
  for (std::size_t m = 0; m < some.size(); ++m) {
    double most = 0;
    for (std::size_t n = 0; n < some[m].size(); ++n) {
      most = std::max(most, std::abs(some[m][n] - others[m][n]));
    }
    EXPECT_LT(most, 1e-6) << "method " << m;
  }
}

TEST(Meridian, PicturesDoNotDependOnTheFirstLongitude) {
  for (const int stride : {1, 3}) {
    expect_same_pictures({.first = 0, .stride = stride}, {.first = 180, .stride = stride});
  }
}

// The comparison above notices a seam.
TEST(Meridian, PicturesOfOpenLatticesDependOnTheFirstLongitude) {
  std::vector<engine::Rendered> pictures;
  for (const double first : {0.0, 180.0}) {
    Scene scene = scene_of({.first = first});
    scene.lattice.around = 0;
    scene.method = scene::Method::slab;
    pictures.push_back(render(scene));
  }
  EXPECT_GT(largest_difference(pictures[0], pictures[1]), 1e-3);
}

TEST(Meridian, ColumnsThatRepeatTheFirstOnesAreNotDrawnTwice) {
  for (const int repeated : {1, 2}) expect_same_pictures({}, {.repeated = repeated});
}

TEST(Meridian, GridsWithLongitudesByColumnCloseToo) {
  for (const int repeated : {0, 1, 2}) {
    expect_same_pictures({}, {.first = 180, .repeated = repeated, .two_dimensional = true});
  }
}

TEST(Meridian, ReferenceEqualsTheTruth) {
  for (const int repeated : {0, 1}) {
    const Scene scene = scene_of({.repeated = repeated});
    EXPECT_LT(truth::largest_error(reference_picture(scene), truth::integrate(scene)), 1e-5);
  }
}

TEST(Meridian, SliceOfARepeatedColumnIsThatOfTheFirst) {
  std::vector<engine::Rendered> pictures;
  for (const int column : {0, columns_around}) {
    Scene scene = scene_of({.repeated = 1});
    scene.slice = scene::Slice{0, column};
    scene.method = scene::Method::slab;
    pictures.push_back(render(scene));
  }
  EXPECT_LT(largest_difference(pictures[0], pictures[1]), 1e-6);
  EXPECT_GT(pixel(pictures[0].image, 32, 10)[3], 0.01F);
}

}  // namespace
}  // namespace windsplat::test
