// Longitudes of regions that contain the edge of their range.
#include "server/data/cf/grid/longitudes.hpp"

#include <gmock/gmock.h>

#include <vector>

#include "server/data/open/open.hpp"
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

TEST(Longitudes, StayWhereTheyAreMonotonicOrExtendOverATurn) {
  EXPECT_THAT(continued({0, 100, 359}), ElementsAre(0, 100, 359));
  EXPECT_THAT(continued({0, 200, 300}), ElementsAre(0, 200, 300));
  EXPECT_THAT(continued({0, 180, -90, 0}), ElementsAre(0, 180, -90, 0));
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

}  // namespace
}  // namespace windsplat::data
