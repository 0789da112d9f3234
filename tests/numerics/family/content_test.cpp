// What a view shows, for scenes of which it is known.
#include "server/frame/content.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/family/family.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

// Twice the extinction is twice the optical depth of a cell and of the rays; lengths are in heights
// of the picture, so that its size makes no difference.
TEST(Content, FollowsExtinctionAndNotTheSizeOfThePicture) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  protocol::View view = random_view(*dataset, 31, 0);
  const auto content = [&] {
    const auto completed = scene::complete(view, *dataset).value();
    return frame::content_of(scene::build_scene(completed, *dataset).value()).value();
  };
  for (auto& point : *view.scalars->front().extinction) point[1] *= 1e-4;
  const quality::Content thin = content();
  for (auto& point : *view.scalars->front().extinction) point[1] *= 2;
  const quality::Content twice = content();
  EXPECT_NEAR(twice.cell_depth / thin.cell_depth, 2, 1e-3);
  EXPECT_NEAR(twice.depth / thin.depth, 2, 1e-2);
  EXPECT_NEAR(twice.step / thin.step, 2, 1e-2);
  EXPECT_NEAR(twice.cell, thin.cell, 1e-6);
  view.image.width *= 2;
  view.image.height *= 2;
  const quality::Content large = content();
  EXPECT_NEAR(large.cell / twice.cell, 1, 1e-6);
  EXPECT_NEAR(large.step / twice.step, 1, 1e-6);
}

// Layers of terrain may coincide in some columns, so that edges of cells have no length.
TEST(Content, IsFiniteWhereLayersCoincide) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  const auto completed = scene::complete(random_view(*dataset, 31, 0), *dataset).value();
  scene::Scene scene = scene::build_scene(completed, *dataset).value();
  const auto& [nx, ny, nz] = scene.lattice.dims;
  ASSERT_GT(nz, 3);
  auto places = std::make_shared<std::vector<std::array<float, 3>>>();
  for (int n = 0; n < nx * ny * nz; ++n) {
    const int k = n / (nx * ny);
    const bool joined = n % nx < nx / 2;
    const auto at = [&](int axis, int i) {
      return static_cast<float>(scene.lattice.positions[axis][static_cast<std::size_t>(i)]);
    };
    places->push_back({at(0, n % nx), at(1, n / nx % ny), at(2, joined ? k / 2 * 2 : k)});
  }
  scene.lattice.places = places;
  const quality::Content content = frame::content_of(scene).value();
  for (const double value :
       {content.lines, content.shade, content.line_depth, content.depth, content.cell_depth,
        content.tint, content.cell, content.step, content.order, content.step_cell}) {
    EXPECT_TRUE(std::isfinite(value)) << value;
  }
  for (const double bend : content.bends) EXPECT_TRUE(std::isfinite(bend)) << bend;
  for (const double shift : content.shifts) EXPECT_TRUE(std::isfinite(shift)) << shift;
  EXPECT_GT(content.step, 0);
}

// At a step of the extinction a value has that of the second point, as in pictures.
TEST(Content, AValueAtAStepIsAsDenseAsItIsDrawn) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  const auto completed = scene::complete(random_view(*dataset, 31, 0), *dataset).value();
  scene::Scene scene = scene::build_scene(completed, *dataset).value();
  ASSERT_EQ(scene.scalars.size(), 1U);
  scene::ScalarLayer& layer = scene.scalars.front();
  layer.field = make_volume(scene.lattice, 1, [](int, double, double, double) { return 1.0F; });
  layer.extinction = {{1, 0}, {1, 10}};
  const quality::Content at_step = frame::content_of(scene).value();
  layer.extinction = {{0, 10}, {2, 10}};
  const quality::Content dense = frame::content_of(scene).value();
  EXPECT_GT(dense.cell_depth, 0);
  EXPECT_DOUBLE_EQ(at_step.cell_depth, dense.cell_depth);
  EXPECT_DOUBLE_EQ(at_step.depth, dense.depth);
}

