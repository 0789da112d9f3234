// Memory reused between frames carries no state: picture and report of a frame depend on its scene
// only, to the last bit.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/engine/stable_sort.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Scene;

float wave(int c, double x, double y, double z) {
  return static_cast<float>(std::sin(5 * x + c) + std::cos(4 * y - c) * std::sin(3 * z + 1));
}

Scene plain_scene() {
  Scene scene;
  scene.lattice = even_lattice({20, 17, 19}, {0.1, 0.11, 0.09});
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 3, 90, 70, true, 0.4);
  scene.vector = plain_lines(make_volume(scene.lattice, 3, wave), {0.9F, 0.5F, 0.1F});
  scene.vector->length = 0.3;
  scene.vector->jitter_center = 0.5;
  scene.vector->min_magnitude = 0.4;
  scene.vector->magnitude_range = {0, 2};
  scene.scalars.push_back(medium(make_volume(scene.lattice, 1, wave), {0.5F, 0.6F, 0.9F}));
  scene.scalars[0].extinction = {{0, 0}, {2, 3}};
  scene.scalars[0].min_optical_depth = 0.02;
  return scene;
}

// Leaning eastward with height.
void lean(scene::Lattice& lattice, double slope) {
  auto places = std::make_shared<std::vector<std::array<float, 3>>>();
  for (const double z : lattice.positions[2]) {
    for (const double y : lattice.positions[1]) {
      for (const double x : lattice.positions[0]) {
        places->push_back(
            {static_cast<float>(x + slope * z), static_cast<float>(y), static_cast<float>(z)});
      }
    }
  }
  lattice.places = places;
}

class Reuse : public testing::Test {
 protected:
  // Renders with the state of earlier frames and with a fresh one.
  void expect_same(const Scene& scene, const std::string& what) {
    const auto work = engine::render(scene, pool_, cancel_, space_);
    ASSERT_TRUE(work) << what;
    const engine::Rendered alone = render(scene);
    EXPECT_EQ(space_.image().rgba, alone.image.rgba) << what;
    EXPECT_EQ(space_.image().width, alone.image.width) << what;
    EXPECT_EQ(work->samples, alone.work.samples) << what;
    EXPECT_EQ(work->culled, alone.work.culled) << what;
    EXPECT_EQ(work->skipped_vector, alone.work.skipped_vector) << what;
    EXPECT_EQ(work->skipped_scalar, alone.work.skipped_scalar) << what;
    EXPECT_EQ(work->skipped_both, alone.work.skipped_both) << what;
    EXPECT_EQ(work->skipped_bound, alone.work.skipped_bound) << what;
    EXPECT_EQ(work->pixel_updates, alone.work.pixel_updates) << what;
    EXPECT_EQ(work->tiles, alone.work.tiles) << what;
    EXPECT_EQ(text_of(work->variant), text_of(alone.work.variant)) << what;
  }

  using Change = std::pair<std::string, std::function<void(Scene&)>>;

  // Alternates with a plain scene, so that every change also has to be undone.
  void expect_to_show(const std::vector<Change>& changes) {
    const Scene first = plain_scene();
    for (const auto& [what, change] : changes) {
      expect_same(first, "before " + what);
      Scene changed = first;
      change(changed);
      expect_same(changed, what);
      expect_same(changed, what + " again");
    }
  }

  ThreadPool pool_{2};
  CancelToken cancel_;
  engine::RenderSpace space_;
};

