// Files of SCHISM: components of a velocity and heights by the names of the model.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/cf/mesh_maker.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

// Layers are the last dimension, from the floor up; the height of layer k is 10 k - 30 + x.
TEST(Schism, VelocitiesFormACurrentOnLevelsAtTheirMeanHeights) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "schout.nc");
    const int node = file.dimension("nSCHISM_hgrid_node", nodes);
    const int face = file.dimension("nSCHISM_hgrid_face", cells);
    const int corner = file.dimension("nMaxSCHISM_hgrid_face_nodes", 4);
    const int layer = file.dimension("nSCHISM_vgrid_layers", 4);
    const int grid = file.variable("SCHISM_hgrid", NC_INT, {}, {0});
    file.text(grid, "cf_role", "mesh_topology");
    file.number(grid, "topology_dimension", NC_INT, {2});
    file.text(grid, "node_coordinates", "SCHISM_hgrid_node_x SCHISM_hgrid_node_y");
    file.text(grid, "face_node_connectivity", "SCHISM_hgrid_face_nodes");
    const int table = file.variable("SCHISM_hgrid_face_nodes", NC_INT, {face, corner}, corners(1));
    file.number(table, "start_index", NC_INT, {1});
    const int x = file.variable("SCHISM_hgrid_node_x", NC_DOUBLE, {node},
                                at_nodes([](double a, double) { return a; }));
    file.text(x, "units", "degrees_east");
    file.text(x, "standard_name", "longitude");
    const int y = file.variable("SCHISM_hgrid_node_y", NC_DOUBLE, {node},
                                at_nodes([](double, double b) { return b; }));
    file.text(y, "units", "degrees_north");
    file.text(y, "standard_name", "latitude");
    const auto put = [&](const std::string& name, const auto& value) {
      std::vector<double> values;
      for (std::size_t n = 0; n < nodes; ++n) {
        for (int k = 0; k < 4; ++k) values.push_back(value(node_x(n), k));
      }
      const int v = file.variable(name, NC_FLOAT, {node, layer}, values);
      file.text(v, "mesh", "SCHISM_hgrid");
      file.text(v, "location", "node");
    };
    put("zCoordinates", [](double a, int k) { return 10 * k - 30 + a; });
    put("horizontalVelX", [](double a, int) { return a; });
    put("horizontalVelY", [](double, int k) { return k; });
    put("verticalVelocity", [](double a, int k) { return a + k; });
  }
  const auto source = opened(folder / "schout.nc");
  ASSERT_NE(source, nullptr);
  const FieldInfo* current = source->info().find("current");
  ASSERT_NE(current, nullptr);
  EXPECT_EQ(current->components,
            (std::vector<std::string>{"horizontalVelX", "horizontalVelY", "verticalVelocity"}));
  const Axis& axis = source->info().grid.axes[2];
  EXPECT_EQ(axis.kind, AxisKind::height);
  ASSERT_EQ(axis.coordinates.size(), 4U);
  EXPECT_NEAR(axis.coordinates[0], -30 + 13, 0.1);
  EXPECT_NEAR(axis.coordinates[3] - axis.coordinates[0], 30, 1e-4);
  expect_function(
      *source, "verticalVelocity", [](double a, double) { return a + 2; }, 0, 2);
}

}  // namespace
}  // namespace windsplat::data::test::mesh
