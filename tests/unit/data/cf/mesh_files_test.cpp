// UGRID files on unstructured meshes: orders of dimensions, padding, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "tests/unit/data/cf/mesh_maker.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

using testing::HasSubstr;

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

// Without start_index: the numbers as they are, and two ways to know better.
TEST(UgridFiles, NumbersFromOneAreRecognisedWithoutStartIndex) {
  const Folder folder;
  struct Case {
    double first;
    std::size_t spare;  // nodes after the last that cells have, so that no number is out of range
    bool noted;
  };
  for (const Case& one : {Case{0, 0, false}, Case{1, 0, true}, Case{1, 3, true}}) {
    const std::string path = folder / "n.nc";
    {
      UgridMaker maker(path);
      NetcdfMaker& file = maker.file;
      const int node = file.dimension("nodes_and_spare", nodes + one.spare);
      for (const bool is_x : {true, false}) {
        Table places = at_nodes([&](double x, double y) { return is_x ? x : y; });
        places.resize(nodes + one.spare, is_x ? 17 : 45);
        const int v = file.variable(is_x ? "px" : "py", NC_DOUBLE, {node}, places);
        file.text(v, "units", is_x ? "degrees_east" : "degrees_north");
      }
      file.text(maker.topology, "node_coordinates", "px py");
      file.variable("corners", NC_INT, {maker.face, file.dimension("four", 4)}, corners(one.first));
      file.variable("b", NC_DOUBLE, {maker.face}, at_cells(sum_of));
    }
    const auto source = opened(path);
    ASSERT_NE(source, nullptr);
    expect_function(*source, "b", sum_of, 1);
    EXPECT_EQ(
        has_note(source->info(),
                 one.spare > 0 ? "'corners' has no start_index, but cells would be much longer"
                               : "'corners' has no start_index, but its numbers of nodes can "
                                 "only count from 1"),
        one.noted);
  }
}

// Rows of cells around the globe without those at the poles: the nodes of the next row are beside
// those of the one before by number, so that both readings are meshes.
TEST(UgridFiles, NumbersThatMayCountFromZeroOrOneFollowTheCentersOrElseTheConvention) {
  const Folder folder;
  constexpr std::size_t around = 12;
  for (const int start : {-1, 0, 1}) {  // of the numbers; -1: 0 without centers
    const std::string path = folder / "s.nc";
    {
      NetcdfMaker file(path);
      const int node = file.dimension("node", 8 * around);
      const int face = file.dimension("face", 5 * around);
      const int mesh = file.variable("Mesh2", NC_INT, {});
      file.text(mesh, "cf_role", "mesh_topology");
      file.number(mesh, "topology_dimension", NC_INT, {2});
      file.text(mesh, "node_coordinates", "nx ny");
      file.text(mesh, "face_node_connectivity", "corners");
      Table x, y, table, center_x, center_y;
      for (std::size_t n = 0; n < 8 * around; ++n) {
        x.push_back(30 * static_cast<double>(n % around));
        y.push_back(20 * static_cast<double>(n / around) - 70);
      }
      for (std::size_t low = around; low < 6 * around; ++low) {
        const std::size_t row = low / around * around;
        const std::size_t next = row + (low + 1) % around;
        for (const std::size_t n : {low, next, next + around, low + around}) {
          table.push_back(static_cast<double>(n + (start == 1 ? 1 : 0)));
        }
        center_x.push_back(x[low] + 15);
        center_y.push_back(y[low] + 10);
      }
      file.text(file.variable("nx", NC_DOUBLE, {node}, x), "units", "degrees_east");
      file.text(file.variable("ny", NC_DOUBLE, {node}, y), "units", "degrees_north");
      file.variable("corners", NC_INT, {face, file.dimension("four", 4)}, table);
      file.variable("t", NC_FLOAT, {face}, Table(5 * around, 1));
      if (start >= 0) {
        file.text(file.variable("fx", NC_DOUBLE, {face}, center_x), "units", "degrees_east");
        file.text(file.variable("fy", NC_DOUBLE, {face}, center_y), "units", "degrees_north");
      }
    }
    const auto source = opened(path);
    ASSERT_NE(source, nullptr);
    EXPECT_TRUE(has_note(source->info(), start < 0    ? "count from 0, the default of UGRID"
                                         : start == 0 ? "count from 0, which places the cells"
                                                      : "count from 1, which places the cells"))
        << start;
  }
}

