// Fields whose `coordinates` name other 2-D positions of the same rows and columns than the grid's.
#include "server/data/cf/staggered/column_offsets.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::offsets {
namespace {

constexpr std::size_t rows = 20;
constexpr std::size_t columns = 24;

double longitude_at(double i, double j) { return 10 + 0.5 * i + 0.05 * j; }
double latitude_at(double i, double j) { return 40 + 0.5 * j - 0.05 * i; }
// Linear in i and j, so that means of neighbours are exact.
double value_at(double i, double j) { return longitude_at(i, j) + 2 * latitude_at(i, j); }

// values: of (i, j) of the grid, moved by `di` and `dj` cells.
template <class F>
std::vector<double> over_columns(double di, double dj, F value) {
  std::vector<double> out;
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      out.push_back(value(static_cast<double>(i) + di, static_cast<double>(j) + dj));
    }
  }
  return out;
}

// Fields at positions of their own, on dimensions that all share, as POP and CICE write them.
class SharedColumns : public testing::Test {
 protected:
  void add_positions(const std::string& prefix, double di, double dj) {
    for (const bool east : {true, false}) {
      const int id = file_.variable(
          prefix + (east ? "LONG" : "LAT"), NC_DOUBLE, {y_, x_},
          east ? over_columns(di, dj, longitude_at) : over_columns(di, dj, latitude_at));
      file_.text(id, "units", east ? "degrees_east" : "degrees_north");
    }
  }
  void add_field(const std::string& name, const std::string& prefix, double di, double dj,
                 const std::string& units = "degC") {
    const int id = file_.variable(name, NC_DOUBLE, {y_, x_}, over_columns(di, dj, value_at));
    file_.text(id, "units", units);
    file_.text(id, "coordinates", prefix + "LONG " + prefix + "LAT");
  }
  std::unique_ptr<Source> source() {
    file_.finish();
    return opened(folder_ / "c.nc");
  }
  // Away from the first row and column, which have one neighbour only.
  static void expect_at_centers(Source& source, const std::string& field) {
    const Volume volume = volume_of(source, field);
    ASSERT_EQ(volume.values.size(), rows * columns);
    for (std::size_t j = 1; j + 1 < rows; ++j) {
      for (std::size_t i = 1; i + 1 < columns; ++i) {
        ASSERT_NEAR(volume.values[j * columns + i],
                    value_at(static_cast<double>(i), static_cast<double>(j)), 1e-4)
            << field << ' ' << i << ' ' << j;
      }
    }
  }

  Folder folder_;
  NetcdfMaker file_{folder_ / "c.nc"};
  int y_ = file_.dimension("nlat", rows);
  int x_ = file_.dimension("nlon", columns);
};

TEST_F(SharedColumns, FieldsAtCornersAreAveragedToTheCentersOfOthers) {
  add_positions("U", 0.5, 0.5);  // first in the file, as in POP's
  add_positions("T", 0, 0);
  add_field("TEMP", "T", 0, 0);
  add_field("SALT", "T", 0, 0);
  add_field("UVEL", "U", 0.5, 0.5, "cm/s");
  add_field("VVEL", "U", 0.5, 0.5, "cm/s");
  const auto made = source();
  ASSERT_NE(made, nullptr);
  ASSERT_NE(made->info().grid.columns, nullptr);
  EXPECT_NEAR(made->info().grid.columns->longitude[0], 10, 1e-9);
  expect_at_centers(*made, "TEMP");
  EXPECT_TRUE(has_note(made->info(), "averaged to the centers of its cells: 'UVEL', 'VVEL'"));
}

TEST_F(SharedColumns, ScalarsHalfACellBesideInOneDirectionAreAveraged) {
  add_positions("T", 0, 0);
  add_positions("E", 0.5, 0);
  add_positions("S", 0, -0.5);
  add_field("a", "T", 0, 0);
  add_field("b", "T", 0, 0);
  add_field("q", "E", 0.5, 0);
  add_field("r", "S", 0, -0.5);
  const auto made = source();
  ASSERT_NE(made, nullptr);
  expect_at_centers(*made, "a");
  expect_at_centers(*made, "q");
  expect_at_centers(*made, "r");
  EXPECT_TRUE(has_note(made->info(), "averaged to the centers of its cells: 'q', 'r'"));
}

TEST_F(SharedColumns, EqualPositionsOfOtherNamesAreNotAveraged) {
  add_positions("T", 0, 0);
  add_positions("E", 0, 0);
  add_field("a", "T", 0, 0);
  add_field("b", "T", 0, 0);
  add_field("q", "E", 0, 0);
  const auto made = source();
  ASSERT_NE(made, nullptr);
  expect_at_centers(*made, "q");
  EXPECT_FALSE(has_note(made->info(), "averaged"));
}

