// Streamlets: chains of segments, by every method.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "server/trace/streamlets.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/streamlets/chain_scenes.hpp"

namespace windsplat::test {
namespace {

// Ends lie on a grid of 1/1024 pixel, of which the ramp of 2 pixels makes 4e-4.
TEST(Chains, ManySegmentsOfAStraightLineAreOneLine) {
  for (const bool perspective : {false, true}) {
    for (const dvec3& to : {dvec3(0.8, 0, 0), dvec3(0.7, -0.9, 0.4), dvec3(0.1, 0.8, 0.77)}) {
      Chains one, many;
      one.add(straight(-to, to, 1));
      many.add(straight(-to, to, 16));
      for (const scene::Method method : methods) {
        const auto a = drawn(chain_scene(one, perspective), method);
        const auto b = drawn(chain_scene(many, perspective), method);
        EXPECT_LT(largest_difference(a, b), 2e-3) << static_cast<int>(method);
        EXPECT_GT(pixel(a.image, 100, 100)[3], 0.7);
      }
    }
  }
}

// One segment is the straight line that a sample without jitter has.
TEST(Chains, OneSegmentIsTheLineOfASample) {
  for (const bool perspective : {false, true}) {
    Chains one;
    one.add(straight({-0.6, 0, 0}, {0.6, 0, 0}, 1));
    scene::Scene curved = chain_scene(one, perspective);
    curved.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
    curved.vector->field = make_volume(
        curved.lattice, 3, [](int c, double, double, double) { return c == 0 ? 1.F : 0.F; });
    curved.vector->length = 1.2;
    scene::Scene line = curved;
    line.vector->streamlets = nullptr;
    for (const scene::Method method : methods) {
      EXPECT_LT(largest_difference(drawn(curved, method), drawn(line, method)), 2e-3)
          << static_cast<int>(method);
    }
  }
}

// Along an arc the opacity is that of a line everywhere: neither less at a joint nor more.
TEST(Chains, JointsOfAnArcNeitherGapNorOverlap) {
  for (const bool perspective : {false, true}) {
    for (const int segments : {4, 8, 32}) {
      Chains chains;
      chains.add(arc({0, 0, 0}, 0.8, 2, 0.1, segments));
      for (const scene::Method method : methods) {
        const scene::Scene scene = chain_scene(chains, perspective);
        const auto image = drawn(scene, method).image;
        float most = 0;
        for (int y = 0; y < 200; ++y) {
          for (int x = 0; x < 200; ++x) most = std::max(most, pixel(image, x, y)[3]);
        }
        EXPECT_LE(most, 0.75F + 1e-5F);
        // The pixels next to the curve of the segments.
        const auto points = arc({0, 0, 0}, 0.8, 2, 0.1, segments);
        for (std::size_t n = 0; n + 1 < points.size(); ++n) {
          for (double part = 0; part <= 1; part += 0.02) {
            const dvec3 at = points[n] + part * (points[n + 1] - points[n]) - scene.camera.eye;
            const double z = perspective ? glm::dot(at, scene.camera.forward) : 1;
            const double scale = 100 / scene.camera.half_height / z;
            const int x = static_cast<int>(100 + scale * glm::dot(at, scene.camera.right));
            const int y = static_cast<int>(100 - scale * glm::dot(at, scene.camera.up));
            EXPECT_GE(pixel(image, x, y)[3], 0.749F) << n << " " << part;
          }
        }
      }
    }
  }
}

TEST(Chains, SlabsOfLinesAloneAreTheReference) {
  for (const bool perspective : {false, true}) {
    const scene::Scene scene = chain_scene(many_arcs(60, 3), perspective);
    const auto slab = drawn(scene, scene::Method::slab);
    const auto truth = drawn(scene, scene::Method::reference);
    double sum = 0;
    for (std::size_t i = 0; i < slab.image.rgba.size(); ++i) {
      const double apart = static_cast<double>(slab.image.rgba[i] - truth.image.rgba[i]);
      sum += apart * apart;
    }
    EXPECT_LT(std::sqrt(sum / static_cast<double>(slab.image.rgba.size())), 1e-3);
  }
}

TEST(Chains, AreTheSameWithAnyNumberOfThreads) {
  const scene::Scene scene = chain_scene(many_arcs(80, 5), true);
  for (const scene::Method method : methods) {
    EXPECT_EQ(largest_difference(drawn(scene, method, 1), drawn(scene, method, 4)), 0);
  }
}

// From within the volume, with segments on both sides of the near plane.
TEST(Chains, EndAtTheNearPlane) {
  scene::Scene scene = chain_scene(many_arcs(100, 7), true);
  scene.camera = look({0, 0, 0}, {0.2, 1, 0.1}, 0.01, 200, 200, true, 0.6);
  scene.camera.near = 0.01;
  const auto slab = drawn(scene, scene::Method::slab);
  const auto truth = drawn(scene, scene::Method::reference);
  double sum = 0;
  for (std::size_t i = 0; i < slab.image.rgba.size(); ++i) {
    ASSERT_TRUE(std::isfinite(slab.image.rgba[i]));
    sum += std::abs(static_cast<double>(slab.image.rgba[i] - truth.image.rgba[i]));
  }
  EXPECT_LT(sum / static_cast<double>(slab.image.rgba.size()), 1e-3);
}

// In a medium, each method has the error that it has for straight lines.
TEST(Chains, InAMediumApproachTheReference) {
  scene::Scene scene = chain_scene(many_arcs(60, 11), true, 48);
  scene.lattice = even_lattice({10, 10, 10}, {0.2, 0.2, 0.2});
  scene.vector->field =
      make_volume(scene.lattice, 3, [](int, double, double, double) { return 1.F; });
  scene.scalars.push_back(medium(make_volume(scene.lattice, 1,
                                             [](int, double x, double y, double z) {
                                               return static_cast<float>(
                                                   std::exp(-2 * (x * x + y * y + z * z)));
                                             }),
                                 {0.9F, 0.3F, 0.1F}, 1));
  const auto truth = drawn(scene, scene::Method::reference).image;
  const auto error = [&](scene::Method method, double thickness) {
    scene.slab_thickness = thickness;
    const auto image = drawn(scene, method).image;
    double sum = 0;
    for (std::size_t i = 0; i < image.rgba.size(); ++i) {
      const double apart = static_cast<double>(image.rgba[i] - truth.rgba[i]);
      sum += apart * apart;
    }
    return std::sqrt(sum / static_cast<double>(image.rgba.size()));
  };
  EXPECT_LT(error(scene::Method::slab, 1), 2e-3);
  EXPECT_LT(error(scene::Method::slab, 0.25), 1e-3);
  EXPECT_LT(error(scene::Method::kernel, 1), 3e-2);
}

// The streamlets of a uniform field are the straight lines of its samples where these stay within
// the lattice, with their jitter,
// colours and phases.
scene::Scene uniform_scene(scene::LineColor by) {
  scene::Scene scene;
  scene.lattice = even_lattice({6, 6, 6}, {0.3, 0.3, 0.3});
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 5, 160, 160, true, 0.25);
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [](int c, double, double, double) {
                                           return c == 0 ? 3.F : (c == 1 ? -2.F : 1.F);
                                         }),
                             {1, 1, 1});
  scene::VectorLayer& layer = *scene.vector;
  layer.length = 0.2;
  layer.magnitude_range = {1, 5};
  layer.magnitude_intensity = 0.6;
  layer.opacity = 0.7;
  layer.head_desaturation = 0.7;
  layer.jitter_center = 0.2;
  layer.jitter_stride = 0.1;
  layer.color_by = by;
  const bool degrees = by == scene::LineColor::direction;
  const double top = degrees ? 360 : by == scene::LineColor::magnitude ? 6 : 0.9;
  layer.color = ramp_color(degrees                        ? 0
                           : by == scene::LineColor::rise ? -0.05
                                                          : -0.9,
                           top, {0.1F, 0.9F, 0.2F}, {0.9F, 0.1F, 0.7F});
  layer.moving = true;
  layer.motion_cycles = 0.3;
  scene.depth_cue = {0.5, 4, 6};
  return scene;
}

