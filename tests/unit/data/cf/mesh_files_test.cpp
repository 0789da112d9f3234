// Files of models on unstructured meshes: conventions, orders of dimensions, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;
using Function = std::function<double(double, double)>;
using Table = std::vector<double>;

constexpr std::size_t columns = 6;  // of quadrilaterals of size 1; 4 rows; x from 10, y from 40
constexpr std::size_t rows = 4;
constexpr std::size_t cells = columns * rows;
constexpr std::size_t nodes = (columns + 1) * (rows + 1);

double node_x(std::size_t n) { return 10 + static_cast<double>(n % (columns + 1)); }
double node_y(std::size_t n) { return 40 + static_cast<double>(n / (columns + 1)); }
double cell_x(std::size_t c) { return 10.5 + static_cast<double>(c % columns); }
double cell_y(std::size_t c) { return 40.5 + static_cast<double>(c / columns); }

// Corners of each cell, numbered from `first`.
Table corners(double first) {
  Table out;
  for (std::size_t c = 0; c < cells; ++c) {
    const auto low = static_cast<double>(c / columns * (columns + 1) + c % columns);
    for (const double corner : {low, low + 1, low + columns + 2, low + columns + 1}) {
      out.push_back(corner + first);
    }
  }
  return out;
}

Table with_padding(const Table& four, double fill) {
  Table out;
  for (std::size_t i = 0; i < four.size(); ++i) {
    out.push_back(four[i]);
    if (i % 4 == 3) out.insert(out.end(), {fill, fill});
  }
  return out;
}

Table turned(const Table& table, std::size_t width) {
  Table out;
  for (std::size_t i = 0; i < width; ++i) {
    for (std::size_t c = i; c < table.size(); c += width) out.push_back(table[c]);
  }
  return out;
}

Table at_nodes(const Function& f) {
  Table out;
  for (std::size_t n = 0; n < nodes; ++n) out.push_back(f(node_x(n), node_y(n)));
  return out;
}
Table at_cells(const Function& f) {
  Table out;
  for (std::size_t c = 0; c < cells; ++c) out.push_back(f(cell_x(c), cell_y(c)));
  return out;
}

double sum_of(double x, double y) { return x + 10 * y; }

// A UGRID file without data; those are added by the tests.
struct UgridMaker {
  explicit UgridMaker(const std::string& path, bool on_sphere = true) : file(path) {
    node = file.dimension("node", nodes);
    face = file.dimension("face", cells);
    edge = file.dimension("edge", 9);
    topology = file.variable("Mesh2", NC_INT, {});
    file.text(topology, "cf_role", "mesh_topology");
    file.number(topology, "topology_dimension", NC_INT, {2});
    file.text(topology, "node_coordinates", "nx ny");
    file.text(topology, "face_node_connectivity", "corners");
    file.text(topology, "edge_dimension", "edge");
    const int x =
        file.variable("nx", NC_DOUBLE, {node}, at_nodes([](double a, double) { return a; }));
    const int y =
        file.variable("ny", NC_DOUBLE, {node}, at_nodes([](double, double b) { return b; }));
    file.text(x, "units", on_sphere ? "degrees_east" : "km");
    file.text(y, "units", on_sphere ? "degrees_north" : "km");
  }
  void plain_corners() {
    file.variable("corners", NC_INT, {face, file.dimension("four", 4)}, corners(0));
  }

  NetcdfMaker file;
  int node = -1;
  int face = -1;
  int edge = -1;
  int topology = -1;
};

