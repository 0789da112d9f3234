// Values on the edges of a mesh: means at the cells, and vectors from components normal to edges.
#include "server/data/cf/edges/edges.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/cf/mesh_maker.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

using testing::HasSubstr;
using Pair = std::pair<std::uint32_t, std::uint32_t>;
using Flow = std::function<std::array<double, 2>(double, double)>;

// A mesh and the nodes of its edges, in the order in which the cells have them.
struct Sides {
  cf::Mesh mesh;
  std::vector<Pair> nodes;
  std::vector<std::uint32_t> of_corners;
  std::vector<std::uint32_t> users;  // cells at each edge

  void find() {
    std::map<Pair, std::uint32_t> known;
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        const std::uint32_t a = mesh.corners[i];
        const std::uint32_t b = mesh.corners[i + 1 < mesh.first[c + 1] ? i + 1 : mesh.first[c]];
        const auto [found, is_new] =
            known.emplace(std::minmax(a, b), static_cast<std::uint32_t>(nodes.size()));
        if (is_new) {
          nodes.emplace_back(a, b);
          users.push_back(0);
        }
        of_corners.push_back(found->second);
        ++users[found->second];
      }
    }
  }
  [[nodiscard]] double middle(std::size_t edge, const Table& of) const {
    return (of[nodes[edge].first] + of[nodes[edge].second]) / 2;
  }
  // The unit normal, to the right of the way from the first node to the second.
  [[nodiscard]] std::array<double, 2> normal(std::size_t edge) const {
    const auto [a, b] = nodes[edge];
    const double x = mesh.x[b] - mesh.x[a];
    const double y = mesh.y[b] - mesh.y[a];
    const double length = std::hypot(x, y);
    return {y / length, -x / length};
  }
  [[nodiscard]] cf::MeshEdges edges() const {
    cf::MeshEdges out;
    out.count = nodes.size();
    out.of_sides = of_corners;
    for (std::size_t e = 0; e < nodes.size(); ++e) {
      out.middles.push_back({middle(e, mesh.x), middle(e, mesh.y), 0});
      const auto [x, y] = normal(e);
      out.normals.push_back({x, y, 0});
    }
    return out;
  }
  [[nodiscard]] std::vector<float> normals_of(const Flow& flow) const {
    std::vector<float> out;
    for (std::size_t e = 0; e < nodes.size(); ++e) {
      const auto [u, v] = flow(middle(e, mesh.x), middle(e, mesh.y));
      const auto [x, y] = normal(e);
      out.push_back(static_cast<float>(u * x + v * y));
    }
    return out;
  }
  [[nodiscard]] std::array<double, 2> centroid(std::size_t cell) const {
    cf::ChartCell chart;
    cf::chart_of(mesh, cell, false, chart);
    return chart.centroid();
  }
  [[nodiscard]] bool is_inner(std::size_t cell) const {
    bool all = true;
    for (std::uint32_t i = mesh.first[cell]; i < mesh.first[cell + 1]; ++i) {
      all = all && users[of_corners[i]] == 2;
    }
    return all;
  }
};

enum class Shape { quads, triangles };

// n x n squares of the unit square, or their halves, whose nodes are moved by up to `shaken` sizes.
Sides meshed(std::size_t n, Shape shape, double shaken) {
  Sides out;
  std::mt19937 random(11);
  const auto part = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  const double size = 1 / static_cast<double>(n);
  for (std::size_t k = 0; k < (n + 1) * (n + 1); ++k) {
    out.mesh.x.push_back(size * (static_cast<double>(k % (n + 1)) + 2 * shaken * part()));
    out.mesh.y.push_back(size * (static_cast<double>(k / (n + 1)) + 2 * shaken * part()));
  }
  out.mesh.first.push_back(0);
  const auto add = [&](const std::vector<std::size_t>& corners) {
    for (const std::size_t corner : corners) {
      out.mesh.corners.push_back(static_cast<std::uint32_t>(corner));
    }
    out.mesh.first.push_back(static_cast<std::uint32_t>(out.mesh.corners.size()));
  };
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t low = j * (n + 1) + i;
      const std::size_t high = low + n + 1;
      if (shape == Shape::quads) {
        add({low, low + 1, high + 1, high});
      } else {
        add({low, low + 1, high + 1});
        add({low, high + 1, high});
      }
    }
  }
  out.find();
  return out;
}

