// Vertical axes of generated files: pressure, height, depth or levels, and their direction.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

struct VerticalCase {
  const char* name;
  const char* units;
  const char* standard_name;
  const char* positive;
  AxisKind kind;
  bool falls;  // index 0, the bottom, has the largest coordinate
};

class Vertical : public testing::TestWithParam<VerticalCase> {};

TEST_P(Vertical, KindAndDirection) {
  const VerticalCase& expected = GetParam();
  const Folder folder;
  {
    NetcdfMaker file(folder / "v.nc");
    const int z = file.axis(expected.name, {1, 2, 4}, expected.units, expected.standard_name);
    if (*expected.positive != '\0') {
      file.text(file.variable_id(expected.name), "positive", expected.positive);
    }
    const int y = file.axis("lat", {0, 1}, "degrees_north");
    const int x = file.axis("lon", {0, 1}, "degrees_east");
    file.variable("f", NC_DOUBLE, {z, y, x}, counting(12));
  }
  auto source = opened(folder / "v.nc");
  ASSERT_NE(source, nullptr);
  const Axis& axis = source->info().grid.axes[2];
  EXPECT_EQ(axis.kind, expected.kind);
  EXPECT_EQ(axis.name, expected.name);
  EXPECT_EQ(axis.coordinates,
            expected.falls ? (std::vector<double>{4, 2, 1}) : (std::vector<double>{1, 2, 4}));
  auto volume = source->read(0, 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values[0], expected.falls ? 8.0F : 0.0F);
}

INSTANTIATE_TEST_SUITE_P(
    NetcdfAxes, Vertical,
    testing::Values(VerticalCase{"lev", "hPa", "", "", AxisKind::pressure, true},
                    VerticalCase{"p", "millibars", "", "down", AxisKind::pressure, true},
                    VerticalCase{"foo", "Pa", "", "", AxisKind::pressure, true},
                    VerticalCase{"plev", "", "air_pressure", "", AxisKind::pressure, true},
                    VerticalCase{"lev", "mb", "", "up", AxisKind::pressure, true},
                    VerticalCase{"height", "m", "height", "up", AxisKind::height, false},
                    VerticalCase{"alt", "km", "", "", AxisKind::height, false},
                    VerticalCase{"z", "m", "", "", AxisKind::height, false},
                    VerticalCase{"z", "m", "", "down", AxisKind::depth, true},
                    VerticalCase{"depth", "m", "depth", "down", AxisKind::depth, true},
                    VerticalCase{"depth", "m", "", "", AxisKind::depth, true},
                    VerticalCase{"depth", "m", "depth", "up", AxisKind::height, false},
                    VerticalCase{"deptht", "m", "", "", AxisKind::depth, true},
                    VerticalCase{"lev", "level", "", "", AxisKind::level, false},
                    VerticalCase{"lev", "1", "", "down", AxisKind::level, true},
                    VerticalCase{"lev", "1", "atmosphere_sigma_coordinate", "", AxisKind::level,
                                 true},
                    VerticalCase{"lev", "", "model_level_number", "", AxisKind::level, false},
                    VerticalCase{"isobaric1", "", "", "", AxisKind::pressure, true},
                    VerticalCase{"pres", "dbar", "", "", AxisKind::depth, true},
                    VerticalCase{"pres", "Pa", "sea_water_pressure", "", AxisKind::depth, true},
                    VerticalCase{"p", "decibar", "sea_water_pressure", "up", AxisKind::depth, true},
                    VerticalCase{"p", "dbar", "air_pressure", "", AxisKind::pressure, true},
                    VerticalCase{"sigma", "sigma_level", "", "", AxisKind::level, true},
                    VerticalCase{"sigma", "sigma_level", "", "up", AxisKind::level, false},
                    VerticalCase{"lev", "sigma_level", "", "", AxisKind::level, false}));

TEST(NetcdfAxes, ValuesDecideTheDirectionWithoutPositive) {
  struct Case {
    const char* name;
    const char* units;
    const char* standard_name;
    const char* positive;
    std::vector<double> stored;
    AxisKind kind;
    double lowest;
  };
  const std::vector<Case> cases{
      {"depth", "m", "", "", {-5, -100, -500}, AxisKind::height, -500},
      {"depth", "m", "depth", "", {-500, -100, 0}, AxisKind::height, -500},
      {"depth", "m", "", "", {0, 100, 500}, AxisKind::depth, 500},
      {"depth", "m", "", "", {-1, 100, 500}, AxisKind::depth, 500},
      {"depth", "m", "", "down", {-500, -100, -5}, AxisKind::depth, -5},
      {"lev", "sigma_level", "", "", {0.1, 0.5, 0.995}, AxisKind::level, 0.995},
      {"sigma", "1", "", "", {0, -0.5, -1}, AxisKind::level, -1}};
  for (const Case& c : cases) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "v.nc");
      const int z = file.axis(c.name, c.stored, c.units, c.standard_name);
      if (*c.positive != '\0') file.text(file.variable_id(c.name), "positive", c.positive);
      const int y = file.axis("lat", {0, 1}, "degrees_north");
      const int x = file.axis("lon", {0, 1}, "degrees_east");
      file.variable("uo", NC_DOUBLE, {z, y, x}, counting(12));
      file.variable("vo", NC_DOUBLE, {z, y, x}, counting(12));
    }
    auto source = opened(folder / "v.nc");
    ASSERT_NE(source, nullptr);
    const Axis& axis = source->info().grid.axes[2];
    EXPECT_EQ(axis.kind, c.kind) << c.name << c.stored[0];
    EXPECT_EQ(axis.coordinates.front(), c.lowest) << c.name << c.stored[0];
    const auto& notes = source->info().notes;
    EXPECT_EQ(std::any_of(notes.begin(), notes.end(),
                          [](const std::string& note) {
                            return note.find("interpreted as heights") != std::string::npos;
                          }),
              c.kind == AxisKind::height);
  }
}

TEST(NetcdfAxes, OceanPressureIsNotAirPressure) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "o.nc");
    const int z = file.axis("pres", {0, 10, 1000}, "dbar", "sea_water_pressure");
    const int y = file.axis("lat", {0, 1}, "degrees_north");
    const int x = file.axis("lon", {0, 1}, "degrees_east");
    file.variable("t", NC_DOUBLE, {z, y, x}, counting(12));
  }
  auto source = opened(folder / "o.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().fields.size(), 1U);  // heights cannot be derived from the standard
                                                // atmosphere
  EXPECT_EQ(source->info().grid.axes[2].coordinates, (std::vector<double>{1000, 10, 0}));
}

}  // namespace
}  // namespace windsplat::data::test
