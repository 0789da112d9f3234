// Levels of detail: the level for a camera, in closed form, and its effect on lattice and lines.
#include "server/scene/detail.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using Level = std::array<int, 3>;

// A box about the origin with cells of these widths.
Lattice box(const std::array<std::vector<double>, 3>& spacing) {
  Lattice lattice;
  for (std::size_t a = 0; a < 3; ++a) {
    const double length = std::accumulate(spacing[a].begin(), spacing[a].end(), 0.0);
    double edge = -0.5 * length;
    const int index = static_cast<int>(a);
    lattice.box_min[index] = edge;
    lattice.box_max[index] = -edge;
    lattice.dims[a] = static_cast<int>(spacing[a].size());
    lattice.spacing[a] = spacing[a];
    for (const double width : spacing[a]) {
      lattice.positions[a].push_back(edge + 0.5 * width);
      edge += width;
    }
  }
  return lattice;
}

Lattice cube(int side) {
  const std::vector<double> even(static_cast<std::size_t>(side), 2.0 / side);
  return box({even, even, even});
}

// Looks north at the nearest face of a box of edge 2 from that distance: 100 pixels per unit there.
Camera before(double distance) {
  Camera camera;
  camera.eye = {0, -1 - distance, 0};
  camera.width = camera.height = 400;
  camera.half_height = 2 / distance;
  return camera;
}

constexpr MergeLimits any{1e9, 30};

TEST(ChooseLevel, HalvesWhileTwoCellsFitInAPixel) {
  const Camera camera = before(8);  // at the face a cell of the cube covers 200 / side pixels
  EXPECT_NEAR(pixels_per_unit(camera, cube(64)), 100, 1e-9);
  EXPECT_EQ(choose_level(camera, cube(398), {}, any), (Level{0, 0, 0}));
  EXPECT_EQ(choose_level(camera, cube(404), {}, any), (Level{1, 1, 1}));
  EXPECT_EQ(choose_level(camera, cube(796), {}, any), (Level{1, 1, 1}));
  EXPECT_EQ(choose_level(camera, cube(808), {}, any), (Level{2, 2, 2}));
}

TEST(ChooseLevel, RisesByOneWhenTheDistanceDoubles) {
  const Lattice lattice = cube(320);  // 0.625 pixels per cell at distance 8
  for (int doubled = 0; doubled < 6; ++doubled) {
    Camera camera = before(8);
    camera.eye.y = -1 - 8 * std::exp2(doubled);
    const Level level = choose_level(camera, lattice, {}, any);
    EXPECT_EQ(level, (Level{doubled, doubled, doubled}));
    const double fine_px = pixels_per_unit(camera, lattice) * 2 / 320;
    EXPECT_LT(fine_px * std::exp2(level[0]), 1) << "never more than a pixel";
  }
}

TEST(ChooseLevel, OrthographicDependsOnThePictureHeightOnly) {
  Camera camera = before(8);
  camera.perspective = false;
  camera.half_height = 2;  // 400 pixels for 4 units
  for (const double away : {1.5, 30.0, 3000.0}) {
    camera.eye.y = -away;
    EXPECT_EQ(choose_level(camera, cube(404), {}, any), (Level{1, 1, 1})) << away;
    EXPECT_EQ(choose_level(camera, cube(398), {}, any), (Level{0, 0, 0})) << away;
  }
}

TEST(ChooseLevel, DoesNotChangeWhenAnOrthographicViewRotates) {
  Camera camera = before(8);
  camera.perspective = false;
  camera.half_height = 2;
  for (int turn = 0; turn < 12; ++turn) {
    const double angle = 0.5 * turn;
    camera.forward = {std::sin(angle), std::cos(angle), 0};
    camera.right = {std::cos(angle), -std::sin(angle), 0};
    camera.eye = -9.0 * camera.forward;
    EXPECT_EQ(choose_level(camera, cube(404), {}, any), (Level{1, 1, 1})) << angle;
  }
}

