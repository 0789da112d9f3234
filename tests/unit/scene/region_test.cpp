// Regions: which samples they keep, by closed forms and by counting; seams, polygons, filters,
// errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/place.hpp"
#include "server/scene/region/select.hpp"
#include "tests/unit/scene/earth.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::GeometryMapping;
using protocol::RegionView;
using protocol::View;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::unique_ptr<FakeSource> source_of(data::Grid grid) {
  return std::make_unique<FakeSource>(std::move(grid),
                                      std::vector{wind_info(), scalar_info("cloud", "1")}, 2);
}

View with_cloud() {
  View view;
  view.scalars.emplace();
  view.scalars->emplace_back().field = "cloud";
  view.scalars->front().extinction = {{0, 1}, {4, 3}};
  view.method.detail = protocol::Detail::full;
  return view;
}

RegionView europe() {
  RegionView region;
  region.x = {-20, 40};
  region.y = {70, 30};
  region.z = {300, 1000};
  return region;
}

std::string pointer_of(const View& view) {
  auto dataset = dataset_of(source_of(whole_earth()));
  const auto full = complete(view, *dataset);
  return full || full.error().at.empty() ? "" : full.error().at.front().pointer;
}

TEST(Region, KeepsTheSamplesWithinTheRangesAcrossTheSeam) {
  for (const protocol::Range longitudes :
       {protocol::Range{-20, 40}, protocol::Range{340, 40}, protocol::Range{700, 400}}) {
    RegionView region = europe();
    region.x = longitudes;
    const auto crop = crop_of(region, whole_earth(), 0);
    ASSERT_TRUE(crop) << crop.error().message;
    EXPECT_THAT(crop->first, ElementsAre(34, 11, 0));  // 340 degrees, 30 degrees, 1000 hPa
    EXPECT_THAT(crop->count, ElementsAre(7, 5, 2));
    EXPECT_EQ(crop->x_of(0), 34);
    EXPECT_EQ(crop->x_of(2), 0);
    EXPECT_EQ(crop->x_of(6), 4);
  }
}

TEST(Region, PositionsGoOnBeyondTheSeamAndTheBoxIsThatOfTheCells) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  view.region = europe();
  const auto full = complete(view, *dataset);
  ASSERT_TRUE(full) << full.error().message;
  const Lattice whole = place_lattice(whole_earth(), {}).value();
  const Lattice& part = full->lattice();
  const double step = whole.positions[0][1] - whole.positions[0][0];
  ASSERT_EQ(part.positions[0].size(), 7U);
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_NEAR(part.positions[0][i], whole.positions[0][34] + step * static_cast<double>(i),
                1e-12);
  }
  EXPECT_EQ(part.positions[1][0], whole.positions[1][11]);
  EXPECT_NEAR(part.box_min.x, part.positions[0].front() - step / 2, 1e-12);
  EXPECT_NEAR(part.box_max.x, part.positions[0].back() + step / 2, 1e-12);
  EXPECT_THAT(full->placed()->grid.axes[0].coordinates,
              ElementsAre(340, 350, 360, 370, 380, 390, 400));
  EXPECT_THAT(full->placed()->grid.axes[2].coordinates, ElementsAre(1000, 500));
}

// The camera frames the region: it is closer than for the whole globe, and looks at its centre.
TEST(Region, TheDefaultCameraFramesIt) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  const auto whole = complete(view, *dataset);
  view.region = europe();
  const auto part = complete(view, *dataset);
  ASSERT_TRUE(whole && part);
  const glm::dvec3 centre = 0.5 * (part->lattice().box_min + part->lattice().box_max);
  const auto& target = *part->view().camera.target;
  EXPECT_NEAR(target[0], centre.x, 0.1);
  const auto distance = [](const CompletedView& one) {
    const auto& eye = *one.view().camera.eye;
    const auto& at = *one.view().camera.target;
    return std::hypot(eye[0] - at[0], eye[1] - at[1], eye[2] - at[2]);
  };
  EXPECT_LT(distance(*part), 0.6 * distance(*whole));
  const auto& eye = *part->view().camera.eye;
  EXPECT_NEAR(eye[0], target[0], 1e-9) << "from the south, wherever the region is in the world";
  EXPECT_LT(eye[1], target[1]);
}