// A thin medium that grows by the same optical depth from one column to the next, seen along its
// columns: half of the neighbours differ by that depth, everywhere in the picture.
TEST(Content, TheLightOfAMediumIsThatOfAnyNumberOfCellsAlongARay) {
  constexpr double per_column = 1e-3;
  for (const int cells : {16, 64, 128, 256}) {
    scene::Scene scene;
    scene.lattice = even_lattice({24, 24, cells}, {1, 1, 32.0 / cells});
    scene.camera = look({0, 0, 0}, {0, 0, -1}, 100, 120, 90, false, 4);
    const auto field = make_volume(scene.lattice, 1, [&](int, double x, double, double) {
      return static_cast<float>(per_column * (x + 12) / 32);
    });
    scene.scalars.push_back(medium(field, {1, 1, 1}));
    const double picture = 120.0 / 90.0;  // its area in squares of its height
    EXPECT_NEAR(frame::content_of(scene)->step / (per_column * std::sqrt(0.5 * picture)), 1, 0.1)
        << cells;
  }
}

// Behind the rim of an opaque medium the light falls from 1 to 0 within less than a cell, which is
// seen at distances below it as well.
TEST(Content, TheRimOfAnOpaqueMediumIsSharperThanACell) {
  scene::Scene scene;
  scene.lattice = even_lattice({24, 24, 8}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0, 0, -1}, 100, 120, 90, false, 16);
  const auto field = make_volume(scene.lattice, 1, [&](int, double x, double y, double) {
    return std::abs(x) < 6 && std::abs(y) < 6 ? 1.0F : 0.0F;
  });
  scene.scalars.push_back(medium(field, {1, 1, 1}));
  const auto sharpness = [&](double extinction) {
    scene.scalars.front().extinction = {{0, 0}, {1, extinction}};
    const quality::Content content = frame::content_of(scene).value();
    return content.bends[2] / content.bends[4];  // at a tenth of a cell and at 0.8
  };
  EXPECT_GT(sharpness(100), 5 * sharpness(1e-3));
}

// Root of the integral over a picture, in squares of its height, of squares of the second
// differences at so many pixels along both axes.
double bends_of(const engine::Image& image, int apart) {
  double bends = 0;
  const auto channel = [&](int x, int y, std::size_t c) {
    return static_cast<double>(pixel(image, x, y)[c]);
  };
  for (int y = apart; y < image.height - apart; ++y) {
    for (int x = apart; x < image.width - apart; ++x) {
      for (std::size_t c = 0; c < 4; ++c) {
        const double twice = 2 * channel(x, y, c);
        const double beside = channel(x + apart, y, c) + channel(x - apart, y, c) - twice;
        const double above = channel(x, y + apart, c) + channel(x, y - apart, c) - twice;
        bends += (beside * beside + above * above) / 8;
      }
    }
  }
  return std::sqrt(bends) / image.height;
}

// An ocean seen along layers that are much thinner than its columns, jets seen from within, with
// cells of 160 pixels before distant ones, and others: as in pictures drawn by the engine.
TEST(Content, ChangesOfLightAreThoseOfThePictureAtDistancesInIt) {
  auto members = family();
  struct Seen {
    std::size_t member;
    std::uint32_t scene;
    std::uint32_t viewpoint;
  };
  for (const Seen& seen : {Seen{19, 1, 2}, Seen{25, 1, 3}, Seen{17, 4, 0}, Seen{2, 1, 0}}) {
    const FamilyMember& member = members[seen.member];
    const auto dataset = formula_dataset(member.field, member.formula);
    const auto number =
        3 * (100 * static_cast<std::uint32_t>(seen.member) + seen.scene) + seen.scene % 3;
    auto view = random_view(*dataset, number, seen.viewpoint, 640);
    view.image.width = view.image.width * 400 / view.image.height;
    view.image.height = 400;
    const auto completed = scene::complete(view, *dataset).value();
    scene::Scene scene = scene::build_scene(completed, *dataset).value();
    const quality::Content content = frame::content_of(scene).value();
    scene.method = scene::Method::slab;
    const engine::Image drawn = render(scene, 2).image;
    for (const std::size_t k : {3U, 4U}) {
      const int apart = static_cast<int>(std::lround(400 * quality::distances[k]));
      const double bend = bends_of(drawn, apart);
      EXPECT_LT(std::abs(std::log(content.bends[k] / bend)), std::log(1.6))
          << member.field.name << ' ' << k << ' ' << content.bends[k] << ' ' << bend;
    }
  }
}