TEST_F(SharedColumns, FieldsElsewhereAreLeftOutWithTheReason) {
  add_positions("T", 0, 0);
  add_positions("E", 3, 0);
  add_field("a", "T", 0, 0);
  add_field("b", "T", 0, 0);
  add_field("q", "E", 3, 0);
  const auto made = source();
  ASSERT_NE(made, nullptr);
  EXPECT_EQ(made->info().find("q"), nullptr);
  EXPECT_EQ(reason_of(made->info(), "q"),
            "its positions, 'ELONG' and 'ELAT', are neither those of the grid, 'TLONG' and "
            "'TLAT', nor half a cell beside them");
}

TEST(ColumnOffsets, AreMeasuredInCellsByTheMedian) {
  const auto places = [](double di, double dj) {
    return cf::ColumnPlaces{over_columns(di, dj, longitude_at), over_columns(di, dj, latitude_at),
                            columns};
  };
  auto moved = places(-0.5, 0.25);
  for (double& longitude : moved.longitude) longitude += 360;
  moved.latitude[25] = 1e6;  // one that is no position
  const auto offset = cf::offset_in_cells(places(0, 0), moved);
  ASSERT_TRUE(offset);
  EXPECT_NEAR((*offset)[0], 0.25, 0.01);
  EXPECT_NEAR((*offset)[1], -0.5, 0.01);
  EXPECT_EQ(cf::first_face_at(-0.45), 0);
  EXPECT_EQ(cf::first_face_at(0.55), -1);
  EXPECT_FALSE(cf::first_face_at(0.3));
}

// Cut out of a file of ROMS: as many columns of u as of the centers, whose places tell which.
TEST(CutStaggering, AsManyFacesAsCentersAreTakenByTheirPositions) {
  for (const double side : {0.5, -0.5}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "r.nc");
      const int y = file.dimension("eta_rho", rows);
      const int yu = file.dimension("eta_u", rows);
      const int x = file.dimension("xi_rho", columns);
      const int xu = file.dimension("xi_u", columns);
      for (const bool east : {true, false}) {
        const std::string name = east ? "lon" : "lat";
        const std::string units = east ? "degrees_east" : "degrees_north";
        const auto value = east ? longitude_at : latitude_at;
        file.text(file.variable(name + "_rho", NC_DOUBLE, {y, x}, over_columns(0, 0, value)),
                  "units", units);
        file.text(file.variable(name + "_u", NC_DOUBLE, {yu, xu}, over_columns(side, 0, value)),
                  "units", units);
      }
      file.variable("temp", NC_DOUBLE, {y, x}, over_columns(0, 0, value_at));
      file.variable("u", NC_DOUBLE, {yu, xu}, over_columns(side, 0, value_at));
    }
    const auto source = opened(folder / "r.nc");
    ASSERT_NE(source, nullptr);
    const Volume volume = volume_of(*source, "u");
    ASSERT_EQ(volume.values.size(), rows * columns);
    EXPECT_NEAR(volume.values[5 * columns + 7], value_at(7, 5), 1e-4) << side;
  }
}

TEST(CutStaggering, AsManyFacesAsCentersWithoutPositionsAreLeftOut) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "wrfout.nc");
    const int y = file.dimension("south_north", rows);
    const int x = file.dimension("west_east", columns);
    const int faces = file.dimension("west_east_stag", columns);
    file.variable("T2", NC_DOUBLE, {y, x}, over_columns(0, 0, value_at));
    file.variable("Q2", NC_DOUBLE, {y, x}, over_columns(0, 0, value_at));
    file.variable("UST", NC_DOUBLE, {y, faces}, over_columns(0.5, 0, value_at));
  }
  const auto source = opened(folder / "wrfout.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().find("UST"), nullptr);
  EXPECT_NE(reason_of(source->info(), "UST"), "");
}

// Meso-NH: nj_u has the values of nj, so that nothing is averaged along it.
TEST(TwinDimensions, FieldsOnEqualCoordinatesAreNotCalledAveraged) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "m.nc");
    const std::vector<double> metres{500, 1500, 2500, 3500};
    const int y = file.axis("nj", metres, "m");
    const int yu = file.axis("nj_u", metres, "m");
    const int x = file.axis("ni", metres, "m");
    for (const char* name : {"a", "b"}) file.variable(name, NC_DOUBLE, {y, x}, counting(16));
    file.text(file.variable("UT", NC_DOUBLE, {yu, x}, counting(16)), "units", "m s-1");
  }
  const auto source = opened(folder / "m.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_NE(source->info().find("UT"), nullptr);
  EXPECT_FALSE(has_note(source->info(), "averaged"));
}

}  // namespace
}  // namespace windsplat::data::test::offsets
