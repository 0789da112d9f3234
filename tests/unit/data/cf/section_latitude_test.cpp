// The latitude of a section of longitudes: a scalar that its fields name.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

TEST(SectionLatitude, IsAScalarThatTheFieldNamesAndNoOther) {
  for (const bool is_named : {false, true}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "s.nc");
      const int z = file.axis("height", {100, 200}, "m", "height");
      const int x = file.axis("lon", {0, 1, 2}, "degrees_east");
      const int place = file.variable("radar_site_latitude", NC_DOUBLE, {}, {80});
      file.text(place, "units", "degrees_north");
      const int t = file.variable("t", NC_FLOAT, {z, x}, counting(6, 250));
      if (is_named) file.text(t, "coordinates", "radar_site_latitude");
    }
    const auto source = opened(folder / "s.nc");
    const Axis& axis = source->info().grid.axes[1];
    EXPECT_EQ(axis.kind == AxisKind::latitude, is_named);
    if (is_named) {
      EXPECT_EQ(axis.coordinates, std::vector<double>{80});
    }
  }
}

}  // namespace
}  // namespace windsplat::data::test