trace::Streamlets streamlets_of(const scene::Scene& scene) {
  const scene::VectorLayer& layer = *scene.vector;
  trace::Streamlets of;
  of.flow.dims = scene.lattice.dims;
  for (std::size_t a = 0; a < 3; ++a) {
    of.flow.components[a] = layer.field->component(static_cast<int>(a));
    of.flow.positions[a] = scene.lattice.positions[a];
    of.flow.spacing[a] = scene.lattice.spacing[a];
    of.drawn[a] = scene.lattice.dims[a];
  }
  if (scene.lattice.places) of.flow.places = scene.lattice.places->data();
  of.length = layer.length;
  of.full_magnitude = layer.magnitude_range[1];
  of.least_magnitude = layer.min_magnitude;
  of.jitter_center = layer.jitter_center;
  of.jitter_stride = layer.jitter_stride;
  of.stride = layer.stride;
  of.seed = layer.seed;
  of.color = [&](const dvec3&, const trace::Motion& motion) {
    switch (layer.color_by) {
      case scene::LineColor::magnitude:
        return motion.magnitude;
      case scene::LineColor::direction: {
        const double degrees = std::atan2(motion.drawn.x, motion.drawn.y) * 180 / pi;
        return degrees < 0 ? degrees + 360 : degrees;
      }
      default:
        return 0.0;
    }
  };
  return of;
}