TEST(ChooseLevel, UsesTheWidestCellOfEveryAxis) {
  // 800 columns of a quarter of a pixel, 19 layers of 1.5 to 1.6, 100 rows of which one is 0.6
  // wide.
  std::vector<double> rows(100, 0.002);
  rows[40] = 0.006;
  std::vector<double> layers(19, 0.015);
  layers[3] = 0.016;
  const Lattice lattice = box({std::vector<double>(800, 0.0025), rows, layers});
  Camera camera = before(8);
  camera.eye.y = lattice.box_min.y - 8;
  EXPECT_EQ(choose_level(camera, lattice, {}, any), (Level{1, 0, 0}));
}

TEST(ChooseLevel, KeepsSlicedCurvedAndSmallAxes) {
  Camera camera = before(8);
  EXPECT_EQ(choose_level(camera, cube(404), Slice{1, 7}, any), (Level{1, 0, 1}));
  camera.eye.y = -1e6;
  const std::vector<double> two(2, 1.0);
  EXPECT_EQ(choose_level(camera, box({two, std::vector<double>{2.0}, {1.0, 0.5, 0.5}}), {}, any),
            (Level{0, 0, 1}));
  Lattice bent = cube(404);
  bent.places = std::make_shared<const std::vector<std::array<float, 3>>>();
  EXPECT_EQ(choose_level(camera, bent, {}, any), (Level{0, 0, 0}));
}

TEST(ChooseLevel, EyeInsideTheBoxUsesFullDetail) {
  Camera camera = before(8);
  camera.eye = {0, 0, 0};
  EXPECT_EQ(choose_level(camera, cube(404), {}, any), (Level{0, 0, 0}));
}

TEST(ChooseLevel, MergesTheFinestCellsFirstWithinTheLimits) {
  Camera camera = before(8);
  camera.eye.y = -1e6;
  const Lattice flat = box({std::vector<double>(64, 2.0 / 64), std::vector<double>(64, 2.0 / 64),
                            std::vector<double>(64, 0.01 / 64)});
  EXPECT_EQ(choose_level(camera, flat, {}, {1.9, 9}), (Level{0, 0, 0}));
  EXPECT_EQ(choose_level(camera, flat, {}, {2, 9}), (Level{0, 0, 1}));
  EXPECT_EQ(choose_level(camera, flat, {}, {31, 9}), (Level{0, 0, 4}));
  EXPECT_EQ(choose_level(camera, flat, {}, {31, 2}), (Level{1, 1, 2}));
  EXPECT_EQ(choose_level(camera, flat, {}), (Level{1, 1, 1}));
  EXPECT_EQ(choose_level(camera, cube(64), {}, {4, 1}), (Level{1, 1, 0}));
}

TEST(CoarsenLattice, KeepsTheBoxAndCentersMergedCells) {
  const Lattice fine = box({std::vector<double>{1, 2, 3, 4, 5}, {1, 1}, {0.5, 0.25, 0.125}});
  const Lattice coarse = coarsen_lattice(fine, {1, 0, 2});
  EXPECT_EQ(coarse.dims, (std::array{3, 2, 1}));
  EXPECT_EQ(coarse.spacing[0], (std::vector<double>{3, 7, 5}));
  EXPECT_EQ(coarse.spacing[1], fine.spacing[1]);
  EXPECT_EQ(coarse.positions[1], fine.positions[1]);
  EXPECT_EQ(coarse.spacing[2], (std::vector<double>{0.875}));
  EXPECT_EQ(coarse.box_min, fine.box_min);
  EXPECT_EQ(coarse.box_max, fine.box_max);
  for (std::size_t a = 0; a < 3; ++a) {
    double edge = fine.box_min[static_cast<int>(a)];
    for (std::size_t i = 0; i < coarse.positions[a].size(); ++i) {
      EXPECT_NEAR(coarse.positions[a][i], edge + 0.5 * coarse.spacing[a][i], 1e-12);
      edge += coarse.spacing[a][i];
    }
    EXPECT_NEAR(edge, fine.box_max[static_cast<int>(a)], 1e-12);
  }
}

