// Oblique planes and layers between layers: closed forms of linear fields, masks, limits, and the
// pictures of layers.
#include "server/scene/section.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "protocol/view/shown.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/lattice.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/slices/planes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::GridAxis;
using protocol::PlaneView;
using protocol::SliceView;
using protocol::Vec3;
using protocol::View;

// The direction of the lattice of a plane along an axis with two samples or more.
glm::dvec3 direction(const Scene& scene, int axis) {
  std::size_t step = 1;
  for (int a = 0; a < axis; ++a) step *= static_cast<std::size_t>(scene.lattice.dims[a]);
  return glm::normalize(place(scene, step) - place(scene, 0));
}

class Oblique : public testing::TestWithParam<Vec3> {};

// A linear field is interpolated exactly, except in the outer half of the outermost cells, where it
// is constant.
TEST_P(Oblique, LinearFieldsAreExact) {
  auto dataset = dataset_with(box_grid(true), linear);
  const Vec3 point{0.1, -0.05, 0.2};
  const Vec3 normal = GetParam();
  const Scene scene = built(plane_view(point, normal), *dataset);
  const Lattice whole = place_lattice(dataset->info().grid, {}).value();
  const glm::dvec3 n = glm::normalize(glm::dvec3(normal[0], normal[1], normal[2]));
  ASSERT_TRUE(scene.slice);
  const int layer = scene.slice->axis;
  ASSERT_EQ(scene.lattice.dims[layer], 1);
  const int u = layer == 0 ? 1 : 0;
  const int v = layer == 2 ? 1 : 2;
  const data::Volume& cloud = *scene.scalars.at(0).field;
  const data::Volume& wind = *scene.vector->field;
  int inner = 0;
  for (std::size_t i = 0; i < cloud.samples(); ++i) {
    const glm::dvec3 at = place(scene, i);
    EXPECT_NEAR(glm::dot(n, at - glm::dvec3(point[0], point[1], point[2])), 0, 1e-6);
    bool in_box = true;
    bool among_samples = true;
    for (int a = 0; a < 3; ++a) {
      in_box = in_box && at[a] >= whole.box_min[a] - 1e-6 && at[a] <= whole.box_max[a] + 1e-6;
      among_samples = among_samples && at[a] >= whole.positions[a].front() &&
                      at[a] <= whole.positions[a].back();
    }
    EXPECT_EQ(std::isnan(cloud.values[i]), !in_box);
    EXPECT_EQ(std::isnan(wind.values[i]), !in_box);
    if (!among_samples) continue;
    ++inner;
    const double value = linear(at);
    EXPECT_NEAR(cloud.values[i], value, 3e-6);
    const glm::dvec3 vector(value, value + 1, value + 2);
    for (const int a : {u, v}) {
      EXPECT_NEAR(wind.component(a)[i], glm::dot(vector, direction(scene, a)), 2e-5);
    }
    EXPECT_NEAR(std::abs(wind.component(layer)[i]), std::abs(glm::dot(vector, n)), 2e-5);
  }
  EXPECT_GE(inner, 12);
}

INSTANTIATE_TEST_SUITE_P(Normals, Oblique,
                         testing::Values(Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, -3, 0},
                                         Vec3{1, 1, 0}, Vec3{1, 0, 1}, Vec3{0.3, -0.5, 0.8},
                                         Vec3{-1, 2, 0.1}));

TEST(Plane, DoesNotDependOnTheLengthOfTheNormal) {
  auto dataset = dataset_with(box_grid(true), linear);
  const Scene one = built(plane_view({0, 0, 0.1}, {0.3, -0.5, 0.8}), *dataset);
  for (const double factor : {2e-6, 3.7, 1e5, -1.0}) {
    const Scene other =
        built(plane_view({0, 0, 0.1}, {0.3 * factor, -0.5 * factor, 0.8 * factor}), *dataset);
    const auto same = test::largest_difference(test::render(one), test::render(other));
    EXPECT_LE(same, 1e-4F) << factor;
  }
}

