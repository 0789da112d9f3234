// Axes of generated files: any order of dimensions, any direction, any naming.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

// A value that encodes its position: the file contains f(x, y, z) = x + 1000 y + z / 16.
float place_value(double x, double y, double z) {
  return static_cast<float>(x + 1000 * y + z / 16);
}

// Every sample of the volume has the value of its coordinates.
void expect_placed(const DatasetInfo& info, const Volume& volume) {
  const auto& [x, y, z] = info.grid.axes;
  ASSERT_EQ(volume.dims, info.grid.dims());
  std::size_t i = 0;
  for (const double zc : z.coordinates) {
    for (const double yc : y.coordinates) {
      for (const double xc : x.coordinates) {
        ASSERT_EQ(volume.values[i], place_value(xc, yc, zc)) << xc << ' ' << yc << ' ' << zc;
        ++i;
      }
    }
  }
}

// The file's dimensions, slowest first: 0 time, 1 z, 2 y, 3 x.
class AnyOrder : public testing::TestWithParam<std::array<int, 4>> {};

TEST_P(AnyOrder, AndAnyDirectionGiveTheSameVolume) {
  const std::array<int, 4> order = GetParam();
  for (int bits = 0; bits < 8; ++bits) {
    std::array<std::vector<double>, 4> coordinates{
        {{0, 6}, {1000, 850, 500, 100, 10}, {-60, -20, 10, 70}, {0, 120, 240}}};
    for (int axis = 1; axis < 4; ++axis) {
      if ((bits >> (axis - 1) & 1) != 0) {
        std::reverse(coordinates.at(axis).begin(), coordinates.at(axis).end());
      }
    }
    const Folder folder;
    {
      NetcdfMaker file(folder / "order.nc");
      const std::array<int, 4> ids{file.axis("time", coordinates[0], "hours since 2001-01-01"),
                                   file.axis("lev", coordinates[1], "hPa"),
                                   file.axis("lat", coordinates[2], "degrees_north"),
                                   file.axis("lon", coordinates[3], "degrees_east")};
      std::vector<int> dims;
      dims.reserve(order.size());
      for (const int axis : order) {
        dims.push_back(ids.at(axis));
      }
      std::vector<double> values;
      std::array<double, 4> at{};
      for (const double a : coordinates.at(order[0])) {
        at.at(order[0]) = a;
        for (const double b : coordinates.at(order[1])) {
          at.at(order[1]) = b;
          for (const double c : coordinates.at(order[2])) {
            at.at(order[2]) = c;
            for (const double d : coordinates.at(order[3])) {
              at.at(order[3]) = d;
              // Step 0 contains the encoded positions, step 6 h their negatives.
              values.push_back(static_cast<double>(place_value(at[3], at[2], at[1])) *
                               (at[0] == 0 ? 1 : -1));
            }
          }
        }
      }
      file.variable("f", NC_FLOAT, dims, values);
    }
    auto source = opened(folder / "order.nc");
    ASSERT_NE(source, nullptr);
    const DatasetInfo& info = source->info();
    ASSERT_EQ(info.grid.dims(), (std::array<int, 3>{3, 4, 5}));
    EXPECT_EQ(info.grid.axes[0].coordinates, (std::vector<double>{0, 120, 240}));
    EXPECT_EQ(info.grid.axes[1].coordinates, (std::vector<double>{-60, -20, 10, 70}));
    EXPECT_EQ(info.grid.axes[2].coordinates, (std::vector<double>{1000, 850, 500, 100, 10}));
    ASSERT_EQ(info.steps.size(), 2U);
    EXPECT_EQ(info.steps[1].text, "2001-01-01T06:00:00Z");
    auto first = source->read(0, 0);
    ASSERT_TRUE(first);
    expect_placed(info, *first);
    auto second = source->read(0, 1);
    ASSERT_TRUE(second);
    for (std::size_t n = 0; n < second->values.size(); ++n) {
      second->values[n] *= -1;
    }
    expect_placed(info, *second);
  }
}

std::vector<std::array<int, 4>> every_order() {
  std::vector<std::array<int, 4>> out;
  std::array<int, 4> order{0, 1, 2, 3};
  do {
    out.push_back(order);
  } while (std::next_permutation(order.begin(), order.end()));
  return out;
}
INSTANTIATE_TEST_SUITE_P(NetcdfAxes, AnyOrder, testing::ValuesIn(every_order()));