TEST_F(Reuse, EverySceneChangeTakesEffectAtOnce) {
  expect_to_show({
      {"the same", [](Scene&) {}},
      {"camera",
       [](Scene& s) {
         s.camera = look({0, 0, 0}, {-1, 0.2, 0.4}, 3, 90, 70, true, 0.4);
       }},
      {"nearby",
       [](Scene& s) {
         s.camera = look({0, 0, 0}, {0, 1, 0}, 0.4, 90, 70, true, 0.4);
       }},
      {"picture",
       [](Scene& s) {
         s.camera = look({0, 0, 0}, {0, 1, 0}, 3, 200, 150, true, 0.4);
       }},
      {"weakest line", [](Scene& s) { s.vector->min_magnitude = 0.9; }},
      {"full magnitude",
       [](Scene& s) {
         s.vector->magnitude_range = {0, 0.7};
       }},
      {"line scale",
       [](Scene& s) {
         s.vector->scale = {1, 0, 0};
       }},
      {"line length", [](Scene& s) { s.vector->length = 0.05; }},
      {"extinction",
       [](Scene& s) {
         s.scalars[0].extinction = {{0.5, 0}, {2, 30}};
       }},
      {"thinnest", [](Scene& s) { s.scalars[0].min_optical_depth = 0.1; }},
      {"stride", [](Scene& s) { s.scalars[0].stride = 2; }},
      {"both strides", [](Scene& s) { s.vector->stride = s.scalars[0].stride = 3; }},
      {"slice",
       [](Scene& s) {
         s.slice = scene::Slice{1, 4};
       }},
      {"another layer",
       [](Scene& s) {
         s.slice = scene::Slice{1, 11};
       }},
      {"no lines", [](Scene& s) { s.vector.reset(); }},
      {"no medium", [](Scene& s) { s.scalars.clear(); }},
      {"slabs", [](Scene& s) { s.method = scene::Method::slab; }},
      {"cells",
       [](Scene& s) {
         for (double& w : s.lattice.spacing[0]) w *= 1.5;
       }},
      {"rates",
       [](Scene& s) {
         s.vector->rate_x.assign(17, 1.0);
         s.vector->rate_z.assign(19, 0.0);
         for (int j = 0; j < 8; ++j) s.vector->rate_x[j] = 0;
         s.vector->rate_y = 0;
       }},
      {"values",
       [](Scene& s) {
         s.scalars[0].field = make_volume(s.lattice, 1, [](int c, double x, double y, double z) {
           return wave(c + 1, x, y, z);
         });
       }},
  });
}

// Data prepared for a different kind of scene must not persist.
TEST_F(Reuse, EverySceneKindTakesEffectAtOnce) {
  expect_to_show({
      {"nothing",
       [](Scene& s) {
         s.vector.reset();
         s.scalars.clear();
       }},
      {"bent", [](Scene& s) { lean(s.lattice, 0.2); }},
      {"bent slabs",
       [](Scene& s) {
         lean(s.lattice, 3);
         s.method = scene::Method::slab;
       }},
      {"orthographic",
       [](Scene& s) {
         s.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 3, 90, 70, false, 1);
       }},
      {"one more medium, of another stride and table",
       [](Scene& s) {
         s.scalars.push_back(s.scalars[0]);
         s.scalars[1].stride = 2;
         s.scalars[1].color = ramp_color(0, 2, {1, 0.4F, 0.1F}, {0.2F, 0.5F, 1});
       }},
      {"one more medium, of more steps",
       [](Scene& s) {
         s.scalars.push_back(s.scalars[0]);
         s.scalars[1].extinction = {{0, 0}, {0.5, 1}, {1, 0}, {2, 4}};
       }},
      {"horizontal lines", [](Scene& s) { s.vector->field = make_volume(s.lattice, 2, wave); }},
      {"lines coloured by a field",
       [](Scene& s) {
         s.vector->color_by = scene::LineColor::scalar;
         s.vector->color_field = s.scalars[0].field;
         s.vector->color = ramp_color(-1, 1, {1, 0.4F, 0.1F}, {0.2F, 0.5F, 1});
       }},
      {"moving lines",
       [](Scene& s) {
         s.vector->moving = true;
         s.vector->motion_cycles = 0.3;
       }},
  });
}

// A step that replaces another often reuses its memory address.
TEST_F(Reuse, NewFieldAtTheSameAddressIsDetected) {
  Scene scene = plain_scene();
  scene.vector.reset();
  for (int step = 0; step < 20; ++step) {
    scene.scalars[0].field.reset();
    scene.scalars[0].field = make_volume(scene.lattice, 1, [&](int, double x, double y, double z) {
      return step % 2 == 0 ? wave(step, x, y, z) : -1.0F;
    });
    expect_same(scene, "step " + std::to_string(step));
  }
}