// Places of samples, masks and shares: where any sample with a share is masked.
TEST(Plane, SamplesNextToAMaskedOneAreMasked) {
  const Lattice whole = place_lattice(box_grid(false), {}).value();
  const glm::dvec3 hole(whole.positions[0][4], whole.positions[1][3], whole.positions[2][2]);
  auto dataset = dataset_with(box_grid(false), [&](const glm::dvec3& at) {
    const bool masked = glm::length(at - hole) < 1e-9;
    return masked ? std::numeric_limits<double>::quiet_NaN() : linear(at);
  });
  const Scene scene = built(plane_view({0.02, 0.03, 0.05}, {0.2, 0.3, 1}), *dataset);
  const data::Volume& cloud = *scene.scalars.at(0).field;
  int masked = 0;
  for (std::size_t i = 0; i < cloud.samples(); ++i) {
    const glm::dvec3 at = place(scene, i);
    bool shares = true;
    bool in_box = true;
    for (int a = 0; a < 3; ++a) {
      shares = shares && std::abs(at[a] - hole[a]) < whole.spacing[a][0] * (1 - 1e-6);
      in_box = in_box && at[a] >= whole.box_min[a] && at[a] <= whole.box_max[a];
    }
    EXPECT_EQ(std::isnan(cloud.values[i]), shares || !in_box) << i;
    masked += shares ? 1 : 0;
  }
  EXPECT_GE(masked, 2);
}

std::string refusal(const View& view, data::Dataset& dataset) {
  const auto completed = complete(view, dataset);
  const auto outlined = outline(view, dataset);
  EXPECT_EQ(completed.has_value(), outlined.has_value());
  if (completed) return "";
  EXPECT_EQ(completed.error().kind, ErrorKind::invalid);
  return completed.error().at.at(0).pointer + ": " + completed.error().message;
}

TEST(Plane, IsRefusedWithItsReason) {
  using testing::AllOf;
  using testing::HasSubstr;
  auto dataset = dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(), std::vector<data::FieldInfo>{wind_info(), scalar_info("cloud", "1")}, 1));
  EXPECT_EQ(refusal(plane_view({0, 0, 0}, {1, 2, 3}), *dataset), "");
  EXPECT_THAT(
      refusal(plane_view({0, 0, 5}, {0, 0, 1}), *dataset),
      AllOf(HasSubstr("/geometry/plane/point"), HasSubstr("misses the box"),
            HasSubstr("(-1, -0.75, -0.15) to (1, 0.75, 0.15)"), HasSubstr("move the point")));
  View both = plane_view({0, 0, 0}, {0, 0, 1});
  both.geometry.slice = SliceView{GridAxis::z, 1};
  EXPECT_THAT(refusal(both, *dataset),
              AllOf(HasSubstr("/geometry/plane"), HasSubstr("not both"), HasSubstr("null")));
  View sphere = plane_view({0, 0, 0}, {0, 0, 1});
  sphere.geometry.mapping = protocol::GeometryMapping::sphere;
  EXPECT_THAT(refusal(sphere, *dataset),
              AllOf(HasSubstr("mapping flat"), HasSubstr("geometry.slice")));
  View raised = plane_view({0, 0, 0}, {0, 0, 1});
  raised.geometry.height_field = "cloud";
  EXPECT_THAT(refusal(raised, *dataset),
              AllOf(HasSubstr("heightField"), HasSubstr("geometry.slice")));
}

TEST(Plane, HasALimitedNumberOfSamples) {
  Lattice lattice = test::even_lattice({3000, 3000, 2}, {1e-3, 1e-3, 1e-3});
  protocol::GeometryView geometry;
  geometry.plane = PlaneView{{0, 0, 0}, {0, 0, 1}};
  const auto refused = make_section(geometry, lattice);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("4194304"));
  geometry.plane->normal = {1, 0, 0};
  EXPECT_TRUE(make_section(geometry, lattice));
}