// A second dimension of length 1 along one axis is ignored, at any position.
TEST(NetcdfAxes, SecondTimeOrLevelOfLengthOneIsSkipped) {
  for (const int second : {0, 1, 2, 3}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "s.nc");
      const int reference = file.axis("reft", {0}, "hours since 2000-01-01");
      const int t = file.axis("time", {0, 6}, "hours since 2000-01-01", "time");
      const int height = file.axis("height", {2}, "m", "height");
      const int z = file.axis("lev", {1000, 500, 200}, "hPa");
      const int y = file.axis("lat", {0, 10}, "degrees_north");
      const int x = file.axis("lon", {0, 90}, "degrees_east");
      std::vector<int> dims{t, z, y, x};
      if (second < 2) dims.insert(dims.begin() + second, reference);
      if (second >= 2) dims.insert(dims.begin() + second - 1, height);
      file.variable("f", NC_FLOAT, dims, counting(24));
    }
    auto source = opened(folder / "s.nc");
    ASSERT_NE(source, nullptr) << second;
    EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{2, 2, 3}));
    ASSERT_EQ(source->info().steps.size(), 2U);
    EXPECT_EQ(source->read(0, 1)->values[4], 16) << second;
  }
  const Folder folder;
  {
    NetcdfMaker file(folder / "u.nc");  // five without a role: the long ones become the axes
    const std::vector<int> dims{file.dimension("a", 1), file.dimension("b", 2),
                                file.dimension("c", 1), file.dimension("d", 3),
                                file.dimension("e", 4)};
    file.variable("f", NC_FLOAT, dims, counting(24));
  }
  auto source = opened(folder / "u.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{4, 3, 2}));
}

TEST(NetcdfAxes, TimesOutOfOrderAreNoted) {
  struct Case {
    std::vector<double> times;
    std::string note;
  };
  for (const Case& c :
       {Case{{0, 6, 12}, ""}, Case{{12, 0, 6}, "'time' decreases once: "},
        Case{{0, 6, 6, 6}, "'time' does not increase 2 times: "},
        Case{{0, 0, 6, 1, 0}, "'time' decreases 2 times and does not increase once: "}}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "t.nc");
      const int t = file.axis("time", c.times, "hours since 2000-01-01");
      const int y = file.axis("y", {0, 1}, "m");
      const int x = file.axis("x", {0, 1}, "m");
      file.variable("f", NC_FLOAT, {t, y, x}, counting(4 * c.times.size()));
    }
    auto source = opened(folder / "t.nc");
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().steps.size(), c.times.size());
    const auto& notes = source->info().notes;
    EXPECT_EQ(notes.size(), c.note.empty() ? 0U : 1U);
    if (notes.empty()) continue;
    EXPECT_EQ(notes[0].find(c.note), 0U) << notes[0];
  }
}

TEST(NetcdfAxes, RecognizesAxesByTheAxisAttributeAgainstTheNames) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "a.nc");
    const int a = file.axis("y", {5, 6, 7}, "m");  // named y, although the attribute says X
    const int b = file.axis("x", {1, 2}, "m");
    file.text(file.variable_id("y"), "axis", "X");
    file.text(file.variable_id("x"), "axis", "Y");
    file.variable("f", NC_FLOAT, {a, b}, counting(6));
  }
  auto source = opened(folder / "a.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[0].coordinates, (std::vector<double>{5, 6, 7}));
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (std::vector<double>{1, 2}));
  auto volume = source->read(0, 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values, (std::vector<float>{0, 2, 4, 1, 3, 5}));
}

TEST(NetcdfAxes, UnknownDimensionsAreAssignedFromTheRight) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "plain.nc");
    const int a = file.dimension("dim_0", 2);
    const int b = file.dimension("dim_1", 3);
    const int c = file.dimension("dim_2", 4);
    file.variable("f", NC_FLOAT, {a, b, c}, counting(24));
  }
  auto source = opened(folder / "plain.nc");
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{4, 3, 2}));
  EXPECT_EQ(info.grid.axes[0].coordinates, counting(4));
  EXPECT_EQ(info.grid.axes[0].kind, AxisKind::cartesian);
  EXPECT_NE(reason_of(info, "dim_0").find("by index"), std::string::npos);
  auto volume = source->read(0, 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values[23], 23.0F);
  EXPECT_EQ(volume->values[4], 4.0F);
}