TEST(MergeLines, AddUpTheirOpacityAndThenTheirWidth) {
  const Lattice lattice = cube(200);  // at 50 pixels per unit half a pixel per cell
  VectorLayer layer;
  layer.opacity = 0.1;
  layer.r1 = 0.5;
  layer.r2 = 1.5;
  VectorLayer merged = layer;
  merge_lines(lattice, {1, 1, 0}, 50, merged);
  EXPECT_DOUBLE_EQ(merged.opacity, 0.4);  // one line represents four
  EXPECT_EQ(merged.r1, layer.r1);
  EXPECT_EQ(merged.r2, layer.r2);

  // Eight times 0.15 is 1.2 lines: one line, a fifth wider than r1 + r2 = 2.
  merged = layer;
  merged.opacity = 0.15;
  merge_lines(lattice, {1, 1, 1}, 50, merged);
  EXPECT_DOUBLE_EQ(merged.opacity, 1);
  EXPECT_NEAR(merged.r1 + merged.r2, 2.4, 1e-12);
  EXPECT_NEAR(merged.r2 - merged.r1, 1, 1e-12);

  // Samples half a pixel apart cover at most half a pixel beside the line.
  merged = layer;
  merged.opacity = 1;
  merge_lines(lattice, {1, 1, 1}, 50, merged);
  EXPECT_DOUBLE_EQ(merged.opacity, 1);
  EXPECT_NEAR(merged.r1 + merged.r2, 2.5, 1e-12);

  // Three samples are one and a half groups: a line of the second stands for two or for none.
  merged = layer;
  merge_lines(cube(3), {1, 0, 0}, 50, merged);
  EXPECT_DOUBLE_EQ(merged.opacity, 0.2);

  merged = layer;
  merge_lines(lattice, {0, 0, 0}, 50, merged);
  EXPECT_EQ(merged.opacity, layer.opacity);
}

TEST(MergeLines, CountLinesAndNotTheSamplesBetweenThem) {
  const Lattice lattice = cube(200);
  VectorLayer layer;
  layer.opacity = 0.1;
  layer.stride = 4;
  VectorLayer merged = layer;
  merge_lines(lattice, {2, 2, 1}, 50, merged);
  EXPECT_EQ(merged.opacity, layer.opacity);
  EXPECT_EQ(merged.stride, 1);
  EXPECT_EQ(merged.data_stride, 4);

  // Eight samples have two lines along two axes each.
  merged = layer;
  merge_lines(lattice, {3, 3, 0}, 50, merged);
  EXPECT_DOUBLE_EQ(merged.opacity, 0.4);

  merged = layer;
  merge_lines(lattice, {0, 0, 0}, 50, merged);
  EXPECT_EQ(merged.stride, 4);
  EXPECT_EQ(merged.data_stride, 1);
}

class LevelOfAScene : public testing::Test {
 protected:
  void SetUp() override {
    dataset = sample_dataset("tornado", {64, 64, 64});
    view.image.width = 40;
    view.image.height = 30;
    view.vector.stride = 1;
  }
  Scene built() {
    const auto completed = complete(view, *dataset);
    EXPECT_TRUE(completed) << completed.error().message;
    auto scene = build_scene(*completed, *dataset);
    EXPECT_TRUE(scene) << scene.error().message;
    return std::move(*scene);
  }
  std::unique_ptr<data::Dataset> dataset;
  protocol::View view;
};

TEST_F(LevelOfAScene, DependsOnThePictureSize) {
  const Scene small = built();
  const int level = small.level[0];
  EXPECT_GE(level, 1);
  ASSERT_TRUE(small.vector);
  ASSERT_FALSE(small.scalars.empty());
  const int side = 64 >> level;
  EXPECT_EQ(small.lattice.dims, (std::array{side, side, side}));
  EXPECT_EQ(small.vector->field->dims, small.lattice.dims);
  EXPECT_EQ(small.scalars[0].field->dims, small.lattice.dims);
  view.image.width *= 4;
  view.image.height *= 4;
  EXPECT_EQ(built().level[0], level - 1);
}