// Centers that are missing tell nothing; the others are compared.
TEST(UgridFiles, MissingCentersDoNotHideThoseThatLieElsewhere) {
  const Folder folder;
  UgridMaker maker(folder / "m.nc");
  maker.plain_corners();
  const double missing = std::numeric_limits<double>::quiet_NaN();
  const auto known = [&](double value) { return value < 13 ? value + 2 : missing; };
  maker.file.text(maker.file.variable("fx", NC_DOUBLE, {maker.face},
                                      at_cells([&](double a, double) { return known(a); })),
                  "units", "degrees_east");
  maker.file.text(maker.file.variable("fy", NC_DOUBLE, {maker.face},
                                      at_cells([](double, double b) { return b; })),
                  "units", "degrees_north");
  maker.file.variable("t", NC_FLOAT, {maker.face}, at_cells(sum_of));
  maker.file.finish();
  EXPECT_THAT(refusal(folder / "m.nc"), HasSubstr("12 of 12 compared"));
}

// Triangles whose circumcentres lie outside of them.
TEST(UgridFiles, CircumcentersOfObtuseTrianglesAreCenters) {
  const Folder folder;
  // The circumcentres of these triangles, and those of their neighbours, which are no centres.
  for (const std::size_t aside : {0U, 1U}) {
    const std::string path = folder / "o.nc";
    {
      NetcdfMaker file(path);
      // Flat triangles along the equator, each with its own nodes and height.
      constexpr std::size_t count = 40;
      const int node = file.dimension("node", 3 * count);
      const int face = file.dimension("face", count);
      const int mesh = file.variable("Mesh2", NC_INT, {});
      file.text(mesh, "cf_role", "mesh_topology");
      file.number(mesh, "topology_dimension", NC_INT, {2});
      file.text(mesh, "node_coordinates", "nx ny");
      file.text(mesh, "face_node_connectivity", "corners");
      Table x, y, table, center_x, center_y;
      for (std::size_t c = 0; c < count; ++c) {
        const auto west = static_cast<double>(c);
        const double height = 0.1 + 0.002 * static_cast<double>(c);
        x.insert(x.end(), {west, west + 1, west + 0.5});
        y.insert(y.end(), {0, 0, height});
        for (std::size_t i = 0; i < 3; ++i) table.push_back(static_cast<double>(3 * c + i));
        center_x.push_back(west + 0.5 + static_cast<double>(aside));
        center_y.push_back((height * height - 0.25) / (2 * height));
      }
      file.text(file.variable("nx", NC_DOUBLE, {node}, x), "units", "degrees_east");
      file.text(file.variable("ny", NC_DOUBLE, {node}, y), "units", "degrees_north");
      file.text(file.variable("fx", NC_DOUBLE, {face}, center_x), "units", "degrees_east");
      file.text(file.variable("fy", NC_DOUBLE, {face}, center_y), "units", "degrees_north");
      file.variable("corners", NC_INT, {face, file.dimension("three", 3)}, table);
      file.variable("t", NC_FLOAT, {face}, Table(count, 1));
    }
    if (aside == 0) {
      EXPECT_NE(opened(path), nullptr);
    } else {
      EXPECT_THAT(refusal(path), HasSubstr("place them: 40 of 40 compared"));
    }
  }
}

TEST(UgridFiles, StepsInSeveralFilesShareTheMesh) {
  const Folder folder;
  for (const bool has_time : {false, true}) {
    const std::string stem = has_time ? "t" : "s";
    for (int number = 0; number < 2; ++number) {
      UgridMaker maker(folder / (stem + std::to_string(number) + ".nc"));
      maker.plain_corners();
      std::vector<int> dims{maker.file.axis("layer", {10, 20}, "m", "height"), maker.face};
      if (has_time) {
        dims.insert(dims.begin(),
                    maker.file.axis("time", {1.0 * number}, "hours since 2001-01-01", "time"));
      }
      maker.file.variable("t", NC_FLOAT, dims, Table(2 * cells, 5.0 + number));
    }
    const auto source = opened(folder / (stem + "*.nc"));
    ASSERT_NE(source, nullptr);
    ASSERT_EQ(source->info().steps.size(), 2U);
    EXPECT_EQ(volume_of(*source, "t", 0).values[0], 5.0F) << has_time;
    EXPECT_EQ(volume_of(*source, "t", 1).values[0], 6.0F) << has_time;
  }
}

}  // namespace
}  // namespace windsplat::data::test::mesh