TEST(NetcdfAxes, UnknownUnlimitedFirstDimensionIsTime) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "u.nc", 0);
    const int t = file.dimension("snap", NC_UNLIMITED);
    const int y = file.dimension("a", 2);
    const int x = file.dimension("b", 3);
    file.variable("f", NC_FLOAT, {t, y, x}, counting(18));
  }
  auto source = opened(folder / "u.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[2].text, "2");
  auto volume = source->read(0, 2);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values[0], 12.0F);
}

TEST(NetcdfAxes, UnevenAxesAndWrappedLongitudesAreKept) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "w.nc");
    const int y = file.axis("lat", {-87.5, -30, 0, 1, 89}, "degrees_north");
    const int x = file.axis("lon", {20.5, 180, 359, 379.5}, "degrees_east");
    file.variable("f", NC_FLOAT, {y, x}, counting(20));
  }
  auto source = opened(folder / "w.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[0].coordinates, (std::vector<double>{20.5, 180, 359, 379.5}));
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (std::vector<double>{-87.5, -30, 0, 1, 89}));
}

TEST(NetcdfAxes, DimensionsOfOne) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "one.nc");
    const int t = file.axis("time", {7}, "days since 2000-02-28");
    const int m = file.dimension("member", 1);
    const int z = file.axis("lev", {500}, "hPa");
    const int y = file.axis("lat", {45}, "degrees_north");
    const int x = file.axis("lon", {0, 90}, "degrees_east");
    file.variable("f", NC_FLOAT, {t, m, z, y, x}, {3, 4});
  }
  auto source = opened(folder / "one.nc");
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{2, 1, 1}));
  EXPECT_EQ(info.grid.axes[2].coordinates, std::vector<double>{500});
  EXPECT_EQ(info.steps[0].text, "2000-03-06T00:00:00Z");
  auto volume = source->read(0, 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values, (std::vector<float>{3, 4}));
}

TEST(NetcdfAxes, FileWithoutTimeHasOneStepNamedByAScalarTime) {
  const Folder folder;
  for (const bool timed : {false, true}) {
    {
      NetcdfMaker file(folder / "t.nc");
      const int y = file.axis("y", {0, 1}, "m");
      const int x = file.axis("x", {0, 1}, "m");
      file.variable("f", NC_FLOAT, {y, x}, counting(4));
      if (timed) {
        file.text(file.variable("time", NC_DOUBLE, {}, {36}), "units", "hours since 2001-01-01");
      }
    }
    auto source = opened(folder / "t.nc");
    ASSERT_NE(source, nullptr);
    ASSERT_EQ(source->info().steps.size(), 1U);
    EXPECT_EQ(source->info().steps[0].text, timed ? "2001-01-02T12:00:00Z" : "0");
    EXPECT_EQ(source->info().time_units.empty(), !timed);
  }
}

// 16 longitudes of a turn and 8 latitudes from pole to pole, by their unit or without one.
TEST(NetcdfAxes, RadiansWithoutUnitAreNoted) {
  const Folder folder;
  constexpr double pi = std::numbers::pi;
  for (const double turn : {2 * pi, 360.0, 6.0}) {
    {
      NetcdfMaker file(folder / "r.nc");
      std::vector<double> lon;
      std::vector<double> lat;
      for (int n = 0; n < 16; ++n) lon.push_back(n * turn / 16);
      for (int n = 0; n < 8; ++n) lat.push_back((n / 7.0 - 0.5) * turn / 2);
      const int y = file.axis("lat", lat, "");
      const int x = file.axis("lon", lon, "");
      file.variable("f", NC_FLOAT, {y, x}, counting(128));
    }
    const auto source = opened(folder / "r.nc");
    for (const char* name : {"'lon' has no unit", "'lat' has no unit"}) {
      EXPECT_EQ(has_note(source->info(), name), turn == 2 * pi) << turn;
    }
  }
}

TEST(NetcdfAxes, TimeWithGapsIsCounted) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "t.nc");
    const int t = file.axis("time", {0, std::nan(""), 2}, "days since 2001-01-01");
    const int y = file.axis("y", {0, 1}, "m");
    const int x = file.axis("x", {0, 1}, "m");
    file.variable("f", NC_FLOAT, {t, y, x}, counting(12));
  }
  auto source = opened(folder / "t.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().steps.at(2).text, "2");
  EXPECT_TRUE(std::any_of(source->info().left_out.begin(), source->info().left_out.end(),
                          [](const LeftOut& left) {
                            return left.reason == "time is missing at step 1: steps are numbered";
                          }));
}