// Lines along x and z in equal parts, as the components of the data are.
scene::Scene scene_of_lines(const glm::dvec3& forward) {
  scene::Scene scene;
  scene.lattice = even_lattice({6, 6, 6}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, forward, 100, 100, 100, false, 4);
  const auto field = make_volume(scene.lattice, 3, [](int component, double, double, double) {
    return component == 1 ? 0.0F : 1.0F;
  });
  scene.vector = plain_lines(field, {1, 1, 1});
  scene.vector->length = 2;
  scene.vector->magnitude_range = {0, std::sqrt(2.0)};
  return scene;
}

TEST(Content, LinesAreSeenInTheDirectionInWhichTheyAreDrawn) {
  const glm::dvec3 along_x{1, 0, 0};
  const glm::dvec3 along_z{0, 0, -1};
  const double whole = 2.0 / 8;  // heights of the picture
  for (const auto& forward : {along_x, along_z}) {
    scene::Scene scene = scene_of_lines(forward);
    EXPECT_NEAR(frame::content_of(scene)->length, whole * std::sqrt(0.5), 1e-6);
    scene.vector->scale = {1, 1, 0};
    EXPECT_NEAR(frame::content_of(scene)->length, forward.x != 0 ? 0 : whole, 1e-6) << "scaled";
    scene.vector->scale = {1, 1, 1};
    scene.vector->rate_x.assign(6, 0);
    scene.vector->rate_z.assign(6, 1);
    EXPECT_NEAR(frame::content_of(scene)->length, forward.x != 0 ? whole : 0, 1e-6) << "by rates";
  }
}

TEST(Content, LinesOfALevelAreThoseOfItsGroups) {
  scene::Scene scene = scene_of_lines({0, 1, 0});
  const double level = frame::content_of(scene)->length;
  scene.vector->halvings = {1, 1, 1};
  scene.vector->data_dims = {12, 12, 12};
  scene.vector->drawn_places = {2, 2, 2};
  EXPECT_NEAR(frame::content_of(scene)->length, level, 1e-6);
}

// The opaque front of a medium does not hide the part of a line that lies before it, so lines stay
// visible however dense the medium is.
TEST(Content, LinesInTheFirstLayerOfAnOpaqueMediumAreSeen) {
  scene::Scene scene = scene_of_lines({0, 0, -1});
  const auto field =
      make_volume(scene.lattice, 1, [](int, double, double, double) { return 1.0F; });
  scene.scalars.push_back(medium(field, {1, 1, 1}));
  scene.scalars.front().extinction = {{0, 1e3}, {2, 1e3}};
  const double dense = frame::content_of(scene)->lines;
  scene.scalars.front().extinction = {{0, 1e12}, {2, 1e12}};
  EXPECT_GT(dense, 0.01);
  EXPECT_NEAR(frame::content_of(scene)->lines / dense, 1, 0.05);
}

// Cells turned by 45 degrees about y, so that x of the data is along x + z.
TEST(Content, LinesFollowTurnedCells) {
  scene::Scene scene = scene_of_lines({0, 0, -1});
  const double half = std::sqrt(0.5);
  auto places = std::make_shared<std::vector<std::array<float, 3>>>();
  for (const double z : scene.lattice.positions[2]) {
    for (const double y : scene.lattice.positions[1]) {
      for (const double x : scene.lattice.positions[0]) {
        places->push_back({static_cast<float>(half * (x - z)), static_cast<float>(y),
                           static_cast<float>(half * (x + z))});
      }
    }
  }
  scene.lattice.places = places;
  EXPECT_NEAR(frame::content_of(scene)->length, 0, 1e-6);
}

}  // namespace
}  // namespace windsplat::test
