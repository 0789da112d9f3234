// Files with values on the edges of a mesh: MPAS, ICON, UGRID.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/unit/data/cf/edges/edges_maker.hpp"
#include "tests/unit/data/cf/mesh_maker.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

using testing::HasSubstr;

// Directions along which positive components of edges point, in radians from the east.
double angle_of(const Sides& sides, std::size_t edge) {
  const auto [a, b] = sides.nodes[edge];
  const double shrink = std::cos(sides.middle(edge, sides.mesh.y) * degree);
  return std::atan2(-(sides.mesh.x[b] - sides.mesh.x[a]) * shrink,
                    sides.mesh.y[b] - sides.mesh.y[a]);
}

constexpr double u_east = 10;
constexpr double v_north = -4;

double component(const Sides& sides, std::size_t edge) {
  const double angle = angle_of(sides, edge);
  return u_east * std::cos(angle) + v_north * std::sin(angle);
}

struct MpasParts {
  bool angles = true;
  bool vectors_at_cells = false;
  bool lone_component = false;  // one component at the cells
  bool near_surface = false;    // a vector at the cells on one level
  bool scalar_on_edges = false;
  std::string wind = "u";     // the component along the normals
  bool missing_side = false;  // it is missing at one edge that faces east or west
  double end = 1;             // factor of an entry of verticesOnEdge
  double per_radian = 1;      // the numbers of the angles
  const char* angle_units = "";
};

void write_mpas_edges(const std::string& path, const MpasParts& parts) {
  const Sides sides = small_mesh(Shape::quads);
  const std::size_t count = sides.nodes.size();
  NetcdfMaker file(path);
  const int cell = file.dimension("nCells", cells);
  const int vertex = file.dimension("nVertices", nodes);
  const int edge = file.dimension("nEdges", count);
  const int most = file.dimension("maxEdges", 6);
  const int level = file.dimension("nVertLevels", 2);
  const int time = file.dimension("Time", 1);
  file.variable("nEdgesOnCell", NC_INT, {cell}, Table(cells, 4));
  file.variable("verticesOnCell", NC_INT, {cell, most}, with_padding(corners(1), 12345));
  const auto in_radians = [&](bool is_x) {
    return at_nodes([=](double x, double y) { return (is_x ? x : y) * degree; });
  };
  file.variable("lonVertex", NC_DOUBLE, {vertex}, in_radians(true));
  file.variable("latVertex", NC_DOUBLE, {vertex}, in_radians(false));
  Table ends;
  Table angles;
  Table u;
  for (std::size_t e = 0; e < count; ++e) {
    ends.insert(ends.end(), {sides.nodes[e].first + 1.0, sides.nodes[e].second + 1.0});
    angles.push_back(angle_of(sides, e));
    u.insert(u.end(), {component(sides, e), 2 * component(sides, e)});
  }
  ends[8] *= parts.end;
  constexpr double absent = -999;
  for (std::size_t e = count / 2; parts.missing_side && e < count; ++e) {
    if (std::abs(std::cos(angles[e])) < 0.99) continue;
    u[2 * e] = u[2 * e + 1] = absent;
    break;
  }
  for (double& angle : angles) angle *= parts.per_radian;
  file.variable("verticesOnEdge", NC_INT, {edge, file.dimension("TWO", 2)}, ends);
  if (parts.angles) {
    const int v = file.variable("angleEdge", NC_DOUBLE, {edge}, angles);
    file.text(v, "units", parts.angle_units);
  }
  file.variable("lonEdge", NC_DOUBLE, {edge}, Table(count, 0.5));
  file.variable("latEdge", NC_DOUBLE, {edge}, Table(count, 0.5));
  const int normal = file.variable(parts.wind, NC_FLOAT, {time, edge, level}, u);
  file.text(normal, "units", "m s^{-1}");
  file.number(normal, "missing_value", NC_FLOAT, {absent});
  if (parts.scalar_on_edges) {
    const int v = file.variable("theta_edge", NC_FLOAT, {time, edge, level}, Table(2 * count, 7));
    file.text(v, "units", "K");
  }
  const Table flat(2 * cells, 1);
  file.text(file.variable("theta", NC_FLOAT, {time, cell, level}, flat), "units", "K");
  file.text(file.variable("w", NC_FLOAT, {time, cell, level}, flat), "units", "m s^{-1}");
  for (const bool is_east : {true, false}) {
    if (!parts.near_surface) break;
    const int v = file.variable(is_east ? "u10" : "v10", NC_FLOAT, {time, cell}, Table(cells, 1));
    file.text(v, "units", "m s-1");
    file.text(v, "standard_name", is_east ? "eastward_wind" : "northward_wind");
  }
  for (const char* name : {"uReconstructZonal", "uReconstructMeridional"}) {
    if (!parts.vectors_at_cells && (!parts.lone_component || name[12] != 'Z')) continue;
    file.text(file.variable(name, NC_FLOAT, {time, cell, level}, flat), "units", "m s^{-1}");
  }
}

