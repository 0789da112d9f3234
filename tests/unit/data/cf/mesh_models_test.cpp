// Models on unstructured meshes that describe them in other ways than UGRID.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/cf/mesh_maker.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

using testing::HasSubstr;

// ----------------------------------------------------------------------------

TEST(MeshModels, HeightsOfFvcomFollowFromSigmaDepthAndSurface) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "f.nc");
    const int node = file.dimension("node", nodes);
    const int nele = file.dimension("nele", cells);
    const int three = file.dimension("three", 4);  // quadrilaterals, for a mesh of this test
    const int siglay = file.dimension("siglay", 2);
    const int time = file.axis("time", {0, 1}, "hours since 2001-01-01", "time");
    const auto x = [](double a, double) { return a; };
    const auto y = [](double, double b) { return b; };
    file.text(file.variable("lon", NC_DOUBLE, {node}, at_nodes(x)), "units", "degrees_east");
    file.text(file.variable("lat", NC_DOUBLE, {node}, at_nodes(y)), "units", "degrees_north");
    file.variable("nv", NC_INT, {three, nele}, turned(corners(1), 4));
    Table sigma(nodes, -0.25);
    sigma.insert(sigma.end(), nodes, -0.75);
    file.variable("siglay", NC_FLOAT, {siglay, node}, sigma);
    file.variable("h", NC_FLOAT, {node}, at_nodes([](double a, double) { return 10 * a; }));
    Table zeta(nodes, 0);
    zeta.insert(zeta.end(), nodes, 2);
    file.variable("zeta", NC_FLOAT, {time, node}, zeta);
    Table u;
    for (const double value : {1.0, 2.0, 3.0, 4.0}) u.insert(u.end(), cells, value);
    file.text(file.variable("u", NC_FLOAT, {time, siglay, nele}, u), "units", "meters s-1");
    file.text(file.variable("v", NC_FLOAT, {time, siglay, nele}, u), "units", "meters s-1");
  }
  const auto source = opened(folder / "f.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_NE(source->info().find("current"), nullptr);
  const Axis& z = source->info().grid.axes[2];
  ASSERT_EQ(z.coordinates.size(), 2U);
  EXPECT_EQ(z.units, "m");
  EXPECT_NEAR(z.coordinates[0], -0.75 * 130, 1);  // the lower layer comes first
  const Volume height = volume_of(*source, "height", 1);
  const std::size_t layer = height.values.size() / 2;
  const double x = source->info().grid.axes[0].coordinates[0];
  EXPECT_NEAR(height.values[0], 2 - 0.75 * (10 * x + 2), 1e-3);
  EXPECT_NEAR(height.values[layer], 2 - 0.25 * (10 * x + 2), 1e-3);
  // The first layer of the file is the upper one.
  EXPECT_EQ(volume_of(*source, "u", 0).values[0], 2.0F);
  EXPECT_EQ(volume_of(*source, "u", 0).values[layer], 1.0F);
}

void write_mpas(const std::string& path, const Table& bottoms) {
  NetcdfMaker file(path);
  const int cell = file.dimension("nCells", cells);
  const int vertex = file.dimension("nVertices", nodes);
  const int edges = file.dimension("maxEdges", 6);
  const int level = file.dimension("nVertLevels", 3);
  file.variable("nEdgesOnCell", NC_INT, {cell}, Table(cells, 4));
  file.variable("verticesOnCell", NC_INT, {cell, edges}, with_padding(corners(1), 12345));
  const auto radians = [](double degrees) { return degrees * degree; };
  file.variable("lonVertex", NC_DOUBLE, {vertex},
                at_nodes([&](double x, double) { return radians(x); }));
  file.variable("latVertex", NC_DOUBLE, {vertex},
                at_nodes([&](double, double y) { return radians(y); }));
  Table temperature;
  for (std::size_t c = 0; c < cells; ++c) temperature.insert(temperature.end(), {20, 10, 4});
  file.variable("temperature", NC_FLOAT, {cell, level}, temperature);
  file.variable("layerThickness", NC_FLOAT, {cell, level}, Table(3 * cells, 1));
  if (!bottoms.empty()) {
    file.text(file.variable("refBottomDepth", NC_DOUBLE, {level}, bottoms), "units", "m");
  }
}