TEST(Region, FieldsHoldTheSamplesOfTheCropAlone) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  view.region = europe();
  const Scene scene = built(view, *dataset);
  const data::Volume& cloud = *scene.scalars.at(0).field;
  ASSERT_THAT(cloud.dims, ElementsAre(7, 5, 2));
  ASSERT_EQ(scene.lattice.dims, cloud.dims);
  std::size_t n = 0;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 7; ++i, ++n) {
        EXPECT_EQ(cloud.values[n], static_cast<float>((k * 17 + 11 + j) * 36 + (34 + i) % 36));
      }
    }
  }
  EXPECT_EQ(scene.vector->field->dims, cloud.dims);
  EXPECT_EQ(scene.vector->rate_x.size(), 0U);
}

// Rates of the part are those of the whole at its rows and levels.
TEST(Region, RatesOfTrajectoriesAreThoseOfTheWholeGrid) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  view.vector.space = protocol::VectorSpace::world;
  const Scene whole = built(view, *dataset);
  view.region = europe();
  const Scene part = built(view, *dataset);
  ASSERT_EQ(part.vector->rate_x.size(), 5U);
  ASSERT_EQ(part.vector->rate_z.size(), 2U);
  for (std::size_t j = 0; j < 5; ++j) {
    EXPECT_EQ(part.vector->rate_x[j], whole.vector->rate_x[11 + j]);
  }
  EXPECT_EQ(part.vector->rate_y, whole.vector->rate_y);
}

TEST(Region, ARangeThatMissesTheDataNamesTheirCoordinates) {
  View view = with_cloud();
  view.region.z = {1, 200};
  EXPECT_EQ(pointer_of(view), "/region/z");
  auto dataset = dataset_of(source_of(whole_earth()));
  const auto full = complete(view, *dataset);
  ASSERT_FALSE(full);
  EXPECT_THAT(full.error().message, HasSubstr("250 to 1000 hPa"));
  EXPECT_THAT(full.error().message, HasSubstr("1 to 200"));
  view = with_cloud();
  view.region.y = {21, 29};
  EXPECT_EQ(pointer_of(view), "/region/y") << "between two samples";
}

TEST(Region, LongitudesAtBothEndsOfPartOfTheGlobeAreRefused) {
  data::Grid grid = whole_earth();
  grid.axes[0].coordinates = evenly(-150, 10, 31);
  RegionView region;
  region.x = {140, -140};
  const auto crop = crop_of(region, grid, 0);
  ASSERT_FALSE(crop);
  EXPECT_EQ(crop.error().at.front().pointer, "/region/x");
  region.x = {-140, 140};
  EXPECT_EQ(crop_of(region, grid, 0)->count[0], 29);
}

TEST(Region, AColumnThatRepeatsTheFirstIsNotDrawnTwice) {
  data::Grid grid = whole_earth();
  grid.axes[0].coordinates = evenly(0, 10, 37);
  RegionView region;
  region.x = {-10, 10};
  const auto crop = crop_of(region, grid, 0);
  ASSERT_TRUE(crop);
  EXPECT_EQ(crop->first[0], 35);
  EXPECT_EQ(crop->count[0], 3);
  region.x = {0, 90};  // both ends of the axis are in it
  const auto from_the_seam = crop_of(region, grid, 0);
  ASSERT_TRUE(from_the_seam);
  EXPECT_EQ(from_the_seam->first[0], 0);
  EXPECT_EQ(from_the_seam->count[0], 10);
  region.x = {0, 360};
  EXPECT_EQ(crop_of(region, grid, 0)->count[0], 37) << "a full turn keeps the picture of the whole";
}

TEST(Region, ASliceBeyondItIsRefused) {
  View view = with_cloud();
  view.region = europe();
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 2};
  EXPECT_EQ(pointer_of(view), "/geometry/slice/index");
  view.geometry.slice->index = 0.5;
  EXPECT_EQ(pointer_of(view), "");
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::x, 3};
  auto dataset = dataset_of(source_of(whole_earth()));
  const Scene scene = built(view, *dataset);
  ASSERT_TRUE(scene.slice);
  EXPECT_EQ(scene.slice->sample, 5) << "30 degrees, the fifth after 340";
}