// ---- pictures of layers ----

constexpr std::array<protocol::ColorBy, 7> all_colors{
    protocol::ColorBy::world_z,   protocol::ColorBy::screen_z,  protocol::ColorBy::rise,
    protocol::ColorBy::magnitude, protocol::ColorBy::direction, protocol::ColorBy::scalar,
    protocol::ColorBy::constant};

double waves(const glm::dvec3& at) {
  return std::sin(3 * at.x + 1) + std::cos(4 * at.y) * std::sin(5 * at.z);
}

// Lines without jitter, whose random numbers depend on the index of the layer.
View layer_view(protocol::ColorBy by) {
  View view = plane_view({0, 0, 0}, {0, 0, 1});
  view.geometry.plane.reset();
  view.vector.jitter.center = view.vector.jitter.stride = 0;
  view.vector.color.by = by;
  view.vector.color.field = "cloud";
  view.vector.combine = protocol::LineCombination::either;
  view.vector.magnitude_range = protocol::Range{0, 3};
  view.vector.color.range =
      by == protocol::ColorBy::direction ? protocol::Range{0, 360} : protocol::Range{-0.5, 2};
  view.vector.scale = {1, 0.5, 2};
  view.camera.eye = Vec3{-2, -2.5, 2};
  // Nearly one colour: splats at one depth may be composited in another order.
  view.scalars->front().color.range = protocol::Range{-1000, 1000};
  return view;
}

TEST(Plane, ThroughALayerEqualsTheLayer) {
  auto dataset = dataset_with(box_grid(false), waves);
  const Lattice whole = place_lattice(dataset->info().grid, {}).value();
  for (std::size_t a = 0; a < 3; ++a) {
    for (const protocol::ColorBy by : all_colors) {
      View view = layer_view(by);
      view.geometry.slice = SliceView{static_cast<GridAxis>(a), 2};
      const Scene slice = built(view, *dataset);
      view.geometry.slice.reset();
      view.geometry.plane = PlaneView{};
      view.geometry.plane->normal = {a == 0 ? 2.0 : 0, a == 1 ? 2.0 : 0, a == 2 ? 2.0 : 0};
      view.geometry.plane->point = {0, 0, 0};
      view.geometry.plane->point.at(a) = whole.positions[a][2];
      Scene plane = built(view, *dataset);
      EXPECT_EQ(plane.lattice.dims, slice.slice->axis == 0   ? (std::array{1, 7, 5})
                                    : slice.slice->axis == 1 ? (std::array{9, 1, 5})
                                                             : (std::array{9, 7, 1}));
      for (const Method method : {Method::kernel, Method::slab}) {
        Scene expected = slice;
        expected.method = plane.method = method;
        expected.stop_transmittance = plane.stop_transmittance = 0;
        const auto picture = test::render(expected);
        ASSERT_GT(test::pixel(picture.image, 60, 45)[3], 0.05);
        EXPECT_LE(test::largest_difference(picture, test::render(plane)), 2e-3F)
            << "axis " << a << " colour " << static_cast<int>(by);
      }
    }
  }
}