// Whether every sample of a field of one layer is f, except those within `rim` of the edge, or
// masked.
void expect_function(Source& source, const std::string& name, const Function& f, double rim = 0,
                     std::size_t layer = 0) {
  const Volume volume = volume_of(source, name);
  const auto& axes = source.info().grid.axes;
  const std::size_t width = axes[0].coordinates.size();
  const std::size_t height = axes[1].coordinates.size();
  ASSERT_GT(width * height, 500U);
  std::size_t compared = 0;
  for (std::size_t j = 0; j < height; ++j) {
    for (std::size_t i = 0; i < width; ++i) {
      const double x = axes[0].coordinates[i];
      const double y = axes[1].coordinates[j];
      if (x < 10 + rim || x > 16 - rim || y < 40 + rim || y > 44 - rim) continue;
      const auto value = static_cast<double>(volume.values[(layer * height + j) * width + i]);
      ASSERT_NEAR(value, f(x, y), 1e-4) << name << ' ' << x << ' ' << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100U);
}

TEST(UgridFiles, ConnectivityMayBePaddedTurnedAndNumberedFromZeroOrOne) {
  const Folder folder;
  int number = 0;
  for (const double first : {0.0, 1.0}) {
    for (const bool is_turned : {false, true}) {
      for (const bool padded : {false, true}) {
        const std::string path = folder / ("u" + std::to_string(number++) + ".nc");
        {
          UgridMaker maker(path);
          const std::size_t width = padded ? 6 : 4;
          const int most = maker.file.dimension("most", width);
          Table table = padded ? with_padding(corners(first), -7) : corners(first);
          if (is_turned) table = turned(table, width);
          const int v = maker.file.variable(
              "corners", NC_INT,
              is_turned ? std::vector{most, maker.face} : std::vector{maker.face, most}, table);
          if (padded) maker.file.number(v, "_FillValue", NC_INT, {-7});
          if (first > 0) maker.file.number(v, "start_index", NC_INT, {first});
          maker.file.variable("a", NC_FLOAT, {maker.node}, at_nodes(sum_of));
          maker.file.variable("b", NC_DOUBLE, {maker.face}, at_cells(sum_of));
        }
        const auto source = opened(path);
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(source->info().grid.axes[0].kind, AxisKind::longitude);
        expect_function(*source, "a", sum_of);
        expect_function(*source, "b", sum_of, 1);
        EXPECT_TRUE(has_note(source->info(), "UGRID: a mesh of 24 cells"));
        EXPECT_TRUE(has_note(source->info(), "100 % of the cells contain a sample"));
        EXPECT_TRUE(has_note(source->info(), "rms error"));
      }
    }
  }
}

TEST(UgridFiles, LayersAreReadInAnyOrderOfDimensions) {
  const Folder folder;
  const auto value = [](std::size_t t, std::size_t k, std::size_t n) {
    return 1000.0 * static_cast<double>(t) + 100.0 * static_cast<double>(k) + node_x(n);
  };
  {
    UgridMaker maker(folder / "u.nc", false);
    maker.plain_corners();
    const int time = maker.file.axis("time", {0, 1}, "hours since 2001-01-01", "time");
    const int layer = maker.file.axis("layer", {5, 15, 30}, "m", "height");
    Table last;
    Table first;
    for (std::size_t t = 0; t < 2; ++t) {
      for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t k = 0; k < 3; ++k) last.push_back(value(t, k, n));
      }
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t n = 0; n < nodes; ++n) first.push_back(value(t, k, n));
      }
    }
    maker.file.variable("last", NC_FLOAT, {time, maker.node, layer}, last);
    maker.file.variable("first", NC_DOUBLE, {time, layer, maker.node}, first);
  }
  const auto source = opened(folder / "u.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[0].units, "km");
  ASSERT_EQ(source->info().steps.size(), 2U);
  for (std::size_t step = 0; step < 2; ++step) {
    const Volume first = volume_of(*source, "first", step);
    const Volume last = volume_of(*source, "last", step);
    ASSERT_EQ(first.values.size(), last.values.size());
    const std::size_t layer = first.values.size() / 3;
    for (std::size_t i = 0; i < first.values.size(); ++i) {
      const std::size_t width = source->info().grid.axes[0].coordinates.size();
      const double expected = 1000.0 * static_cast<double>(step) +
                              100.0 * static_cast<double>(i / layer) +
                              source->info().grid.axes[0].coordinates[i % width];
      ASSERT_NEAR(first.values[i], expected, 1e-3);
      ASSERT_EQ(first.values[i], last.values[i]);
    }
  }
}

TEST(UgridFiles, MissingAndPackedValuesAreThoseOfTheFile) {
  const Folder folder;
  {
    UgridMaker maker(folder / "u.nc");
    maker.plain_corners();
    Table stored(cells, 100);
    stored[8] = -99;
    const int v = maker.file.variable("t", NC_SHORT, {maker.face}, stored);
    maker.file.number(v, "scale_factor", NC_DOUBLE, {0.5});
    maker.file.number(v, "add_offset", NC_DOUBLE, {7});
    maker.file.number(v, "_FillValue", NC_SHORT, {-99});
  }
  const auto source = opened(folder / "u.nc");
  ASSERT_NE(source, nullptr);
  const Volume volume = volume_of(*source, "t");
  const auto& axes = source->info().grid.axes;
  for (std::size_t i = 0; i < volume.values.size(); ++i) {
    const double x = axes[0].coordinates[i % axes[0].coordinates.size()];
    const double y = axes[1].coordinates[i / axes[0].coordinates.size()];
    const bool on_edge =
        std::abs(std::remainder(x, 1)) < 1e-9 || std::abs(std::remainder(y, 1)) < 1e-9;
    if (on_edge) continue;  // belongs to either cell
    if (x > 12 && x < 13 && y > 41 && y < 42) {
      ASSERT_TRUE(std::isnan(volume.values[i])) << x << ' ' << y;
    } else {
      ASSERT_EQ(volume.values[i], 57.0F) << x << ' ' << y;
    }
  }
}