// Expects the flow of component() at the cells.
void expect_flow(const Volume& wind, double tolerance) {
  std::size_t compared = 0;
  for (std::size_t n = 0; n < wind.samples(); ++n) {
    if (std::isnan(wind.component(0)[n])) continue;
    const double level = n < wind.samples() / 2 ? 1 : 2;
    ASSERT_NEAR(wind.component(0)[n], u_east * level, tolerance * level);
    ASSERT_NEAR(wind.component(1)[n], v_north * level, tolerance * level);
    ++compared;
  }
  EXPECT_GT(compared, 500U);
}

TEST(MeshEdges, NormalWindsOfMpasBecomeVectorsAtTheCells) {
  const Folder folder;
  write_mpas_edges(folder / "m.nc", {});
  const auto source = opened(folder / "m.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(has_note(source->info(), "normal to the edges of the mesh: 'u'"));
  EXPECT_FALSE(has_note(source->info(), "missing components count as 0"));
  const Volume wind = volume_of(*source, "wind");
  ASSERT_EQ(wind.components, 3);
  // The sides of a cell are not quite parallel: meridians converge.
  expect_flow(wind, 0.02);
  EXPECT_NEAR(wind.range[1], std::sqrt(4 * (100 + 16) + 1.0), 0.05);
  for (const auto& left : source->info().left_out) {
    EXPECT_TRUE(left.name != "lonEdge" && left.name != "latEdge") << left.reason;
  }
}

TEST(MeshEdges, ComponentsOrLevelsAloneAtTheCellsReplaceNoWind) {
  const Folder folder;
  write_mpas_edges(folder / "l.nc", {.lone_component = true});
  write_mpas_edges(folder / "s.nc", {.near_surface = true});
  for (const char* name : {"l.nc", "s.nc"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(reason_of(source->info(), "u"), "") << name;
    EXPECT_TRUE(has_note(source->info(), "normal to the edges of the mesh: 'u'")) << name;
    ASSERT_NE(source->info().find("wind"), nullptr) << name;
    expect_flow(volume_of(*source, "wind"), 0.02);
  }
}

TEST(MeshEdges, NegativeNumbersAreAbsentEdges) {
  const Folder folder;
  write_mpas_edges(folder / "n.nc", {.end = -1});
  const auto source = opened(folder / "n.nc");
  ASSERT_NE(source, nullptr);
  ASSERT_NE(source->info().find("wind"), nullptr);
  expect_flow(volume_of(*source, "wind"), 0.05);
}

TEST(MeshEdges, AnglesInDegreesAreConvertedAndThoseBeyondACircleAreRefused) {
  const Folder folder;
  write_mpas_edges(folder / "d.nc", {.per_radian = 1 / degree, .angle_units = "degrees"});
  const auto source = opened(folder / "d.nc");
  ASSERT_NE(source, nullptr);
  expect_flow(volume_of(*source, "wind"), 0.02);

  write_mpas_edges(folder / "r.nc", {.per_radian = 1 / degree});
  const auto unclear = opened(folder / "r.nc");
  ASSERT_NE(unclear, nullptr);
  EXPECT_EQ(unclear->info().find("wind"), nullptr);
  EXPECT_THAT(reason_of(unclear->info(), "u"),
              HasSubstr("'angleEdge': edge 1 has the angle -90, more than a circle of 2 pi"));
  EXPECT_NE(unclear->info().find("theta"), nullptr);
}

// A scalar has no direction: the angles of edges do not matter for it, wherever it lies in the
// file.
TEST(MeshEdges, AnglesBeyondACircleLeaveScalarsOnEdges) {
  const Folder folder;
  write_mpas_edges(folder / "r.nc", {.scalar_on_edges = true, .per_radian = 1 / degree});
  const auto source = opened(folder / "r.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(reason_of(source->info(), "u"), HasSubstr("more than a circle of 2 pi"));
  ASSERT_NE(source->info().find("theta_edge"), nullptr);
  const Volume volume = volume_of(*source, "theta_edge");
  std::size_t compared = 0;
  for (const float value : volume.values) {
    if (std::isnan(value)) continue;
    ASSERT_NEAR(value, 7, 1e-5);
    ++compared;
  }
  EXPECT_GT(compared, 500U);
}

// No water flows through an edge without a value: of the two sides of a cell that face east and
// west one has 10 m/s, the other 0, so that the cell has 5 m/s. Air without a value there is
// unknown.
TEST(MeshEdges, MissingNormalsOfMpasOceanAreWalls) {
  const Folder folder;
  for (const bool in_water : {true, false}) {
    write_mpas_edges(folder / "walls.nc",
                     {.wind = in_water ? "normalVelocity" : "u", .missing_side = true});
    const auto source = opened(folder / "walls.nc");
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(has_note(source->info(),
                       "missing components count as 0, the flow through a coast or the bottom: "
                       "'normalVelocity'"),
              in_water);
    const Volume flow = volume_of(*source, in_water ? "current" : "wind");
    double least = 100;
    for (std::size_t n = 0; n < flow.samples() / 2; ++n) {
      const double east = flow.component(0)[n];
      if (!std::isnan(east)) least = std::min(least, east);
    }
    EXPECT_NEAR(least, in_water ? u_east / 2 : u_east, in_water ? 0.5 : 0.05);
  }
}

TEST(MeshEdges, VectorsAtTheCellsArePreferredAndUnknownDirectionsAreLeftOut) {
  const Folder folder;
  write_mpas_edges(folder / "c.nc", {.vectors_at_cells = true});
  const auto both = opened(folder / "c.nc");
  ASSERT_NE(both, nullptr);
  EXPECT_THAT(reason_of(both->info(), "u"), HasSubstr("'uReconstructZonal'"));
  EXPECT_NEAR(volume_of(*both, "wind").range[1], std::sqrt(3.0), 1e-4);

  write_mpas_edges(folder / "d.nc", {.angles = false});
  const auto unknown = opened(folder / "d.nc");
  ASSERT_NE(unknown, nullptr);
  EXPECT_EQ(unknown->info().find("wind"), nullptr);
  EXPECT_THAT(reason_of(unknown->info(), "u"), HasSubstr("whose directions are not in the file"));
}

TEST(MeshEdges, NormalWindsOfIconTakeDirectionsFromTheGridFile) {
  const Sides sides = small_mesh(Shape::triangles);
  const std::size_t count = sides.nodes.size();
  const Folder folder;
  {
    NetcdfMaker file(folder / "grid.nc");
    const int cell = file.dimension("cell", sides.mesh.cells());
    const int edge = file.dimension("edge", count);
    const int three = file.dimension("nv", 3);
    for (const bool is_x : {true, false}) {
      const Table& of = is_x ? sides.mesh.x : sides.mesh.y;
      Table centers;
      Table outlines;
      Table middles;
      Table normals;
      for (std::size_t c = 0; c < sides.mesh.cells(); ++c) {
        centers.push_back(sides.centroid(c)[is_x ? 0 : 1] * degree);
        for (std::uint32_t i = 0; i < 3; ++i) {
          outlines.push_back(of[sides.mesh.corners[3 * c + i]] * degree);
        }
      }
      for (std::size_t e = 0; e < count; ++e) {
        middles.push_back(sides.middle(e, of) * degree);
        const double angle = angle_of(sides, e);
        normals.push_back(is_x ? std::cos(angle) : std::sin(angle));
      }
      const std::string name = is_x ? "clon" : "clat";
      const int v = file.variable(name, NC_DOUBLE, {cell}, centers);
      file.text(v, "units", "radian");
      file.text(v, "bounds", name + "_vertices");
      file.variable(name + "_vertices", NC_DOUBLE, {cell, three}, outlines);
      const int m = file.variable(is_x ? "elon" : "elat", NC_DOUBLE, {edge}, middles);
      file.text(m, "units", "radian");
      file.variable(is_x ? "zonal_normal_primal_edge" : "meridional_normal_primal_edge", NC_DOUBLE,
                    {edge}, normals);
    }
    Table of_cells;
    for (std::uint32_t i = 0; i < 3; ++i) {
      for (std::size_t c = 0; c < sides.mesh.cells(); ++c) {
        of_cells.push_back(sides.of_corners[3 * c + (i + 1) % 3] + 1.0);
      }
    }
    file.variable("edge_of_cell", NC_INT, {three, cell}, of_cells);
  }
  {
    NetcdfMaker file(folder / "data.nc");
    const int cell = file.dimension("ncells", sides.mesh.cells());
    const int edge = file.dimension("ncells_2", count);
    Table values;
    Table middles;
    for (std::size_t e = 0; e < count; ++e) {
      values.push_back(component(sides, e));
      middles.push_back(sides.middle(e, sides.mesh.x) * degree);
    }
    for (const char* name : {"elon", "elat"}) {
      file.text(file.variable(name, NC_DOUBLE, {edge}, middles), "units", "radian");
    }
    file.text(file.variable("vn", NC_FLOAT, {edge}, values), "units", "m s-1");
    file.variable("t", NC_FLOAT, {cell}, Table(sides.mesh.cells(), 280));
  }
  const auto source = opened(folder / "{grid,data}.nc");
  ASSERT_NE(source, nullptr);
  const Volume wind = volume_of(*source, "wind");
  ASSERT_EQ(wind.components, 2);
  std::size_t compared = 0;
  for (std::size_t n = 0; n < wind.samples(); ++n) {
    if (std::isnan(wind.component(0)[n])) continue;
    ASSERT_NEAR(wind.component(0)[n], u_east, 0.2);
    ASSERT_NEAR(wind.component(1)[n], v_north, 0.2);
    ++compared;
  }
  EXPECT_GT(compared, 500U);
}

class UgridEdges : public testing::Test {
 protected:
  UgridEdges() {
    for (std::size_t e = 0; e < sides_.nodes.size(); ++e) {
      ends_.insert(ends_.end(), {sides_.nodes[e].first + 0.0, sides_.nodes[e].second + 0.0});
    }
  }
  // unwritten: a number of edges in place of the table and values, which are then not written.
  void write(const std::string& path, const Table& table, std::size_t unwritten = 0) const {
    Table values;
    for (std::size_t e = 0; e < sides_.nodes.size() && unwritten == 0; ++e) {
      const double x = sides_.middle(e, sides_.mesh.x);
      values.push_back(sum_of(x, sides_.middle(e, sides_.mesh.y)));
    }
    NetcdfMaker file(path);
    const int node = file.dimension("node", nodes);
    const int face = file.dimension("face", cells);
    const int edge = file.dimension("edge", unwritten > 0 ? unwritten : sides_.nodes.size());
    const int topology = file.variable("mesh2d", NC_INT, {});
    file.text(topology, "cf_role", "mesh_topology");
    file.number(topology, "topology_dimension", NC_INT, {2});
    file.text(topology, "node_coordinates", "nx ny");
    file.text(topology, "face_node_connectivity", "corners");
    file.text(topology, "edge_node_connectivity", "ends");
    const auto x = at_nodes([](double a, double) { return a; });
    const auto y = at_nodes([](double, double b) { return b; });
    file.text(file.variable("nx", NC_DOUBLE, {node}, x), "units", "km");
    file.text(file.variable("ny", NC_DOUBLE, {node}, y), "units", "km");
    file.variable("corners", NC_INT, {face, file.dimension("four", 4)}, corners(0));
    const int ends = file.variable("ends", NC_INT, {edge, file.dimension("two", 2)}, table);
    if (unwritten > 0) file.chunk(ends, {1024, 2});
    const auto add = [&](const char* name, nc_type type, const char* units, const char* described) {
      const int v = file.variable(name, type, {edge}, values);
      if (unwritten > 0) file.chunk(v, {1024});
      file.text(v, "mesh", "mesh2d");
      file.text(v, "location", "edge");
      if (*units != '\0') file.text(v, "units", units);
      file.text(v, "long_name", described);
    };
    add("depth_on_edges", NC_FLOAT, "m", "water depth");
    add("mesh2d_u1", NC_FLOAT, "m s-1", "Velocity at velocity point, n-component");
    add("mesh2d_q1", NC_FLOAT, "m3 s-1", "Discharge through flow link");
    add("inflow", NC_FLOAT, "m3 s-1", "water that enters");
    add("slope", NC_FLOAT, "1", "gradient of the water level");
    add("bearing", NC_FLOAT, "degree", "of the edge");
    add("kind", NC_INT, "1", "kind of the edge");
    add("bare", NC_FLOAT, "", "something");
    add("salt", NC_FLOAT, "1e-3", "salinity");
    add("warmth", NC_FLOAT, "degC", "of the water");
    add("rho", NC_FLOAT, "kg m^{-3}", "of the water");
    add("moved", NC_FLOAT, "m", "displacement in height");
    add("along", NC_FLOAT, "m", "way");
    add("rise", NC_FLOAT, "1", "");
    add("zxu", NC_FLOAT, "-", "d(zeta)/dx");
    add("kt", NC_FLOAT, "kt", "u");
    add("kmh", NC_FLOAT, "km/h", "u");
    add("volume", NC_FLOAT, "Sv", "volume moved");
    add("hourly", NC_FLOAT, "m3/hr", "");
    add("tau", NC_FLOAT, "N m-2", "");
    add("push", NC_FLOAT, "m s**-2", "u in time");
    file.text(file.variable("level", NC_FLOAT, {face}, at_cells(sum_of)), "units", "m");
  }

  // Why the values on edges of that file are left out.
  static std::string fault_of(const std::string& path) {
    const auto source = opened(path);
    if (source == nullptr) return {};
    EXPECT_EQ(source->info().find("depth_on_edges"), nullptr);
    return reason_of(source->info(), "depth_on_edges");
  }

  Folder folder_;
  const Sides sides_ = small_mesh(Shape::quads);
  Table ends_;
};

TEST_F(UgridEdges, ScalarsAreAveragedAndWhatMayHaveADirectionIsLeftOut) {
  write(folder_ / "u.nc", ends_);
  const auto source = opened(folder_ / "u.nc");
  ASSERT_NE(source, nullptr);
  expect_function(*source, "depth_on_edges", sum_of, 1);
  EXPECT_TRUE(
      has_note(source->info(), "averaged to its cells: 'depth_on_edges', 'salt', 'warmth', 'rho'"));
  for (const char* name :
       {"mesh2d_u1", "mesh2d_q1", "inflow", "slope", "bearing", "kind", "bare", "moved", "along",
        "rise", "zxu", "kt", "kmh", "volume", "hourly", "tau", "push"}) {
    EXPECT_EQ(source->info().find(name), nullptr) << name;
    EXPECT_THAT(reason_of(source->info(), name), HasSubstr("on the edges of the mesh: ")) << name;
  }
}

TEST_F(UgridEdges, DamagedTablesLeaveOutTheirFieldsAlone) {
  Table wrong = ends_;
  wrong[5] = nodes + 3;
  write(folder_ / "w.nc", wrong);
  EXPECT_THAT(fault_of(folder_ / "w.nc"),
              HasSubstr("'ends': entry 3 has the number " + std::to_string(nodes + 3) +
                        ", beyond 0 to " + std::to_string(nodes - 1)));
  EXPECT_FALSE(volume_of(*opened(folder_ / "w.nc"), "level").values.empty());

  wrong[5] = -999;
  write(folder_ / "n.nc", wrong);
  EXPECT_FALSE(volume_of(*opened(folder_ / "n.nc"), "depth_on_edges").values.empty());

  Table apart = ends_;
  for (std::size_t n = 0; n < apart.size(); n += 2) apart[n + 1] = std::fmod(apart[n] + 2, nodes);
  write(folder_ / "a.nc", apart);
  EXPECT_THAT(fault_of(folder_ / "a.nc"), HasSubstr("'ends' has no edge along most sides"));

  write(folder_ / "m.nc", {}, 3'000'000);
  EXPECT_THAT(fault_of(folder_ / "m.nc"), HasSubstr("the mesh has 3000000 edges: at most 10"));
}

}  // namespace
}  // namespace windsplat::data::test::mesh