// Lines and the opacity of a medium; the order of coplanar lines does not matter with `or`.
TEST(Plane, EqualsTheReferenceOnEveryInstructionSet) {
  auto dataset = dataset_with(box_grid(true), waves);
  View view = plane_view({0.1, 0, -0.1}, {0.4, -0.5, 0.7});
  view.vector.combine = protocol::LineCombination::either;
  view.image.width = 60;
  view.image.height = 45;
  Scene lines = built(view, *dataset);
  lines.stop_transmittance = 0;
  Scene medium = lines;
  lines.scalars.clear();
  medium.vector.reset();
  const auto expected_lines = test::reference_picture(lines);
  const auto expected_medium = test::reference_picture(medium);
  for (const Method method : {Method::kernel, Method::slab}) {
    lines.method = medium.method = method;
    for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
      const auto drawn_lines = test::render_with(*table, lines);
      const auto drawn_medium = test::render_with(*table, medium);
      double most = 0;
      for (std::size_t i = 0; i < expected_lines.size(); ++i) {
        const auto value = static_cast<double>(drawn_lines.image.rgba[i]);
        ASSERT_NEAR(value, expected_lines[i], 2e-4) << table->name;
        most = std::max(most, value);
        if (i % 4 != 3) continue;
        ASSERT_NEAR(drawn_medium.image.rgba[i], expected_medium[i], 1e-5) << table->name;
      }
      EXPECT_GT(most, 0.05);
    }
    EXPECT_EQ(test::render(lines, 1).image.rgba, test::render(lines, 3).image.rgba);
    EXPECT_EQ(test::render(medium, 1).image.rgba, test::render(medium, 3).image.rgba);
  }
}

// An index that rounding does not tell from a layer is interpolated to that layer.
TEST(Between, AtALayerEqualsTheLayer) {
  auto dataset = dataset_with(box_grid(false), waves);
  for (const GridAxis axis : {GridAxis::x, GridAxis::y, GridAxis::z}) {
    for (const protocol::ColorBy by : all_colors) {
      View view = layer_view(by);
      view.geometry.slice = SliceView{axis, 2};
      const auto layer = test::render(built(view, *dataset));
      view.geometry.slice->index = 2 + 1e-12;
      EXPECT_TRUE(protocol::is_section(view.geometry));
      EXPECT_LE(test::largest_difference(layer, test::render(built(view, *dataset))), 1e-5F);
    }
  }
}

TEST(Between, ValuesAndPositionsAreInterpolated) {
  auto dataset = dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(), std::vector<data::FieldInfo>{wind_info(), scalar_info("cloud", "1")}, 1));
  View view = plane_view({0, 0, 0}, {0, 0, 1});
  view.geometry.plane.reset();
  view.vector.space = protocol::VectorSpace::world;
  for (const auto mapping : {protocol::GeometryMapping::flat, protocol::GeometryMapping::sphere}) {
    view.geometry.mapping = mapping;
    view.geometry.slice.reset();
    const Scene whole = built(view, *dataset);
    view.geometry.slice = SliceView{GridAxis::y, 1.25};
    const Scene between = built(view, *dataset);
    ASSERT_EQ(between.lattice.dims, (std::array{4, 1, 3}));
    EXPECT_EQ(between.slice->axis, 1);
    const auto mean = [](double below, double above) { return 0.75 * below + 0.25 * above; };
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t at = 4 * k + i;
        const std::size_t below = 4 * (3 * k + 1) + i;
        const std::size_t above = below + 4;
        // Values ascend by 1 with each sample.
        EXPECT_NEAR(between.scalars[0].field->values[at], static_cast<double>(below) + 1, 1e-5);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(between.vector->field->component(c)[at],
                      100.0 * c + static_cast<double>(below) + 1, 1e-4);
          if (!whole.lattice.places) continue;
          const auto side = static_cast<std::size_t>(c);
          EXPECT_NEAR(
              (*between.lattice.places)[at][side],
              mean((*whole.lattice.places)[below][side], (*whole.lattice.places)[above][side]),
              1e-6);
        }
      }
    }
    EXPECT_NEAR(between.lattice.positions[1].at(0),
                mean(whole.lattice.positions[1][1], whole.lattice.positions[1][2]), 1e-12);
    ASSERT_EQ(between.vector->rate_x.size(), 1U);
    EXPECT_NEAR(between.vector->rate_x[0], mean(whole.vector->rate_x[1], whole.vector->rate_x[2]),
                1e-12);
    EXPECT_EQ(between.vector->rate_z.size(), 3U);
  }
  view.geometry.slice->index = 2.01;
  EXPECT_THAT(refusal(view, *dataset), testing::HasSubstr("0 to 2"));
}

}  // namespace
}  // namespace windsplat::scene
