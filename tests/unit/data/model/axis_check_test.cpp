// Axes whose coordinates are strictly monotonic but leave no room for cells are refused.
#include "server/data/model/axis_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "server/data/open/open.hpp"
#include "tests/unit/data/formats/vtk/vtk_maker.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;
using vtk_test::refusal;
using vtk_test::VtkFolder;
using vtk_test::VtkXml;

std::string spaced(const std::string& spacing) {
  VtkXml xml;
  return xml.image({3, 3, 3}, "Origin=\"0 0 0\" Spacing=\"" + spacing + "\"",
                   xml.array("Float32", "f", 1, std::vector<double>(27, 1)));
}

TEST(AxisCheck, UsualAxesPass) {
  const std::vector<std::vector<double>> axes{
      {5},
      {1e17},
      {0, 1, 2},
      {1000, 500, 100},                    // pressure descends
      {1000, 1, 1e-3, 1e-6, 4e-10},        // to the top of the thermosphere
      {5'000'000, 5'000'001, 5'000'002},   // metres of a map projection
      {1.0F, std::nextafter(1.0F, 2.0F)},  // neighbouring floats
      {0, 1e-280}};
  for (const auto& axis : axes) EXPECT_EQ(axis_fault(axis), "") << axis.front();
}

TEST(AxisCheck, AxesWithoutRoomForCellsAreRefused) {
  const std::vector<std::pair<std::vector<double>, std::string>> axes{
      {{}, "no coordinates"},
      {{0, std::nan("")}, "missing values"},
      {{0, HUGE_VAL}, "missing values"},
      {{0, 1, 1}, "not strictly monotonic"},
      {{0, 2, 1}, "not strictly monotonic"},
      {{0, 5e-324, 1e-323}, "coordinates closer"},
      {{0, 1e-20, 1}, "coordinates closer"},
      {{-1.7e308, 1.7e308}, "beyond 1e290"},
      {{1e16, 1e16 + 2, 1e16 + 4}, "closer than their rounding error"}};
  for (const auto& [axis, fault] : axes) EXPECT_THAT(axis_fault(axis), HasSubstr(fault));
}

TEST(AxisCheck, RefusedAxisIsNamedForEveryFormat) {
  const VtkFolder vtk;
  EXPECT_THAT(refusal(vtk.write("a.vti", spaced("5e-324 1 1"))), HasSubstr("coordinates closer"));
  EXPECT_THAT(refusal(vtk.write("b.vti", spaced("1 1e300 1"))), HasSubstr("beyond 1e290"));
  EXPECT_EQ(refusal(vtk.write("c.vti", spaced("1 1e-200 1"))), "");

  const Folder folder;
  {
    NetcdfMaker file(folder / "a.nc");
    const int y = file.axis("lat", {-10, 0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 5e-324, 1e-323, 1.5e-323}, "degrees_east");
    file.variable("f", NC_FLOAT, {y, x}, std::vector<double>(12, 1));
  }
  const auto source = open_file(folder / "a.nc");
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(source.error().message, HasSubstr("'lon'"));
}

}  // namespace
}  // namespace windsplat::data::test