struct Errors {
  double largest = 0;
  double rms = 0;
};

// Of the components of the vectors at the cells, or at those with neighbours on all sides.
Errors errors_of(const Sides& sides, const Flow& flow, bool inner_only) {
  const std::vector<float> given = sides.normals_of(flow);
  const cf::EdgeWeights weights(sides.mesh, sides.edges());
  std::array<std::vector<float>, 2> drawn;
  for (auto& one : drawn) one.resize(sides.mesh.cells());
  weights.gather(cf::EdgePart::east, given.data(), drawn[0].data());
  weights.gather(cf::EdgePart::north, given.data(), drawn[1].data());
  Errors out;
  double squares = 0;
  std::size_t compared = 0;
  for (std::size_t c = 0; c < sides.mesh.cells(); ++c) {
    if (inner_only && !sides.is_inner(c)) continue;
    const auto [x, y] = sides.centroid(c);
    const auto [u, v] = flow(x, y);
    const double to_east = static_cast<double>(drawn[0][c]) - u;
    const double to_north = static_cast<double>(drawn[1][c]) - v;
    out.largest = std::max({out.largest, std::abs(to_east), std::abs(to_north)});
    squares += to_east * to_east + to_north * to_north;
    ++compared;
  }
  out.rms = std::sqrt(squares / static_cast<double>(compared));
  return out;
}

// The order of convergence from 16 to 64 cells along each side.
double order_of(Shape shape, double shaken, const Flow& flow) {
  const double coarse = errors_of(meshed(16, shape, shaken), flow, true).rms;
  const double fine = errors_of(meshed(64, shape, shaken), flow, true).rms;
  EXPECT_LT(coarse, 0.05);
  return std::log(coarse / fine) / std::log(4.0);
}

const Flow constant = [](double, double) { return std::array{3.0, -7.0}; };
const Flow linear = [](double x, double y) {
  return std::array{1 + 2 * x - 3 * y, 5 - x + 0.5 * y};
};
const Flow curved = [](double x, double y) {
  return std::array{std::sin(3 * x) * std::cos(2 * y), std::cos(3 * x + y)};
};

TEST(EdgeWeights, ConstantVectorsAreExact) {
  for (const Shape shape : {Shape::quads, Shape::triangles}) {
    EXPECT_LT(errors_of(meshed(12, shape, 0.3), constant, false).largest, 2e-5);
  }
}

TEST(EdgeWeights, LinearVectorsAreExactInTrianglesAndSquaresAndOfFirstOrderInSkewedCells) {
  EXPECT_LT(errors_of(meshed(12, Shape::triangles, 0.3), linear, true).largest, 2e-5);
  EXPECT_LT(errors_of(meshed(12, Shape::quads, 0), linear, false).largest, 2e-5);
  EXPECT_NEAR(order_of(Shape::quads, 0.2, linear), 1, 0.2);
}

TEST(EdgeWeights, CurvedVectorsAreOfSecondOrderInTrianglesAndSquares) {
  EXPECT_NEAR(order_of(Shape::quads, 0, curved), 2, 0.2);
  EXPECT_NEAR(order_of(Shape::triangles, 0.2, curved), 2, 0.2);
}

TEST(EdgeWeights, MeansOfLinearScalarsAreExactAtCentroids) {
  for (const Shape shape : {Shape::quads, Shape::triangles}) {
    const Sides sides = meshed(10, shape, 0.3);
    cf::MeshEdges edges = sides.edges();
    edges.normals.clear();
    std::vector<float> given;
    for (std::size_t e = 0; e < edges.count; ++e) {
      given.push_back(static_cast<float>(2 * edges.middles[e][0] - 3 * edges.middles[e][1]));
    }
    std::vector<float> drawn(sides.mesh.cells());
    cf::EdgeWeights(sides.mesh, edges).gather(cf::EdgePart::mean, given.data(), drawn.data());
    for (std::size_t c = 0; c < drawn.size(); ++c) {
      const auto [x, y] = sides.centroid(c);
      ASSERT_NEAR(drawn[c], 2 * x - 3 * y, 1e-5);
    }
  }
}