// A layer between two layers is interpolated from the same samples as without a region.
TEST(Region, ALayerBetweenLayersIsThatOfTheWholeGrid) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::y, 12.25};
  const Scene whole = built(view, *dataset);
  view.region = europe();
  const Scene part = built(view, *dataset);
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < 7; ++i) {
      EXPECT_EQ(part.scalars[0].field->values[static_cast<std::size_t>(k * 7 + i)],
                whole.scalars[0].field->values[static_cast<std::size_t>(k * 36 + (34 + i) % 36)]);
    }
  }
}

// A coarser level is formed from the samples of the part, not of the whole.
TEST(Region, LevelsOfDetailAreThoseOfThePart) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  view.method.detail = protocol::Detail::automatic;
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  view.image.width = 2;
  view.image.height = 2;
  view.region = europe();
  const Scene scene = built(view, *dataset);
  const data::Volume& cloud = *scene.scalars.at(0).field;
  EXPECT_GT(scene.level[0] + scene.level[1] + scene.level[2], 0);
  EXPECT_EQ(cloud.components, data::TwoValues::components);
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(cloud.dims[a], data::halved(std::array{7, 5, 2}[a], scene.level[a]));
  }
  EXPECT_EQ(scene.lattice.dims, cloud.dims);
  EXPECT_GE(cloud.range[0], 11 * 36);
}

// ---- columns ----

// Every column at its own place: rows turned by 30 degrees.
data::Grid turned_grid() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "km", evenly(0, 1, 20)),
               axis(AxisKind::cartesian, "km", evenly(0, 1, 20)),
               axis(AxisKind::height, "m", {0, 100, 200})};
  data::Columns columns;
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) {
      columns.longitude.push_back(10 + 0.1 * (0.866 * i - 0.5 * j));
      columns.latitude.push_back(50 + 0.1 * (0.5 * i + 0.866 * j));
    }
  }
  grid.columns = std::make_shared<const data::Columns>(std::move(columns));
  return grid;
}

TEST(Region, ColumnsAreMaskedByTheirOwnLongitudeAndLatitude) {
  for (const auto mapping :
       {GeometryMapping::flat, GeometryMapping::curvilinear, GeometryMapping::sphere}) {
    auto dataset = dataset_of(source_of(turned_grid()));
    View view = with_cloud();
    view.geometry.mapping = mapping;
    view.region.longitudes = {9.8, 10.6};
    view.region.latitudes = {50.4, 51.3};
    const Scene scene = built(view, *dataset);
    const data::Grid grid = turned_grid();
    std::size_t wanted = 0;
    for (std::size_t n = 0; n < 400; ++n) {
      const double longitude = grid.columns->longitude[n];
      const double latitude = grid.columns->latitude[n];
      wanted += longitude >= 9.8 && longitude <= 10.6 && latitude >= 50.4 && latitude <= 51.3;
    }
    const data::Volume& cloud = *scene.scalars[0].field;
    EXPECT_EQ(cloud.samples() - static_cast<std::size_t>(cloud.masked), 3 * wanted);
    EXPECT_LT(cloud.samples(), 3U * 400);
    EXPECT_EQ(scene.lattice.dims, cloud.dims);
    if (scene.lattice.places) {
      EXPECT_EQ(scene.lattice.places->size(), cloud.samples());
    }
  }
}

TEST(Region, PlacesOfACurvedPartAreThoseOfTheWhole) {
  data::Grid earth = whole_earth();
  auto dataset = dataset_of(source_of(earth));
  View view = with_cloud();
  view.geometry.mapping = GeometryMapping::sphere;
  const Scene whole = built(view, *dataset);
  EXPECT_EQ(whole.lattice.around, 36);
  view.region = europe();
  const Scene part = built(view, *dataset);
  EXPECT_EQ(part.lattice.around, 0);
  std::size_t n = 0;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 7; ++i, ++n) {
        const auto from = static_cast<std::size_t>((k * 17 + 11 + j) * 36 + (34 + i) % 36);
        EXPECT_EQ((*part.lattice.places)[n], (*whole.lattice.places)[from]);
      }
    }
  }
  EXPECT_LT(part.lattice.box_max.x - part.lattice.box_min.x, 1.2);
}