TEST(Streamlets, OfAUniformFieldAreItsStraightLines) {
  for (const auto by : {scene::LineColor::magnitude, scene::LineColor::direction,
                        scene::LineColor::screen_z, scene::LineColor::constant}) {
    const scene::Scene straight = uniform_scene(by);
    scene::Scene curved = straight;
    const trace::Segments segments = trace::make_segments(streamlets_of(straight));
    EXPECT_EQ(segments.tally.lines, 216);
    EXPECT_EQ(segments.tally.segments, 216);  // one each
    curved.vector->streamlets = std::make_shared<const trace::Segments>(segments);
    for (const scene::Method method : methods) {
      EXPECT_LT(largest_difference(drawn(straight, method), drawn(curved, method)), 3e-3)
          << static_cast<int>(method) << " " << static_cast<int>(by);
    }
  }
}

TEST(Streamlets, WeakOnesAreLeftOutAndBounded) {
  scene::Scene scene = uniform_scene(scene::LineColor::constant);
  scene.vector->field = make_volume(scene.lattice, 3, [](int c, double x, double, double) {
    return c == 0 ? (x < 0 ? 1.F : 4.F) : 0.F;
  });
  scene.vector->min_magnitude = 2;
  scene::Scene all = scene;
  all.vector->min_magnitude = 0;
  scene.vector->streamlets =
      std::make_shared<const trace::Segments>(trace::make_segments(streamlets_of(scene)));
  all.vector->streamlets =
      std::make_shared<const trace::Segments>(trace::make_segments(streamlets_of(all)));
  EXPECT_EQ(scene.vector->streamlets->tally.lines, 108);
  const auto some = drawn(scene, scene::Method::slab);
  const auto whole = drawn(all, scene::Method::slab);
  double change = 0;
  for (std::size_t i = 0; i < some.image.rgba.size(); i += 4) {
    double most = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      most = std::max(most, std::abs(static_cast<double>(some.image.rgba[i + c]) -
                                     static_cast<double>(whole.image.rgba[i + c])));
    }
    change += most;
  }
  change /= 160 * 160;
  EXPECT_GT(change, 1e-3);
  EXPECT_GE(some.work.skipped_bound, change);
  EXPECT_LT(some.work.skipped_bound, 20 * change);
}

}  // namespace
}  // namespace windsplat::test