TEST(MeshModels, LevelsOfMpasOceanGoDownward) {
  const Folder folder;
  write_mpas(folder / "depths.nc", {10, 30, 80});
  write_mpas(folder / "numbers.nc", {});
  for (const char* name : {"depths.nc", "numbers.nc"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr);
    const Volume volume = volume_of(*source, "temperature");
    EXPECT_EQ(volume.values[0], 4.0F) << name;  // the deepest is drawn lowest
    EXPECT_EQ(volume.values[volume.values.size() - 1], 20.0F) << name;
    expect_function(
        *source, "temperature", [](double, double) { return 10; }, 0, 1);
  }
  const auto source = opened(folder / "depths.nc");
  EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::depth);
  EXPECT_EQ(source->info().grid.axes[2].coordinates, (Table{55, 20, 5}));
}

// Positions and areas of MPAS have no units by which they could be told from fields.
TEST(MeshModels, DescriptionsOfCellsOfMpasAreNoFields) {
  const Folder folder;
  write_mpas(folder / "mesh.nc", {});
  {
    int id = -1;
    EXPECT_EQ(nc_open((folder / "mesh.nc").c_str(), NC_WRITE, &id), NC_NOERR);
    EXPECT_EQ(nc_redef(id), NC_NOERR);
    int cell = -1;
    EXPECT_EQ(nc_inq_dimid(id, "nCells", &cell), NC_NOERR);
    for (const char* name : {"latCell", "lonCell", "areaCell", "indexToCellID", "ter"}) {
      int variable = -1;
      EXPECT_EQ(nc_def_var(id, name, NC_DOUBLE, 1, &cell, &variable), NC_NOERR);
    }
    EXPECT_EQ(nc_close(id), NC_NOERR);
  }
  const auto source = opened(folder / "mesh.nc");
  EXPECT_TRUE(has_note(source->info(), "?field=ter"));
  for (const char* name : {"latCell", "lonCell", "areaCell", "indexToCellID"}) {
    EXPECT_FALSE(has_note(source->info(), name)) << name;
    EXPECT_EQ(reason_of(source->info(), name), "") << name;
  }
}

// The corners of the cells as bounds of their centers.
void write_grid(const std::string& path) {
  NetcdfMaker file(path);
  const int cell = file.dimension("cell", cells);
  const int corner = file.dimension("nv", 4);
  const Table table = corners(0);
  for (const bool is_x : {true, false}) {
    const std::string name = is_x ? "clon" : "clat";
    const int v =
        file.variable(name, NC_DOUBLE, {cell},
                      at_cells([&](double x, double y) { return (is_x ? x : y) * degree; }));
    file.text(v, "units", "radian");
    file.text(v, "standard_name", is_x ? "longitude" : "latitude");
    file.text(v, "bounds", name + "_vertices");
    Table places;
    for (const double node : table) {
      const auto n = static_cast<std::size_t>(node);
      places.push_back((is_x ? node_x(n) : node_y(n)) * degree);
    }
    file.variable(name + "_vertices", NC_DOUBLE, {cell, corner}, places);
  }
}