TEST(NetcdfAxes, CoordinatesThatAreNotMonotonicAreRefused) {
  const Folder folder;
  const std::vector<std::vector<double>> bad{
      {0, 1, 1}, {0, 2, 1}, {3, 1, 2}, {0, std::nan(""), 2}, {0, 1, INFINITY}};
  for (const auto& coordinates : bad) {
    {
      NetcdfMaker file(folder / "m.nc");
      const int y = file.axis("lat", coordinates, "degrees_north");
      const int x = file.axis("lon", {0, 1}, "degrees_east");
      file.variable("f", NC_FLOAT, {y, x}, counting(6));
    }
    const std::string message = refusal(folder / "m.nc");
    EXPECT_NE(message.find("'lat'"), std::string::npos) << message;
    EXPECT_NE(message.find("m.nc"), std::string::npos) << message;
  }
}

TEST(NetcdfAxes, CurvilinearCoordinatesDecideDimensionDirections) {
  // Rows run east and columns south, which no name indicates; longitude crosses the date line.
  const Folder folder;
  {
    NetcdfMaker file(folder / "c.nc");
    const int a = file.dimension("a", 3);
    const int b = file.dimension("b", 4);
    std::vector<double> lon;
    std::vector<double> lat;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 4; ++j) {
        lon.push_back(std::remainder(175 + 4.0 * i + 0.25 * j, 360));
        lat.push_back(50 - 3.0 * j + 0.5 * i);
      }
    }
    file.text(file.variable("longs", NC_DOUBLE, {a, b}, lon), "units", "degrees_east");
    file.text(file.variable("lats", NC_DOUBLE, {a, b}, lat), "units", "degrees_north");
    file.text(file.variable("f", NC_FLOAT, {a, b}, counting(12)), "coordinates", "longs lats");
  }
  auto source = opened(folder / "c.nc");
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{3, 4, 1}));
  EXPECT_EQ(info.grid.axes[0].name, "a");
  auto volume = source->read(0, 0);
  ASSERT_TRUE(volume);
  // South-west corner: i = 0, j = 3; then eastwards with increasing i, northwards with decreasing
  // j.
  EXPECT_EQ(volume->values, (std::vector<float>{3, 7, 11, 2, 6, 10, 1, 5, 9, 0, 4, 8}));
  EXPECT_EQ(reason_of(info, "longs"), "") << "in use";
  // Every column is at the position given by the file, in the order of volumes; the date line
  // causes no jump.
  ASSERT_NE(info.grid.columns, nullptr);
  const Columns& columns = *info.grid.columns;
  ASSERT_EQ(columns.longitude.size(), 12U);
  const double turns = columns.longitude[0] - (175 + 0.25 * 3);
  EXPECT_NEAR(std::remainder(turns, 360), 0, 1e-9);
  for (int n = 0; n < 12; ++n) {
    const int i = n % 3;
    const int j = 3 - n / 3;
    const auto at = static_cast<std::size_t>(n);
    EXPECT_NEAR(columns.longitude[at], turns + 175 + 4.0 * i + 0.25 * j, 1e-9) << n;
    EXPECT_NEAR(columns.latitude[at], 50 - 3.0 * j + 0.5 * i, 1e-9) << n;
  }
}

TEST(NetcdfAxes, CurvilinearCoordinatesWithGapsGiveDirectionsOnly) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "g.nc");
    const int y = file.dimension("y", 2);
    const int x = file.dimension("x", 3);
    file.text(file.variable("lon", NC_DOUBLE, {y, x}, {0, 1, 2, 0, std::nan(""), 2}), "units",
              "degrees_east");
    file.text(file.variable("lat", NC_DOUBLE, {y, x}, {0, 0, 0, 1, 1, 1}), "units",
              "degrees_north");
    file.variable("f", NC_FLOAT, {y, x}, counting(6));
  }
  auto source = opened(folder / "g.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{3, 2, 1}));
  EXPECT_EQ(source->info().grid.columns, nullptr);
}

}  // namespace
}  // namespace windsplat::data::test
