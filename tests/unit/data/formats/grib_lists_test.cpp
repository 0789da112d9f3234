// Unstructured grids of GRIB (template 3.101), whose cells lie where a grid file or other messages
// place them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/cf/mesh_maker.hpp"

#ifdef WINDSPLAT_GRIB
#include "tests/unit/data/formats/grib_maker.hpp"

namespace windsplat::data::test {
namespace {

using mesh::at_cells;
using mesh::Table;
using testing::AllOf;
using testing::HasSubstr;

constexpr unsigned char own_uuid = 0x0b;  // each octet
constexpr const char* own_uuid_text = "0b0b0b0b-0b0b-0b0b-0b0b-0b0b0b0b0b0b";

struct Surfaces {
  long first = 1;
  long second = 255;  // type
};

// A message with values of cells at generalized vertical levels, as ICON writes them.
std::string message(long category, long number, const Surfaces& levels, const Table& values,
                    unsigned char uuid = own_uuid, long list = 1, long hour = 0) {
  Maker maker("GRIB2");
  maker.set("gridType", std::string("unstructured_grid"));
  maker.set("numberOfGridUsed", 26L);
  maker.set("numberOfGridInReference", list);
  std::array<unsigned char, 16> digits{};
  digits.fill(uuid);
  std::size_t count = digits.size();
  EXPECT_EQ(codes_set_bytes(maker.handle(), "uuidOfHGrid", digits.data(), &count), CODES_SUCCESS);
  maker.set("discipline", 0L);
  maker.set("parameterCategory", category);
  maker.set("parameterNumber", number);
  maker.set("genVertHeightCoords", 1L);
  maker.set("NV", 6L);
  maker.set("typeOfFirstFixedSurface", 150L);
  maker.set("typeOfSecondFixedSurface", levels.second);
  maker.set("scaleFactorOfFirstFixedSurface", 0L);
  maker.set("scaledValueOfFirstFixedSurface", levels.first);
  if (levels.second == 150) {
    maker.set("scaleFactorOfSecondFixedSurface", 0L);
    maker.set("scaledValueOfSecondFixedSurface", levels.first + 1);
  }
  maker.set("forecastTime", hour);
  maker.set("bitsPerValue", 24L);
  maker.values(values);
  return maker.bytes();
}

constexpr long layer_type = 150;

// A grid file of ICON with the cells of mesh_maker.hpp.
void write_grid(const std::string& path, const std::string& uuid,
                const std::string& dimension = "cell") {
  NetcdfMaker file(path);
  if (!uuid.empty()) file.text(NC_GLOBAL, "uuidOfHGrid", uuid);
  const int cell = file.dimension(dimension, mesh::cells);
  const int corner = file.dimension("nv", 4);
  for (const bool is_x : {true, false}) {
    const std::string name = is_x ? "clon" : "clat";
    const int v =
        file.variable(name, NC_DOUBLE, {cell},
                      at_cells([&](double x, double y) { return (is_x ? x : y) * degree; }));
    file.text(v, "units", "radian");
    file.text(v, "standard_name", is_x ? "grid_longitude" : "grid_latitude");
    file.text(v, "bounds", name + "_vertices");
    Table places;
    for (const double node : mesh::corners(0)) {
      const auto n = static_cast<std::size_t>(node);
      places.push_back((is_x ? mesh::node_x(n) : mesh::node_y(n)) * degree);
    }
    file.variable(name + "_vertices", NC_DOUBLE, {cell, corner}, places);
  }
  file.variable("cell_area", NC_DOUBLE, {cell}, Table(mesh::cells, 1e9));
}

double east(double x, double y) { return mesh::sum_of(x, y); }
double north(double x, double y) { return 7 - x + y; }

// Two layers, whose lower has 1000 more; w at their three faces, and these faces' heights.
std::string icon_file(long hour = 0) {
  std::string bytes;
  for (const long k : {1L, 2L}) {
    const auto more = 1000.0 * static_cast<double>(k - 1);
    const auto raised = [&](double (*f)(double, double)) {
      return at_cells([&](double x, double y) { return f(x, y) + more; });
    };
    bytes += message(2, 2, {k, layer_type}, raised(east), own_uuid, 1, hour);
    bytes += message(2, 3, {k, layer_type}, raised(north), own_uuid, 1, hour);
  }
  for (const long k : {1L, 2L, 3L}) {
    bytes += message(2, 9, {k}, Table(mesh::cells, static_cast<double>(k * k)), own_uuid, 1, hour);
  }
  return bytes;
}

class GribLists : public GribFiles {
 protected:
  // What is refused of a file beside a grid file of that UUID.
  std::string fault_beside_grid(const std::string& bytes, const std::string& uuid) {
    write_grid(folder_ / "grid.nc", uuid);
    write_bytes(folder_ / "a.grib", bytes);
    return refusal(folder_ / "{grid.nc,a.grib}");
  }
};

TEST_F(GribLists, AreDrawnOnTheCellsOfAGridFileWithTheirLayersAndHeights) {
  write_grid(folder_ / "grid.nc", own_uuid_text);
  std::string bytes = icon_file(0) + icon_file(6);
  for (const long k : {1L, 2L, 3L}) {
    bytes += message(3, 6, {k, 101}, Table(mesh::cells, 100.0 * static_cast<double>(9 - k * k)));
  }
  write_bytes(folder_ / "a.grib", bytes);
  for (const char* name : {"{grid.nc,a.grib}", "{a.grib,grid.nc}"}) {
    const auto source = opened(folder_ / name);
    ASSERT_NE(source, nullptr);
    const DatasetInfo& info = source->info();
    ASSERT_EQ(info.steps.size(), 2U);
    // Means of the faces' heights 800, 500 and 0 m: the layers are numbered from the top.
    ASSERT_EQ(info.grid.axes[2].coordinates, (Table{250, 650}));
    EXPECT_EQ(info.grid.axes[2].units, "m");
    const FieldInfo* wind = info.find("wind");
    ASSERT_NE(wind, nullptr);
    EXPECT_EQ(wind->components.size(), 3U);
    EXPECT_TRUE(has_note(info, "CF bounds: a mesh of 24 cells"));
    const Volume volume = volume_of(*source, "wind", 1);
    const auto& axes = info.grid.axes;
    const std::size_t width = axes[0].coordinates.size();
    const std::size_t height = axes[1].coordinates.size();
    ASSERT_EQ(volume.values.size(), width * height * 2 * 3);
    std::size_t compared = 0;
    const std::size_t samples = 2 * width * height;
    for (std::size_t n = 0; n < samples; ++n) {
      const double x = axes[0].coordinates[n % width];
      const double y = axes[1].coordinates[n / width % height];
      if (x < 11 || x > 15 || y < 41 || y > 43) continue;
      const bool is_lower = n < width * height;
      const double more = is_lower ? 1000 : 0;
      ASSERT_NEAR(volume.values[n], east(x, y) + more, 1e-3);
      ASSERT_NEAR(volume.values[samples + n], north(x, y) + more, 1e-3);
      ASSERT_NEAR(volume.values[2 * samples + n], is_lower ? 6.5 : 2.5, 1e-4);
      ++compared;
    }
    EXPECT_GT(compared, 200U);
  }
}

TEST_F(GribLists, HeightsInTheFirstFileOfASeriesHoldForAll) {
  write_grid(folder_ / "grid.nc", own_uuid_text);
  std::string bytes = icon_file(0);
  for (const long k : {1L, 2L, 3L}) {
    bytes += message(3, 6, {k, 101}, Table(mesh::cells, 100.0 * static_cast<double>(9 - k * k)));
  }
  write_bytes(folder_ / "a0.grib", bytes);
  write_bytes(folder_ / "a6.grib", icon_file(6));
  const auto source = opened(folder_ / "{grid.nc,a*.grib}");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  for (const std::size_t step : {0U, 1U}) {
    EXPECT_FALSE(volume_of(*source, "wind", step).values.empty());
    const Volume heights = volume_of(*source, "h", step);
    ASSERT_FALSE(heights.values.empty());
    EXPECT_NEAR(heights.range[0], 250, 1e-3);
    EXPECT_NEAR(heights.range[1], 650, 1e-3);
  }
  EXPECT_EQ(source->info().grid.axes[2].coordinates, (Table{250, 650}));
}

TEST_F(GribLists, AreRefusedBesideAGridOfAnotherUuidOrNumberOfCells) {
  EXPECT_THAT(fault_beside_grid(icon_file(), "0c0b0b0b-0b0b-0b0b-0b0b-0b0b0b0b0b0b"),
              AllOf(HasSubstr("'u' is on a horizontal grid of 24 cells of the UUID "
                              "0b0b0b0b0b0b0b0b0b0b0b0b0b0b0b0b"),
                    HasSubstr("has 24 cells of the UUID 0c0b0b0b")));
  const std::string more = message(0, 0, {1, layer_type}, Table(mesh::cells + 1, 280));
  EXPECT_THAT(fault_beside_grid(more, own_uuid_text),
              AllOf(HasSubstr("'t' is on a horizontal grid of 25 cells"),
                    HasSubstr("the grid that is given has 24 cells")));
}

TEST_F(GribLists, WithoutAUuidInTheGridFileAreTakenByTheNumberOfCells) {
  write_grid(folder_ / "grid.nc", "");
  write_bytes(folder_ / "a.grib", icon_file());
  const auto source = opened(folder_ / "{grid.nc,a.grib}");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(has_note(source->info(), "one of the files has no uuidOfHGrid"));
}

TEST_F(GribLists, AreTakenByTheNumberOfCellsWhateverTheNameOfTheDimension) {
  const Table values = at_cells(east);
  write_bytes(folder_ / "a.grib",
              message(0, 0, {1}, values) + message(0, 1, {1}, Table(mesh::cells, 5), 0x0c));
  for (const char* uuid : {"", "00000000-0000-0000-0000-000000000000"}) {
    for (const char* dimension : {"cell", "ncells"}) {
      write_grid(folder_ / "grid.nc", uuid, dimension);
      write_bytes(folder_ / "b.grib", message(0, 0, {1}, values));
      const auto alone = opened(folder_ / "{grid.nc,b.grib}");
      ASSERT_NE(alone, nullptr) << dimension;
      EXPECT_TRUE(has_note(alone->info(), "one of the files has no uuidOfHGrid")) << dimension;
    }
    const auto source = opened(folder_ / "{grid.nc,a.grib}");
    ASSERT_NE(source, nullptr);
    EXPECT_NE(source->info().find("t"), nullptr);
    EXPECT_EQ(source->info().find("vtmp"), nullptr) << "its grid is another one than that of t";
  }
}

TEST_F(GribLists, FieldsInTwoFilesAreListedAndThoseOfOtherGridsRefused) {
  write_grid(folder_ / "grid.nc", own_uuid_text);
  write_bytes(folder_ / "a.grib", message(0, 0, {1}, at_cells(east)));
  write_bytes(folder_ / "b.grib", message(0, 0, {1}, at_cells(north)));
  write_bytes(folder_ / "c.grib", message(0, 0, {1}, at_cells(north), 0x0c));
  {
    const auto source = opened(folder_ / "{grid.nc,a.grib,b.grib}");
    ASSERT_NE(source, nullptr);
    const auto& left = source->info().left_out;
    EXPECT_TRUE(std::any_of(left.begin(), left.end(), [](const LeftOut& one) {
      return one.name == "t" && one.reason.find("in several files") != std::string::npos;
    }));
  }
  for (const char* uuid : {own_uuid_text, ""}) {
    write_grid(folder_ / "grid.nc", uuid, "ncells");
    EXPECT_THAT(refusal(folder_ / "{grid.nc,a.grib,c.grib}"),
                AllOf(HasSubstr("'t' is on a horizontal grid of 24 cells of the UUID 0c0c0c0c"),
                      HasSubstr("in another file on one of 24 cells of the UUID 0b0b0b0b")));
  }
}

// A list of cells may have as many entries as the mesh has nodes.
TEST_F(GribLists, AreNotDrawnAtTheNodesOfAMesh) {
  {
    NetcdfMaker file(folder_ / "grid.nc");
    const int face = file.dimension("face", mesh::cells);
    const int node = file.dimension("node", mesh::nodes);
    const int mesh = file.variable("mesh", NC_INT, {});
    file.text(mesh, "cf_role", "mesh_topology");
    file.number(mesh, "topology_dimension", NC_INT, {2});
    file.text(mesh, "node_coordinates", "x y");
    file.text(mesh, "face_node_connectivity", "corners");
    const int corners =
        file.variable("corners", NC_INT, {face, file.dimension("four", 4)}, mesh::corners(0));
    file.number(corners, "start_index", NC_INT, {0});
    const Table x = mesh::at_nodes([](double a, double) { return a; });
    const Table y = mesh::at_nodes([](double, double b) { return b; });
    file.text(file.variable("x", NC_DOUBLE, {node}, x), "units", "degrees_east");
    file.text(file.variable("y", NC_DOUBLE, {node}, y), "units", "degrees_north");
  }
  write_bytes(folder_ / "a.grib", message(0, 0, {1}, mesh::at_nodes(east)));
  EXPECT_THAT(refusal(folder_ / "{grid.nc,a.grib}"),
              AllOf(HasSubstr("'t' is on a horizontal grid of 35 cells"),
                    HasSubstr("the grid that is given has 24 cells")));
  write_bytes(folder_ / "b.grib", message(0, 0, {1}, at_cells(east)));
  const auto source = opened(folder_ / "{grid.nc,b.grib}");
  ASSERT_NE(source, nullptr);
  mesh::expect_function(*source, "t", east, 1);
}

TEST_F(GribLists, WithoutPositionsAskForTheFileOfTheirGrid) {
  EXPECT_THAT(fault(icon_file()), AllOf(HasSubstr("outlines are not in the file"),
                                        HasSubstr("of UUID 0b0b0b0b0b0b0b0b0b0b0b0b0b0b0b0b"),
                                        HasSubstr("'{grid.nc,data.grib2}'")));
}

TEST_F(GribLists, OfEdgesAreRefused) {
  EXPECT_THAT(fault(message(2, 34, {1, layer_type}, Table(30, 1), own_uuid, 3)),
              HasSubstr("list 3 of an unstructured grid"));
}

TEST_F(GribLists, AreDrawnAtTheLongitudesAndLatitudesOfTheirFile) {
  constexpr std::size_t side = 16;
  Table x;
  Table y;
  Table values;
  for (std::size_t n = 0; n < side * side; ++n) {
    x.push_back(20 + 0.5 * static_cast<double>(n % side));
    y.push_back(-40 + 0.25 * static_cast<double>(n / side));
    values.push_back(x.back() - 2 * y.back());
  }
  const std::string places = message(191, 2, {0}, x) + message(191, 1, {0}, y);
  const auto source = open(places + message(0, 0, {1, layer_type}, values, own_uuid, 1, 3) +
                           message(0, 0, {1, layer_type}, values, own_uuid, 1, 9));
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  const Volume volume = volume_of(*source, "t", 1);
  const auto& axes = source->info().grid.axes;
  const std::size_t width = axes[0].coordinates.size();
  ASSERT_GT(volume.values.size(), 500U);
  for (std::size_t n = 0; n < volume.values.size(); ++n) {
    ASSERT_NEAR(volume.values[n],
                axes[0].coordinates[n % width] - 2 * axes[1].coordinates[n / width], 1e-3);
  }
  EXPECT_FALSE(has_note(source->info(), "the positions of the first are used"));
  // Positions at further levels are not used.
  const Table others(side * side, 3);
  const std::string more = message(191, 2, {1}, others) + message(191, 1, {1}, others);
  const auto leveled = open(places + more + message(0, 0, {1, layer_type}, values));
  ASSERT_NE(leveled, nullptr);
  EXPECT_TRUE(has_note(leveled->info(),
                       "'tlon' is given at 2 levels: the positions of the first are used"));
  EXPECT_NEAR(leveled->info().grid.axes[0].coordinates.front(), 20, 0.5);
  EXPECT_EQ(leveled->info().grid.axes[2].coordinates.size(), 1U);
  // The positions belong to a grid of another UUID.
  EXPECT_THAT(fault(places + message(0, 0, {1, layer_type}, values, 0x0c)),
              HasSubstr("horizontal grid"));
}

}  // namespace
}  // namespace windsplat::data::test
#endif