TEST_F(LevelOfAScene, IsFullWhereViewMethodOrStrideRequireIt) {
  const Scene reduced = built();
  const std::uint64_t resident = dataset->resident_bytes();
  const auto expect_full = [&](const char* why) {
    const Scene scene = built();
    EXPECT_EQ(scene.level, (Level{0, 0, 0})) << why;
    EXPECT_EQ(scene.lattice.dims, (std::array{64, 64, 64})) << why;
    EXPECT_EQ(scene.vector->field->dims, scene.lattice.dims) << why;
    EXPECT_EQ(dataset->resident_bytes(), resident) << why << ": no level is computed";
  };
  view.method.detail = protocol::Detail::full;
  expect_full("full");
  view.method.detail = protocol::Detail::automatic;
  view.method.name = protocol::MethodName::reference;
  expect_full("reference");
  view.method.name = protocol::MethodName::slab;
  view.scalars = complete(view, *dataset)->view().scalars;
  view.scalars->front().stride = 2;
  expect_full("stride of a medium");
  view.scalars->clear();
  view.vector.stride = 2;
  expect_full("stride of lines without a medium");
  EXPECT_NE(reduced.level, (Level{0, 0, 0}));
}

TEST_F(LevelOfAScene, KeepsLinesWithAStrideBesideAMedium) {
  view.vector.stride = 3;
  view.method.detail = protocol::Detail::full;
  const Scene full = built();
  view.method.detail = protocol::Detail::automatic;
  const Scene scene = built();
  EXPECT_GE(scene.level[0], 1);
  EXPECT_EQ(scene.vector->field->dims, scene.lattice.dims);
  EXPECT_EQ(scene.vector->opacity, full.vector->opacity) << "no line represents another";
  std::int64_t lines = 0;
  const auto& volume = *scene.vector->field;
  for (std::size_t n = 0; n < volume.samples(); ++n) lines += std::isnan(volume.values[n]) ? 0 : 1;
  EXPECT_EQ(lines, 22 * 22 * 22);  // 64 / 3, rounded up
}

TEST_F(LevelOfAScene, KeepsTheCameraAndItsDepthCue) {
  const Scene coarse = built();
  view.method.detail = protocol::Detail::full;
  const Scene full = built();
  EXPECT_EQ(coarse.camera.eye, full.camera.eye);
  EXPECT_EQ(coarse.camera.near, full.camera.near);
  EXPECT_EQ(coarse.depth_cue.near, full.depth_cue.near);
  EXPECT_EQ(coarse.vector->length, full.vector->length);
  EXPECT_EQ(coarse.vector->min_magnitude, full.vector->min_magnitude);
}

TEST_F(LevelOfAScene, ReducesNoHiddenFields) {
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  const Scene scene = built();
  ASSERT_EQ(scene.level[0], scene.level[2]);
  const std::uint64_t fine = 4ULL * 64 * 64 * 64;
  ASSERT_EQ(scene.scalars.size(), 1U);
  EXPECT_EQ(dataset->resident_bytes(),
            fine + data::TwoValues::components * (fine >> (3 * scene.level[0])));
}

// The cloud only, of 64^3 samples, in a store of that many bytes.
class LevelWithin : public LevelOfAScene {
 protected:
  static constexpr std::uint64_t fine = 4ULL * 64 * 64 * 64;
  void open_within(std::uint64_t bytes_max) {
    auto source = data::open_sample("tornado", {64, 64, 64});
    dataset = std::make_unique<data::Dataset>(std::move(*source), "tornado", bytes_max);
    view.vector.field.kind = protocol::FieldChoice::Kind::none;
  }
};

