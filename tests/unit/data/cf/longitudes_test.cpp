// Longitudes of regions that contain the edge of their range.
#include "server/data/cf/grid/longitudes.hpp"

#include <gmock/gmock.h>

#include <vector>

#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data {
namespace {

using testing::ElementsAre;

std::vector<double> continued(std::vector<double> longitudes) {
  cf::continue_over_seam(longitudes);
  return longitudes;
}

TEST(Longitudes, ContinueOverGreenwichAndTheDateLine) {
  EXPECT_THAT(continued({350, 355, 0, 5}), ElementsAre(350, 355, 360, 365));
  EXPECT_THAT(continued({170, 175, -180, -175}), ElementsAre(170, 175, 180, 185));
  EXPECT_THAT(continued({10, 5, 0, 355}), ElementsAre(10, 5, 0, -5));
}

TEST(Longitudes, MayCloseACircleWithTheFirstOneAgain) {
  EXPECT_THAT(continued({180, 270, 0, 90, 180}), ElementsAre(180, 270, 360, 450, 540));
}

TEST(Longitudes, StayWhereTheyAreMonotonicOrExtendOverMoreThanATurn) {
  EXPECT_THAT(continued({0, 100, 359}), ElementsAre(0, 100, 359));
  EXPECT_THAT(continued({0, 200, 300}), ElementsAre(0, 200, 300));
  EXPECT_THAT(continued({0, 170, -90, 10}), ElementsAre(0, 170, -90, 10));
  EXPECT_THAT(continued({0, 10, 5}), ElementsAre(0, 10, 5));
  EXPECT_THAT(continued({10, 10}), ElementsAre(10, 10));
  EXPECT_THAT(continued({}), ElementsAre());
}

TEST(Longitudes, OfARegionAroundGreenwichAreRead) {
  const test::Folder folder;
  {
    test::NetcdfMaker file(folder / "a.nc");
    const int z = file.axis("lev", {1000, 500}, "hPa");
    const int y = file.axis("lat", {40, 50}, "degrees_north");
    const int x = file.axis("lon", {350, 355, 0, 5}, "degrees_east");
    file.variable("T", NC_FLOAT, {z, y, x}, std::vector<double>(16, 280));
  }
  const auto source = open_file(folder / "a.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->info().grid.axes[0].coordinates, ElementsAre(350, 355, 360, 365));
}

// u lies half a cell east of v, on longitudes of another turn.
TEST(Longitudes, OfStaggeredPointsMayPassTheSeamElsewhere) {
  for (const std::vector<double>& faces :
       {std::vector<double>{352.5, 357.5, 2.5, 7.5}, {-7.5, -2.5, 2.5, 7.5}}) {
    const test::Folder folder;
    {
      test::NetcdfMaker file(folder / "a.nc");
      const int y = file.axis("lat", {40, 45, 50}, "degrees_north");
      const int x = file.axis("lon", {350, 355, 0, 5}, "degrees_east");
      const int xu = file.axis("lon_u", faces, "degrees_east");
      std::vector<double> u;
      for (int n = 0; n < 12; ++n) u.push_back(10.0 * (n % 4));
      file.text(file.variable("v", NC_FLOAT, {y, x}, std::vector<double>(12, 1)), "units", "m s-1");
      file.variable("t", NC_FLOAT, {y, x}, std::vector<double>(12, 280));
      file.text(file.variable("u", NC_FLOAT, {y, xu}, u), "units", "m s-1");
    }
    const auto source = test::opened(folder / "a.nc");
    ASSERT_NE(source->info().find("wind"), nullptr) << faces.front();
    const Volume mean = test::volume_of(*source, "u");
    EXPECT_THAT(std::vector<float>(mean.values.begin(), mean.values.begin() + 4),
                ElementsAre(0, 5, 15, 25));
  }
}

// By which the section has its true scale.
TEST(Longitudes, OfASectionKeepTheLatitudeThatWasChosen) {
  const test::Folder folder;
  {
    test::NetcdfMaker file(folder / "a.nc");
    const int z = file.axis("lev", {0, 100}, "m", "height");
    const int y = file.axis("lat", {40, 60}, "degrees_north");
    const int x = file.axis("lon", {0, 5, 10}, "degrees_east");
    file.variable("t", NC_FLOAT, {z, y, x}, test::counting(12));
  }
  const auto source = test::opened(folder / "a.nc?lat=60");
  const Axis& axis = source->info().grid.axes[1];
  EXPECT_EQ(axis.kind, AxisKind::latitude);
  EXPECT_THAT(axis.coordinates, ElementsAre(60));
  EXPECT_EQ(test::volume_of(*source, "t").values[0], 3);
}

}  // namespace
}  // namespace windsplat::data