TEST(EdgeWeights, MissingComponentsAreWallsAndCellsWithoutAnyAreMasked) {
  const Sides sides = meshed(3, Shape::quads, 0);
  const cf::EdgeWeights weights(sides.mesh, sides.edges());
  std::vector<float> given = sides.normals_of(constant);
  std::vector<float> scalars(given.size(), 6);
  const auto missing = [&](std::size_t cell, std::size_t side) {
    const std::uint32_t edge = sides.of_corners[4 * cell + side];
    given[edge] = std::numeric_limits<float>::quiet_NaN();
    scalars[edge] = given[edge];
  };
  missing(0, 3);  // the left side of the first cell
  for (std::size_t side = 0; side < 4; ++side) missing(8, side);
  std::vector<float> east(9);
  std::vector<float> mean(9);
  weights.gather(cf::EdgePart::east, given.data(), east.data());
  weights.gather(cf::EdgePart::mean, scalars.data(), mean.data());
  EXPECT_NEAR(east[0], 1.5, 1e-5);
  EXPECT_NEAR(east[4], 3, 1e-5);
  EXPECT_NEAR(mean[0], 6, 1e-5);
  EXPECT_TRUE(std::isnan(east[8]));
  EXPECT_TRUE(std::isnan(mean[8]));
}

// ----------------------------------------------------------------------------
// The quadrilaterals of mesh_maker.hpp, or their halves, in files.

Sides small_mesh(Shape shape) {
  Sides out;
  out.mesh.x = at_nodes([](double x, double) { return x; });
  out.mesh.y = at_nodes([](double, double y) { return y; });
  out.mesh.first.push_back(0);
  const Table four = corners(0);
  for (std::size_t c = 0; c < cells; ++c) {
    const auto corner = [&](std::size_t i) { return static_cast<std::uint32_t>(four[4 * c + i]); };
    if (shape == Shape::quads) {
      for (const std::size_t i : {0U, 1U, 2U, 3U}) out.mesh.corners.push_back(corner(i));
      out.mesh.first.push_back(static_cast<std::uint32_t>(out.mesh.corners.size()));
      continue;
    }
    for (const auto& half : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}}) {
      for (const std::size_t i : half) out.mesh.corners.push_back(corner(i));
      out.mesh.first.push_back(static_cast<std::uint32_t>(out.mesh.corners.size()));
    }
  }
  out.find();
  return out;
}

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
};

void write_mpas(const std::string& path, const MpasParts& parts) {
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
  file.variable("verticesOnEdge", NC_INT, {edge, file.dimension("TWO", 2)}, ends);
  if (parts.angles) file.variable("angleEdge", NC_DOUBLE, {edge}, angles);
  file.text(file.variable("u", NC_FLOAT, {time, edge, level}, u), "units", "m s^{-1}");
  const Table flat(2 * cells, 1);
  file.text(file.variable("theta", NC_FLOAT, {time, cell, level}, flat), "units", "K");
  file.text(file.variable("w", NC_FLOAT, {time, cell, level}, flat), "units", "m s^{-1}");
  if (!parts.vectors_at_cells) return;
  for (const char* name : {"uReconstructZonal", "uReconstructMeridional"}) {
    file.text(file.variable(name, NC_FLOAT, {time, cell, level}, flat), "units", "m s^{-1}");
  }
}