// Users typed degrees for axes in metres.
TEST(Region, RangesBeyondTheAxesOfAMapNameTheKeysInDegrees) {
  const auto message = [](const data::Grid& grid, const char* key) {
    RegionView region;
    if (*key == 'x') region.x = {500, 600};
    if (*key == 'z') region.z = {5e6, 6e6};
    return crop_of(region, grid, 0).error().message;
  };
  data::Grid grid = turned_grid();
  EXPECT_THAT(message(grid, "x"), HasSubstr("; /region/longitudes and /region/latitudes"));
  EXPECT_THAT(message(grid, "z"), testing::Not(HasSubstr("/region/longitudes")));
  grid.columns.reset();
  EXPECT_THAT(message(grid, "x"), testing::Not(HasSubstr("/region/longitudes")));
}

TEST(Region, GeographicKeysNeedLongitudesAndLatitudes) {
  data::Grid grid = turned_grid();
  grid.columns.reset();
  RegionView region;
  region.longitudes = {0, 10};
  const auto crop = crop_of(region, grid, 0);
  ASSERT_FALSE(crop);
  EXPECT_EQ(crop.error().at.front().pointer, "/region/longitudes");
  region.longitudes.reset();
  region.polygon = {{{{1.5, 1.5}, {5.5, 1.5}, {5.5, 8.5}, {1.5, 1.5}}}};
  EXPECT_TRUE(crop_of(region, grid, 0)) << "polygons are in x and y without them";
  region.polygon = {{{{100, 100}, {105, 101}, {105, 108}, {100, 100}}}};
  EXPECT_EQ(crop_of(region, grid, 0).error().at.front().pointer, "/region/polygon");
}

// ---- filters ----

TEST(Filter, LinesAreMaskedWhereAnotherFieldIsBeyondTheRange) {
  auto source = source_of(whole_earth());
  source->values = [](const std::string& field, std::size_t n) {
    if (field != "cloud") return 5.0;
    return n % 7 == 3 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(n % 10);
  };
  std::int64_t wanted = 0;
  for (std::size_t n = 0; n < whole_earth().samples(); ++n) {
    wanted += n % 7 != 3 && n % 10 >= 3 && n % 10 <= 5 ? 1 : 0;
  }
  auto dataset = dataset_of(std::move(source));
  View view = with_cloud();
  view.region.where = {{"cloud", {3, 5}, protocol::FilterOf::lines}};
  const auto kept = [](const data::Volume& volume) {
    return static_cast<std::int64_t>(volume.samples()) - volume.masked;
  };
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(kept(*scene.vector->field), wanted);
  EXPECT_GT(kept(*scene.scalars[0].field), wanted) << "media are not filtered";
  view.region.where[0].of = protocol::FilterOf::media;
  const Scene media = built(view, *dataset);
  EXPECT_EQ(kept(*media.scalars[0].field), wanted);
  EXPECT_EQ(media.vector->field->masked, 0);
  view.region.where[0].of = protocol::FilterOf::all;
  view.region.where.push_back({"cloud", {5, 9}, protocol::FilterOf::lines});
  const Scene both = built(view, *dataset);
  EXPECT_EQ(kept(*both.scalars[0].field), wanted);
  EXPECT_LT(kept(*both.vector->field), wanted / 2) << "every filter has to hold";
}

TEST(Filter, AppliesToTheSamplesOfTheStepAndOfTheCrop) {
  auto dataset = dataset_of(source_of(whole_earth()));
  View view = with_cloud();
  view.step = 1;
  view.region = europe();
  // Sample n at step 1 is n + 1000.
  view.region.where = {{"cloud", {1000 + 11 * 36 + 34, 1000 + 11 * 36 + 35}}};
  const Scene scene = built(view, *dataset);
  const data::Volume& wind = *scene.vector->field;
  EXPECT_EQ(static_cast<std::int64_t>(wind.samples()) - wind.masked, 2);
  EXPECT_FALSE(std::isnan(wind.values[0]));
  EXPECT_FALSE(std::isnan(wind.values[1]));
}

TEST(Filter, FieldsThatAreNotThereAreRefusedAndOthersAreListed) {
  View view = with_cloud();
  view.region.where = {{"cloud", {0, 1}}, {"smoke", {0, 1}}};
  EXPECT_EQ(pointer_of(view), "/region/where/1/field");
  view.region.where[1].field = "wind";
  EXPECT_EQ(pointer_of(view), "/region/where/1/field");
  view.scalars->clear();
  view.region.where.pop_back();
  auto dataset = dataset_of(source_of(whole_earth()));
  EXPECT_THAT(fields_of(view, dataset->info()), ElementsAre("wind", "cloud"));
}

}  // namespace
}  // namespace windsplat::scene