TEST(MeshModels, AGridFileMayNameTheCellsOtherwiseAndIconNumbersLevelsFromTheTop) {
  const Folder folder;
  write_grid(folder / "grid.nc");
  {
    NetcdfMaker file(folder / "data.nc");
    const int cell = file.dimension("ncells", cells);
    // ICON numbers levels from the top.
    const int level = file.axis("height", {1, 2}, "", "height");
    file.text(file.variable_id("height"), "long_name", "generalized_height");
    Table values = at_cells([](double x, double y) { return 100 + sum_of(x, y); });
    const Table lower = at_cells(sum_of);
    values.insert(values.end(), lower.begin(), lower.end());
    file.variable("t", NC_FLOAT, {level, cell}, values);
    const int half = file.axis("height_2", {1, 2, 3}, "", "height");
    file.text(file.variable_id("height_2"), "long_name", "generalized_height");
    Table w;
    for (const double value : {1.0, 3.0, 7.0}) w.insert(w.end(), cells, value);
    file.variable("w", NC_FLOAT, {half, cell}, w);
  }
  EXPECT_THAT(refusal(folder / "data.nc"), HasSubstr("unstructured grid"));
  const auto source = opened(folder / "{grid,data}.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[2].coordinates, (Table{2, 1}));
  expect_function(*source, "t", sum_of, 1, 0);
  const auto upper = [](double x, double y) { return 100 + sum_of(x, y); };
  expect_function(*source, "t", upper, 1, 1);
  expect_function(
      *source, "w", [](double, double) { return 5; }, 0, 0);
  expect_function(
      *source, "w", [](double, double) { return 2; }, 0, 1);
}

TEST(MeshModels, LevelsOfIconOnLatitudesAndLongitudesRunFromTheTopTooWhateverTheirUnit) {
  const Folder folder;
  for (const char* unit : {"", "1"}) {
    {
      NetcdfMaker file(folder / "r.nc");
      const int level = file.axis("height", {1, 2, 3}, unit, "height");
      file.text(file.variable_id("height"), "long_name", "generalized_height");
      const int lat = file.axis("lat", {10, 20}, "degrees_north");
      const int lon = file.axis("lon", {30, 40}, "degrees_east");
      file.variable("t", NC_FLOAT, {level, lat, lon}, counting(12));
    }
    const auto source = opened(folder / "r.nc");
    EXPECT_EQ(source->info().grid.axes[2].coordinates, (Table{3, 2, 1})) << unit;
    EXPECT_EQ(volume_of(*source, "t").values[0], 8.0F) << unit;
  }
}

// What the notes say of the error of a mesh of 20 x 12 cells, whose corners are float32 and every
// third of which is one step above, if `apart`.
std::string error_by_float_corners(const std::string& path, bool apart) {
  {
    NetcdfMaker file(path);
    const int cell = file.dimension("cell", 240);
    const int corner = file.dimension("nv", 4);
    std::vector<Table> places(4);
    for (std::size_t c = 0; c < 240; ++c) {
      const auto i = static_cast<double>(c % 20);
      const auto j = static_cast<double>(c / 20);
      places[0].push_back(300 + 0.1 * (i + 0.5));
      places[1].push_back(40 + 0.1 * (j + 0.5));
      for (const auto& [right, up] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        const auto x = static_cast<float>(300 + 0.1 * (i + right));
        const auto y = static_cast<float>(40 + 0.1 * (j + up));
        const bool moved = apart && places[2].size() % 3 == 0;
        places[2].push_back(moved ? std::nextafter(x, 400.0F) : x);
        places[3].push_back(moved ? std::nextafter(y, 90.0F) : y);
      }
    }
    for (const std::size_t a : {0U, 1U}) {
      const std::string name = a == 0 ? "lon" : "lat";
      const int v = file.variable(name, NC_DOUBLE, {cell}, places[a]);
      file.text(v, "units", a == 0 ? "degrees_east" : "degrees_north");
      file.text(v, "bounds", name + "_bounds");
      file.variable(name + "_bounds", NC_FLOAT, {cell, corner}, places[2 + a]);
    }
    file.text(file.variable("t", NC_FLOAT, {cell}, counting(240)), "coordinates", "lon lat");
  }
  const auto source = opened(path);
  for (const std::string& note : source->info().notes) {
    const auto at = note.find("an rms error of");
    if (at != std::string::npos) return note.substr(at);
  }
  return "";
}

TEST(MeshModels, CornersApartByTheRoundingOfTheirTypeAreOneNode) {
  const Folder folder;
  const std::string exact = error_by_float_corners(folder / "exact.nc", false);
  EXPECT_NE(exact, "");
  EXPECT_EQ(error_by_float_corners(folder / "apart.nc", true), exact);
}

TEST(MeshModels, FvcomWithoutPositionsBesidesNorthwardDistancesIsRefused) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "f.nc");
    const int node = file.dimension("node", nodes);
    const int nele = file.dimension("nele", cells);
    file.variable("nv", NC_INT, {file.dimension("three", 4), nele}, turned(corners(1), 4));
    file.text(file.variable("lon", NC_DOUBLE, {node}, Table(nodes, 0)), "units", "degrees_east");
    file.text(file.variable("lat", NC_DOUBLE, {node}, Table(nodes, 0)), "units", "degrees_north");
    file.variable("y", NC_DOUBLE, {node}, at_nodes([](double, double y) { return y; }));
    file.variable("t", NC_FLOAT, {nele}, at_cells(sum_of));
  }
  EXPECT_THAT(refusal(folder / "f.nc"), HasSubstr("no cell of the mesh has an area"));
}

TEST(MeshModels, DataInSeveralFilesAreJoinedWithAGridFile) {
  const Folder folder;
  write_grid(folder / "grid.nc");
  for (int number = 0; number < 2; ++number) {
    NetcdfMaker file(folder / ("data_" + std::to_string(number) + ".nc"));
    const int time = file.axis("time", {1.0 * number}, "hours since 2001-01-01", "time");
    const int cell = file.dimension("ncells", cells);
    file.variable("t", NC_FLOAT, {time, cell}, Table(cells, 7.0 + number));
  }
  const auto source = opened(folder / "{grid,data_*}.nc");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(volume_of(*source, "t", 0).values[0], 7.0F);
  EXPECT_EQ(volume_of(*source, "t", 1).values[0], 8.0F);
  EXPECT_THAT(refusal(folder / "data_*.nc"), HasSubstr("unstructured grid"));
}

}  // namespace
}  // namespace windsplat::data::test::mesh
