// What pictures show of a ground is kept between frames: nothing is painted twice, and no pixel
// depends on it.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "server/engine/render.hpp"
#include "server/ground/paint.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::BodyShape;
using scene::Scene;

// Counts the places that are looked up.
class CountedMap : public ground::Map {
 public:
  CountedMap(std::shared_ptr<const ground::Map> map, std::shared_ptr<std::atomic<int>> lookups)
      : map_(std::move(map)), lookups_(std::move(lookups)) {}
  [[nodiscard]] ground::Located locate(const glm::dvec3& point) const override {
    ++*lookups_;
    return map_->locate(point);
  }
  [[nodiscard]] glm::dvec3 up(const glm::dvec3& point) const override { return map_->up(point); }
  void identify(ground::Identity& to) const override { map_->identify(to); }

 private:
  std::shared_ptr<const ground::Map> map_;
  std::shared_ptr<std::atomic<int>> lookups_;
};

std::shared_ptr<const ground::Map> world_map(double east = 180) {
  return std::make_shared<ground::AxesMap>(ground::Axis{{-180, east}, {-1, 1}},
                                           ground::Axis{{-90, 90}, {-0.5, 0.5}});
}

std::shared_ptr<const terrain::Terrain> hills(float height) {
  std::vector<terrain::Terrain::Vertex> vertices;
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 17; ++i) {
      const float x = -1 + 0.125F * static_cast<float>(i);
      const float y = -0.5F + 0.125F * static_cast<float>(j);
      vertices.push_back({x, y, height * std::cos(7 * x) * std::cos(5 * y)});
    }
  }
  return std::make_shared<terrain::Terrain>(std::move(vertices), 17, terrain::Base::map);
}

ground::Style colors() {
  ground::Style style;
  style.land = {0.3, 0.2, 0.1};
  style.sea = {0.05, 0.1, 0.3};
  style.line = {0.9, 0.8, 0.7};
  style.graticule = 10;
  return style;
}

class KeptGround : public ::testing::Test {
 protected:
  void paint(const ground::Style& style, std::shared_ptr<const ground::Map> map, Scene& scene) {
    scene.body->paint = std::make_shared<ground::Paint>(
        std::make_shared<CountedMap>(std::move(map), lookups_), style);
  }
  Scene oblique(int width = 200, int height = 140) {
    Scene scene;
    scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
    scene.camera = look({0.1, 0.2, 0}, glm::normalize(glm::dvec3(0.2, 0.8, -0.7)), 2, width, height,
                        true, 0.2);
    scene.body = scene::Body{};
    scene.body->shape = BodyShape::ground;
    scene.body->low = {-1, -0.5};
    scene.body->high = {1, 0.5};
    paint(colors(), world_map(), scene);
    return scene;
  }
  engine::Image draw(const Scene& scene, engine::RenderSpace& space, unsigned threads = 1) {
    ThreadPool pool(threads);
    EXPECT_TRUE(engine::render(scene, pool, CancelToken(), space));
    return space.image();
  }
  // The number of lookups of a frame.
  int painted(const Scene& scene, engine::RenderSpace& space) {
    *lookups_ = 0;
    draw(scene, space);
    return *lookups_;
  }
  std::shared_ptr<std::atomic<int>> lookups_ = std::make_shared<std::atomic<int>>(0);
};

TEST_F(KeptGround, IsPaintedOnceForACamera) {
  engine::RenderSpace space;
  const engine::Image first = draw(oblique(), space);
  EXPECT_GT(*lookups_, 1000);
  // Each frame has a scene of its own.
  *lookups_ = 0;
  EXPECT_EQ(draw(oblique(), space).rgba, first.rgba);
  EXPECT_EQ(*lookups_, 0);
  EXPECT_EQ(draw(oblique(), space, 3).rgba, first.rgba);
  EXPECT_EQ(*lookups_, 0);
}

TEST_F(KeptGround, OfSeveralViewersIsKept) {
  engine::RenderSpace space;
  Scene other = oblique();
  other.camera.eye.x += 0.1;
  const engine::Image first = draw(oblique(), space);
  const engine::Image second = draw(other, space);
  *lookups_ = 0;
  EXPECT_EQ(draw(oblique(), space).rgba, first.rgba);
  EXPECT_EQ(draw(other, space).rgba, second.rgba);
  EXPECT_EQ(*lookups_, 0);
}

TEST_F(KeptGround, IsPaintedAnewForWhateverChangesIt) {
  ground::Style warm = colors();
  warm.land = {0.5, 0.2, 0.1};
  const std::vector<std::function<void(Scene&)>> changes{
      [](Scene& s) { s.camera.eye.z += 1e-6; },
      [](Scene& s) { s.camera.half_height *= 1.001; },
      [](Scene& s) { s.camera.perspective = false; },
      [](Scene& s) { s.body->height = -0.01; },
      [](Scene& s) { s.body->high.x = 0.9; },
      [](Scene& s) {
        s.body->color = {1, 0, 0};
      },
      [&](Scene& s) { paint(warm, world_map(), s); },
      [&](Scene& s) { paint(colors(), world_map(170), s); },
      [](Scene& s) { s.body->terrain = hills(0.05F); }};
  for (const auto& change : changes) {
    engine::RenderSpace space;
    draw(oblique(), space);
    Scene changed = oblique();
    change(changed);
    EXPECT_EQ(draw(changed, space).rgba, render(changed).image.rgba);
  }
}

// Both kinds of blocks: of terrain before the map, and of the map beside it.
TEST_F(KeptGround, OfTerrainHasTheSamePixels) {
  Scene scene = oblique();
  scene.body->shape = BodyShape::terrain;
  scene.body->terrain = hills(0.1F);
  engine::RenderSpace space;
  const engine::Image first = draw(scene, space);
  *lookups_ = 0;
  EXPECT_EQ(draw(scene, space).rgba, first.rgba);
  EXPECT_EQ(*lookups_, 0);
  Scene other = oblique();
  other.body->shape = BodyShape::terrain;
  other.body->terrain = hills(0.12F);
  EXPECT_EQ(draw(other, space).rgba, render(other).image.rgba);
}

// Blocks beyond the limit are painted in every frame.
TEST_F(KeptGround, EndsAtItsLimit) {
  engine::RenderSpace whole;
  const Scene scene = oblique(600, 400);
  const engine::Image first = draw(scene, whole);
  const int all = *lookups_;
  EXPECT_EQ(painted(scene, whole), 0);
  for (const std::size_t limit : {std::size_t{0}, std::size_t{400'000}}) {
    engine::RenderSpace space;
    space.limit_grounds(limit);
    draw(scene, space);
    const int again = painted(scene, space);
    EXPECT_GT(again, 0);
    EXPECT_LE(again, all);
    EXPECT_EQ(space.image().rgba, first.rgba);
    EXPECT_LE(space.ground_bytes(), limit);
  }
}

// Of a block with room for its surface but not for its colours, the second frame paints the slope.
TEST_F(KeptGround, OfTerrainHasTheSamePixelsAtAnyLimit) {
  Scene scene = oblique(300, 200);
  scene.body->shape = BodyShape::terrain;
  scene.body->terrain = hills(0.1F);
  const engine::Image expected = render(scene).image;
  for (std::size_t limit = 50'000; limit < 1'500'000; limit += 75'000) {
    engine::RenderSpace space;
    space.limit_grounds(limit);
    draw(scene, space);
    EXPECT_EQ(draw(scene, space).rgba, expected.rgba) << limit;
  }
}

}  // namespace
}  // namespace windsplat::test