// Fields with guaranteed reuse of their memory, each with its own owner.
TEST_F(Reuse, FieldWithoutAnOwnerIsReadAgain) {
  data::Volume place = *make_volume(plain_scene().lattice, 1, wave);
  Scene scene = plain_scene();
  scene.vector.reset();
  scene.scalars[0].field = {std::shared_ptr<void>(), &place};
  expect_same(scene, "before");
  for (std::size_t n = 0; n < place.values.size(); ++n) place.values[n] = 0.5F - place.values[n];
  expect_same(scene, "after");
}

TEST_F(Reuse, MoreScenesThanTheCacheHolds) {
  std::vector<Scene> scenes;
  for (int n = 0; n < 20; ++n) {
    scenes.push_back(plain_scene());
    scenes.back().scalars[0].min_optical_depth = 0.01 * (n + 1);
  }
  for (int round = 0; round < 2; ++round) {
    for (std::size_t n = 0; n < scenes.size(); ++n) expect_same(scenes[n], std::to_string(n));
  }
}

// Mostly empty: whole cubes of 8 x 8 x 8 samples are skipped and counted as blank.
TEST_F(Reuse, BlankRegionsAreCountedPerSample) {
  Scene scene;
  scene.lattice = even_lattice({40, 40, 40}, {0.05, 0.05, 0.05});
  std::int64_t dense = 0;
  scene.scalars.push_back(medium(make_volume(scene.lattice, 1,
                                             [&](int, double x, double y, double z) {
                                               const bool inside = x * x + y * y + z * z < 0.09;
                                               dense += inside ? 1 : 0;
                                               return inside ? 3.0F : 0.0F;
                                             }),
                                 {1.0F, 0.7F, 0.2F}));
  for (int turn = 0; turn < 6; ++turn) {
    const double angle = 0.4 * turn;
    scene.camera = look({0, 0, 0}, {std::sin(angle), std::cos(angle), -0.3}, 6, 80, 80, true, 0.4);
    const auto work = engine::render(scene, pool_, cancel_, space_);
    ASSERT_TRUE(work);
    EXPECT_EQ(work->samples, 40 * 40 * 40);
    EXPECT_EQ(work->culled, 0);
    EXPECT_EQ(work->skipped_scalar, 40 * 40 * 40 - dense);
    EXPECT_EQ(work->skipped_both, 40 * 40 * 40 - dense);
    // Partly outside the picture.
    scene.camera =
        look({0.6, 0.2, 0}, {std::sin(angle), std::cos(angle), -0.3}, 2, 80, 80, true, 0.2);
    expect_same(scene, std::to_string(turn));
  }
}

TEST_F(Reuse, CancelledFrameLeavesNoState) {
  const Scene scene = plain_scene();
  expect_same(scene, "before");
  const CancelToken cancelled;
  cancelled.cancel();
  Scene other = scene;
  other.vector->min_magnitude = 1.2;
  EXPECT_FALSE(engine::render(other, pool_, cancelled, space_));
  expect_same(other, "after");
  expect_same(scene, "the first again");
}

TEST(StableSort, KeepsTheOrderOfEqualElements) {
  for (const std::size_t count : {0U, 1U, 7U, 8U, 9U, 16U, 17U, 100U, 1000U}) {
    std::vector<std::pair<int, std::size_t>> items;
    for (std::size_t i = 0; i < count; ++i) items.emplace_back(i * 7919 % 13, i);
    auto expected = items;
    std::sort(expected.begin(), expected.end());
    std::vector<std::pair<int, std::size_t>> spare;
    engine::stable_sort(items, spare,
                        [](const auto& a, const auto& b) { return a.first < b.first; });
    EXPECT_EQ(items, expected) << count;
  }
}

}  // namespace
}  // namespace windsplat::test
