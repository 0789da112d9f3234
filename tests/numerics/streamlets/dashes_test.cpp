// Dashes and marks of chains, by every method.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/numerics/scenes.hpp"
#include "tests/numerics/streamlets/chain_scenes.hpp"

namespace windsplat::test {
namespace {

// Gives every line so many dashes, by its q.
void add_dashes(double dashes, Chains& chains) {
  trace::Segments& to = chains.segments;
  to.turns.assign(to.q.size(), 0);
  for (std::size_t v = 0; v + 1 < to.q.size(); ++v) {
    if (!(to.magnitudes[v] > 0)) continue;
    const double from = dashes * (static_cast<double>(to.q[v]) + 0.5);
    to.phases[v] = static_cast<float>(from - std::floor(from));
    to.turns[v] = static_cast<float>(dashes * static_cast<double>(to.q[v + 1] - to.q[v]));
  }
}

scene::Scene dashed_scene(double dashes, int segments, double cycles, bool perspective) {
  Chains chains;
  chains.add(straight({-0.85, 0, -0.3}, {0.8, 0.4, 0.5}, segments));
  add_dashes(dashes, chains);
  scene::Scene scene = chain_scene(chains, perspective);
  scene.vector->moving = true;
  scene.vector->motion_cycles = cycles;
  scene.vector->head_desaturation = 0;
  return scene;
}

TEST(Dashes, AreTheSameByEveryMethodAndInAnyNumberOfSegments) {
  for (const bool perspective : {false, true}) {
    const auto whole = drawn(dashed_scene(7, 1, 0.3, perspective), scene::Method::reference);
    for (const scene::Method method : methods) {
      // By segments in perspective, dashes are linear in place only within each.
      const double most = perspective ? 0.02 : 4e-3;
      EXPECT_LT(largest_difference(drawn(dashed_scene(7, 8, 0.3, perspective), method), whole),
                most);
      EXPECT_LT(largest_difference(drawn(dashed_scene(7, 1, 0.3, perspective), method), whole),
                4e-3);
    }
  }
}

// W(frac(7 s)) along the middle of a level line across the picture, less the mean over a pixel.
TEST(Dashes, HaveTheProfileOfTheTextureAndMoveTowardsTheHead) {
  Chains chains;
  chains.add(straight({-1, 0, 0}, {1, 0, 0}, 5));
  add_dashes(4, chains);
  scene::Scene scene = chain_scene(chains, false);
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 4, 201, 101, false, 0.505);  // 0.01 a pixel
  scene.vector->moving = true;
  for (const double cycles : {0.0, 0.25, 3.25}) {
    scene.vector->motion_cycles = cycles;
    for (const scene::Method method : methods) {
      const auto picture = drawn(scene, method);
      for (int x = 5; x < 196; x += 3) {
        const double turns = 4 * (x + 0.5 - 0.5) / 200 - cycles;
        const double part = turns - std::floor(turns);
        const double texture = 1 - std::abs(2 * part - 1);
        EXPECT_NEAR(pixel(picture.image, x, 50)[3], 0.75 * texture, 0.012) << x << " " << cycles;
      }
    }
  }
}

TEST(Dashes, ReturnAfterAWholeCycle) {
  for (const scene::Method method : methods) {
    const auto first = drawn(dashed_scene(9, 6, 0, true), method);
    EXPECT_LT(largest_difference(first, drawn(dashed_scene(9, 6, 1, true), method)), 1e-6);
    EXPECT_LT(largest_difference(first, drawn(dashed_scene(9, 6, -3, true), method)), 1e-6);
    EXPECT_GT(largest_difference(first, drawn(dashed_scene(9, 6, 0.5, true), method)), 0.4);
  }
}

// Of more dashes than pixels the mean of the texture remains, whatever the phase.
TEST(Dashes, ThatAreSmallerThanPixelsFadeToTheirMean) {
  for (const scene::Method method : methods) {
    scene::Scene plain = dashed_scene(2000, 40, 0, false);
    plain.vector->moving = false;
    const auto whole = drawn(plain, method);
    for (const double cycles : {0.0, 0.4}) {
      const auto fine = drawn(dashed_scene(2000, 40, cycles, false), method);
      double most = 0;
      for (std::size_t i = 3; i < fine.image.rgba.size(); i += 4) {
        most = std::max(most, std::abs(static_cast<double>(fine.image.rgba[i]) -
                                       0.5 * static_cast<double>(whole.image.rgba[i])));
      }
      EXPECT_LT(most, 0.03);
    }
  }
}

scene::Scene marked_chains(scene::LineShape shape, int segments) {
  Chains chains;
  chains.add(straight({-0.8, 0, -0.3}, {0.8, 0, 0.5}, segments));
  scene::Scene scene = chain_scene(chains, false);
  scene.vector->mark.shape = shape;
  scene.vector->mark.tail_light = shape == scene::LineShape::comet ? 0.15 : 0.7;
  scene.vector->mark.halo = 2.5;
  return scene;
}

// In orthographic views the taper, the light of the tail and the halo of a line are linear along
// it.
TEST(ChainMarks, RunAlongTheWholeLineHoweverManySegmentsItHas) {
  for (const auto shape :
       {scene::LineShape::line, scene::LineShape::taper, scene::LineShape::comet}) {
    const auto whole = drawn(marked_chains(shape, 1), scene::Method::reference);
    for (const scene::Method method : methods) {
      EXPECT_LT(largest_difference(drawn(marked_chains(shape, 1), method), whole), 4e-3);
      // Lit colours are linear within each segment where those of a line are a product.
      EXPECT_LT(largest_difference(drawn(marked_chains(shape, 16), method), whole), 0.05);
      EXPECT_LT(apart_rms(drawn(marked_chains(shape, 16), method), whole), 4e-3);
    }
    auto plain = marked_chains(shape, 16);
    plain.vector->mark = {};
    EXPECT_GT(apart_rms(drawn(plain, scene::Method::slab), whole), 1e-2);
  }
}

TEST(ChainMarks, OfOneSegmentAreThoseOfTheLineOfASample) {
  for (const auto shape : {scene::LineShape::taper, scene::LineShape::comet}) {
    Chains one;
    one.add(straight({-0.6, 0, 0}, {0.6, 0, 0}, 1));
    scene::Scene curved = chain_scene(one, false);
    curved.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
    curved.vector->field = make_volume(
        curved.lattice, 3, [](int c, double, double, double) { return c == 0 ? 1.F : 0.F; });
    curved.vector->length = 1.2;
    curved.vector->mark.shape = shape;
    curved.vector->mark.tail_light = 0.3;
    curved.vector->mark.halo = 2;
    scene::Scene line = curved;
    line.vector->streamlets = nullptr;
    for (const scene::Method method : methods) {
      EXPECT_LT(largest_difference(drawn(curved, method), drawn(line, method)), 0.02);
    }
  }
}

TEST(ChainMarks, OfArcsAreThoseOfTheReference) {
  for (const auto shape : {scene::LineShape::taper, scene::LineShape::comet}) {
    scene::Scene scene = chain_scene(many_arcs(40, 9), true);
    scene.vector->mark.shape = shape;
    scene.vector->mark.tail_light = 0.2;
    scene.vector->mark.halo = 2;
    const auto truth = drawn(scene, scene::Method::reference);
    EXPECT_LT(apart_rms(drawn(scene, scene::Method::slab), truth), 2e-3);
    EXPECT_EQ(largest_difference(drawn(scene, scene::Method::slab, 1),
                                 drawn(scene, scene::Method::slab, 3)),
              0);
  }
}

}  // namespace
}  // namespace windsplat::test