TEST_F(LevelWithin, FullDetailIsRenderedWhenALevelDoesNotFit) {
  open_within(fine);
  for (int again = 0; again < 2; ++again) {
    const Scene scene = built();
    EXPECT_EQ(scene.level, (Level{0, 0, 0}));
    EXPECT_EQ(scene.lattice.dims, (std::array{64, 64, 64}));
    ASSERT_EQ(scene.scalars.size(), 1U);
    EXPECT_EQ(scene.scalars[0].field->dims, scene.lattice.dims);
  }
  EXPECT_EQ(dataset->loads(), 1U) << "the next frame finds the volume";
}

TEST_F(LevelWithin, LevelIsRenderedWhenItFits) {
  open_within(fine + data::TwoValues::components * fine / 8);
  EXPECT_GE(built().level[0], 1);
}

// The memory that others hold at the moment must not change the picture.
TEST_F(LevelWithin, LevelDoesNotDependOnWhatIsResident) {
  open_within(2 * fine);
  const auto completed = complete(view, *dataset).value();
  {
    const auto other = dataset->volume("vorticity", 0).value();
    EXPECT_EQ(build_scene(completed, *dataset).error().kind, ErrorKind::out_of_memory);
  }
  EXPECT_GE(build_scene(completed, *dataset).value().level[0], 1);
}

TEST_F(LevelWithin, ErrorsOfFullDetailAreReturned) {
  open_within(fine);
  const auto completed = complete(view, *dataset).value();
  open_within(fine - 1);
  EXPECT_EQ(build_scene(completed, *dataset).error().kind, ErrorKind::out_of_memory);
}

TEST_F(LevelOfAScene, IsUnaffectedByTheScaleOfHeightAlone) {
  // A camera of its own: default ones look from higher up at flatter boxes.
  const Scene usual = built();
  const auto& from = usual.camera;
  view.camera.eye = {from.eye.x, from.eye.y, from.eye.z};
  view.camera.target = protocol::Vec3{0, 0, 0};
  const Scene first = built();
  const std::uint64_t resident = dataset->resident_bytes();
  for (const double z : {0.97, 0.9, 0.83, 0.7}) {
    view.geometry.scale[2] = z;
    const Scene scene = built();
    ASSERT_EQ(scene.level, first.level) << z;
    ASSERT_NE(scene.lattice.spacing[2][0], first.lattice.spacing[2][0]) << z;
    EXPECT_EQ(scene.vector->field, first.vector->field) << z;
    EXPECT_EQ(scene.scalars[0].field, first.scalars[0].field) << z;
    EXPECT_EQ(dataset->resident_bytes(), resident) << z;
  }
}

TEST(LevelOfRates, AreThoseOfTheData) {
  std::vector<double> latitudes;
  for (int j = 0; j < 64; ++j) latitudes.push_back(-63 + 2 * j);
  std::vector<double> longitudes;
  for (int i = 0; i < 128; ++i) longitudes.push_back(2 * i);
  data::Grid grid;
  grid.axes = {axis(data::AxisKind::longitude, "degrees_east", longitudes),
               axis(data::AxisKind::latitude, "degrees_north", latitudes),
               axis(data::AxisKind::pressure, "hPa", {1000, 500, 250})};
  auto dataset =
      dataset_of(std::make_unique<FakeSource>(grid, std::vector<data::FieldInfo>{wind_info()}, 1));
  protocol::View view;
  view.vector.space = protocol::VectorSpace::world;
  view.vector.stride = 1;
  view.image.width = view.image.height = 50;
  const Scene coarse = build_scene(*complete(view, *dataset), *dataset).value();
  ASSERT_EQ(coarse.level, (Level{1, 1, 0})) << "three layers remain three";
  view.method.detail = protocol::Detail::full;
  const Scene full = build_scene(*complete(view, *dataset), *dataset).value();
  ASSERT_EQ(full.vector->rate_x.size(), 64U);
  EXPECT_EQ(coarse.vector->rate_x, full.vector->rate_x) << "a drawn sample has its own";
  EXPECT_EQ(coarse.vector->rate_z, full.vector->rate_z);
  EXPECT_EQ(coarse.vector->rate_y, full.vector->rate_y);
}

}  // namespace
}  // namespace windsplat::scene