TEST(UgridFiles, VelocitiesOnEdgesAreLeftOutByName) {
  const Folder folder;
  {
    UgridMaker maker(folder / "u.nc");
    maker.plain_corners();
    maker.file.variable("depth", NC_FLOAT, {maker.face}, at_cells(sum_of));
    const int u = maker.file.variable("u", NC_FLOAT, {maker.edge}, Table(9, 1));
    maker.file.text(u, "units", "m s-1");
  }
  const auto source = opened(folder / "u.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(reason_of(source->info(), "u"), HasSubstr("edges of the mesh"));
  EXPECT_TRUE(has_note(source->info(), "components of a velocity are not shown: 'u'"));
  EXPECT_THAT(reason_of(source->info(), "corners"), HasSubstr("describes the mesh"));
}

TEST(UgridFiles, MalformedMeshesAreRefusedWithThePlace) {
  struct Case {
    std::size_t corner;
    double value;
    const char* reason;
  };
  const Folder folder;
  int number = 0;
  for (const Case& one : {Case{9, nodes, "cell 3 has no valid node at corner 2: number 35"},
                          Case{9, -1, "cell 3 has no valid node at corner 2: number -1"},
                          Case{9, 0.5, "cell 3 has no valid node at corner 2: number 0.5"},
                          Case{8, -7, "cell 3 has a corner after its padding"}}) {
    const std::string path = folder / ("m" + std::to_string(number++) + ".nc");
    {
      UgridMaker maker(path);
      Table table = corners(0);
      table[one.corner] = one.value;
      const int v = maker.file.variable("corners", NC_DOUBLE,
                                        {maker.face, maker.file.dimension("four", 4)}, table);
      maker.file.number(v, "_FillValue", NC_DOUBLE, {-7});
      maker.file.variable("t", NC_FLOAT, {maker.face}, at_cells(sum_of));
    }
    EXPECT_THAT(refusal(path), HasSubstr(one.reason));
  }
  {
    UgridMaker maker(folder / "few.nc");
    Table table = corners(0);
    table[5] = table[4];
    table[6] = table[7];
    maker.file.variable("corners", NC_INT, {maker.face, maker.file.dimension("four", 4)}, table);
    maker.file.variable("t", NC_FLOAT, {maker.face}, at_cells(sum_of));
  }
  EXPECT_THAT(refusal(folder / "few.nc"),
              HasSubstr("cell 2 has fewer than three different corners: 2"));
  {
    UgridMaker maker(folder / "many.nc");
    maker.file.variable("corners", NC_INT, {maker.face, maker.file.dimension("most", 65)},
                        Table(65 * cells, 1));
    maker.file.variable("t", NC_FLOAT, {maker.face}, at_cells(sum_of));
  }
  EXPECT_THAT(refusal(folder / "many.nc"), HasSubstr("supported are 3 to 64"));
}

TEST(UgridFiles, NodesWithoutAPositionAreRefused) {
  const Folder folder;
  {
    UgridMaker maker(folder / "u.nc");
    maker.plain_corners();
    maker.file.variable("t", NC_FLOAT, {maker.face}, at_cells(sum_of));
    const int y = maker.file.variable(
        "lost", NC_DOUBLE, {maker.node},
        at_nodes([](double x, double y) { return x == 12 && y == 43 ? 91 : y; }));
    maker.file.text(y, "units", "degrees_north");
    maker.file.text(maker.topology, "node_coordinates", "nx lost");
  }
  EXPECT_THAT(refusal(folder / "u.nc"), HasSubstr("node 24 of the mesh has the position 12, 91"));
}

TEST(UgridFiles, CellsThatDoNotLieAtTheirCentersAreRefused) {
  const Folder folder;
  // One cell aside, as with numbers of nodes that start at another index than the file says.
  for (const double aside : {0.0, 1.0}) {
    const std::string path = folder / (aside > 0 ? "aside.nc" : "fits.nc");
    {
      UgridMaker maker(path);
      maker.plain_corners();
      const int x =
          maker.file.variable("fx", NC_DOUBLE, {maker.face},
                              at_cells([&](double a, double) { return a + aside - 360; }));
      const int y = maker.file.variable("fy", NC_DOUBLE, {maker.face},
                                        at_cells([](double, double b) { return b; }));
      maker.file.text(x, "units", "degrees_east");
      maker.file.text(y, "units", "degrees_north");
      maker.file.variable("t", NC_FLOAT, {maker.face}, at_cells(sum_of));
    }
    if (aside > 0) {
      EXPECT_THAT(refusal(path), HasSubstr("do not lie where 'fx' and 'fy' place them: 24 of 24"));
    } else {
      EXPECT_NE(opened(path), nullptr);
    }
  }
}

TEST(UgridFiles, StepsInSeveralFilesShareTheMesh) {
  const Folder folder;
  for (int file = 0; file < 2; ++file) {
    UgridMaker maker(folder / ("u" + std::to_string(file) + ".nc"));
    maker.plain_corners();
    const int time = maker.file.axis("time", {1.0 * file}, "hours since 2001-01-01", "time");
    maker.file.variable("t", NC_FLOAT, {time, maker.face}, Table(cells, 5.0 + file));
  }
  const auto source = opened(folder / "u*.nc");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(volume_of(*source, "t", 0).values[0], 5.0F);
  EXPECT_EQ(volume_of(*source, "t", 1).values[0], 6.0F);
}

// --- other conventions
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

TEST(MeshModels, AGridFileMayNameTheCellsOtherwiseAndIconNumbersLevelsFromTheTop) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "grid.nc");
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

}  // namespace
}  // namespace windsplat::data::test