TEST(MeshEdges, NormalWindsOfMpasBecomeVectorsAtTheCells) {
  const Folder folder;
  write_mpas(folder / "m.nc", {});
  const auto source = opened(folder / "m.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(has_note(source->info(), "normal to the edges of the mesh: 'u'"));
  const Volume wind = volume_of(*source, "wind");
  ASSERT_EQ(wind.components, 3);
  std::size_t compared = 0;
  for (std::size_t n = 0; n < wind.samples(); ++n) {
    if (std::isnan(wind.component(0)[n])) continue;
    const double level = n < wind.samples() / 2 ? 1 : 2;
    // The sides of a cell are not quite parallel: meridians converge.
    ASSERT_NEAR(wind.component(0)[n], u_east * level, 0.02 * level);
    ASSERT_NEAR(wind.component(1)[n], v_north * level, 0.02 * level);
    ASSERT_NEAR(wind.component(2)[n], 1, 1e-5);
    ++compared;
  }
  EXPECT_GT(compared, 500U);
}

TEST(MeshEdges, VectorsAtTheCellsArePreferredAndUnknownDirectionsAreLeftOut) {
  const Folder folder;
  write_mpas(folder / "c.nc", {true, true});
  const auto both = opened(folder / "c.nc");
  ASSERT_NE(both, nullptr);
  EXPECT_THAT(reason_of(both->info(), "u"), HasSubstr("'uReconstructZonal'"));
  EXPECT_NEAR(volume_of(*both, "wind").range[1], std::sqrt(3.0), 1e-4);

  write_mpas(folder / "d.nc", {false, false});
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

TEST(MeshEdges, ScalarsAreAveragedAndWhatMayHaveADirectionIsLeftOut) {
  const Sides sides = small_mesh(Shape::quads);
  const std::size_t count = sides.nodes.size();
  Table ends;
  Table values;
  for (std::size_t e = 0; e < count; ++e) {
    ends.insert(ends.end(), {sides.nodes[e].first + 0.0, sides.nodes[e].second + 0.0});
    values.push_back(sum_of(sides.middle(e, sides.mesh.x), sides.middle(e, sides.mesh.y)));
  }
  const auto write = [&](const std::string& path, const Table& table) {
    NetcdfMaker file(path);
    const int node = file.dimension("node", nodes);
    const int face = file.dimension("face", cells);
    const int edge = file.dimension("edge", count);
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
    file.variable("ends", NC_INT, {edge, file.dimension("two", 2)}, table);
    const auto add = [&](const char* name, nc_type type, const char* units, const char* described) {
      const int v = file.variable(name, type, {edge}, values);
      file.text(v, "mesh", "mesh2d");
      file.text(v, "location", "edge");
      if (*units != '\0') file.text(v, "units", units);
      file.text(v, "long_name", described);
    };
    add("depth_on_edges", NC_FLOAT, "m", "water depth");
    add("mesh2d_u1", NC_FLOAT, "m s-1", "Velocity at velocity point, n-component");
    add("mesh2d_q1", NC_FLOAT, "m3 s-1", "Discharge through flow link");
    add("slope", NC_FLOAT, "1", "gradient of the water level");
    add("bearing", NC_FLOAT, "degree", "of the edge");
    add("kind", NC_INT, "1", "kind of the edge");
    add("bare", NC_FLOAT, "", "something");
    file.text(file.variable("level", NC_FLOAT, {face}, at_cells(sum_of)), "units", "m");
  };
  const Folder folder;
  write(folder / "u.nc", ends);
  const auto source = opened(folder / "u.nc");
  ASSERT_NE(source, nullptr);
  expect_function(*source, "depth_on_edges", sum_of, 1);
  EXPECT_TRUE(has_note(source->info(), "averaged to its cells: 'depth_on_edges'"));
  for (const char* name : {"mesh2d_u1", "mesh2d_q1", "slope", "bearing", "kind", "bare"}) {
    EXPECT_EQ(source->info().find(name), nullptr) << name;
    EXPECT_THAT(reason_of(source->info(), name), HasSubstr("on the edges of the mesh: ")) << name;
  }

  Table wrong = ends;
  wrong[5] = nodes + 3;
  write(folder / "w.nc", wrong);
  const auto damaged = opened(folder / "w.nc");
  ASSERT_NE(damaged, nullptr);
  const auto& fields = damaged->info().fields;
  const auto at = static_cast<std::size_t>(damaged->info().find("depth_on_edges") - fields.data());
  const auto read = damaged->read(at, 0);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("'ends': entry 3 has a number beyond 0 to 34"));
}

}  // namespace
}  // namespace windsplat::data::test::mesh
