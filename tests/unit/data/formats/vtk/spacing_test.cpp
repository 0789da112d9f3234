// The spacing of samples follows the layers and the cells of a mesh.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/unit/data/formats/vtk/test_mesh.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;

// The grid of an atmospheric model: levels that follow a hill from the ground to the top.
struct Terrain {
  static constexpr double step = 20e3;
  static constexpr double lid = 15e3;
  int levels;
  int columns = 24;
  int rows = 20;
  [[nodiscard]] Place at(int i, int j, int k) const {
    const double ground = 1000 * std::exp(-(std::pow(i - 12, 2) + std::pow(j - 10, 2)) / 20.0);
    return {i * step, j * step, ground + (lid - ground) * k / (levels - 1)};
  }
};

std::string terrain_vts(const Terrain& terrain, VtkXml& xml) {
  std::vector<double> points;
  std::vector<double> height;
  for (int k = 0; k < terrain.levels; ++k) {
    for (int j = 0; j < terrain.rows; ++j) {
      for (int i = 0; i < terrain.columns; ++i) {
        const Place p = terrain.at(i, j, k);
        points.insert(points.end(), p.begin(), p.end());
        height.push_back(p[2]);
      }
    }
  }
  const std::string extent = "0 " + std::to_string(terrain.columns - 1) + " 0 " +
                             std::to_string(terrain.rows - 1) + " 0 " +
                             std::to_string(terrain.levels - 1);
  std::string inner = "<Piece Extent=\"" + extent + "\"><PointData>";
  inner += xml.array("Float64", "a", 1, height) + "</PointData><Points>";
  inner += xml.array("Float64", "p", 3, points) + "</Points></Piece>";
  return xml.file("StructuredGrid", "WholeExtent=\"" + extent + "\"", inner);
}

// 460 km long and 15 km high: with the same spacing along all axes, there would be only three
// samples vertically. Half as many samples as points and cells is about one sample per cell, hence
// as many layers.
TEST_F(VtkResampling, LayersOfAShallowGridStayResolved) {
  const Terrain terrain{30};
  VtkXml xml({"appended-raw", "", false, 8});
  const auto source = opened(folder_.write("a.vts", terrain_vts(terrain, xml)));
  ASSERT_TRUE(source);
  const auto dims = source->info().grid.dims();
  EXPECT_NEAR(dims[0], 24, 2);
  EXPECT_NEAR(dims[1], 20, 2);
  EXPECT_NEAR(dims[2], 30, 2);
  EXPECT_NEAR(source->info().grid.axes[2].coordinates.back(), Terrain::lid, 1);
  EXPECT_LT(source->info().grid.axes[2].coordinates.front(), Terrain::lid / 29);
  const Outcome out = compare(*source, [](const Place& p) { return p[2]; });
  EXPECT_LT(out.worst, 1e-2);  // of 15,000 m in single precision
  EXPECT_THAT(out.notes, testing::Not(HasSubstr("fewer samples")));
}

TEST_F(VtkResampling, MoreLayersThanSamplesAreNoted) {
  const Terrain terrain{400, 8, 6};
  VtkXml xml({"appended-raw", "", false, 8});
  const auto source = opened(folder_.write("a.vts", terrain_vts(terrain, xml)));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.dims()[2], 256);
  EXPECT_GE(source->info().grid.dims()[0], 8);
  EXPECT_THAT(all_notes(source->info()),
              HasSubstr("along z fewer samples than cells: 256 for about 399"));
}

// Layers 0.1 thick that rise by 0.5 from column to column: bounding boxes of the cells are 0.6
// high.
TEST_F(VtkResampling, SlopesDoNotThickenLayers) {
  constexpr int n = 16;
  std::vector<double> points;
  std::vector<double> values;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const Place p{i * 1.0, j * 1.0, 0.1 * k + 0.5 * i};
        points.insert(points.end(), p.begin(), p.end());
        values.push_back(linear(p));
      }
    }
  }
  VtkXml xml;
  std::string inner = "<Piece><PointData>" + xml.array("Float64", "a", 1, values);
  inner += "</PointData><Points>" + xml.array("Float64", "p", 3, points) + "</Points></Piece>";
  const auto source = opened(
      folder_.write("a.vts", xml.file("StructuredGrid", "WholeExtent=\"0 15 0 15 0 15\"", inner)));
  ASSERT_TRUE(source);
  const auto& axes = source->info().grid.axes;
  const auto spacing = [&](std::size_t a) {
    return axes[a].coordinates[1] - axes[a].coordinates[0];
  };
  EXPECT_NEAR(spacing(2) / spacing(0), 0.1, 0.005);
  EXPECT_LE(spacing(2), 0.1);
  EXPECT_LT(compare(*source, linear).worst, 1e-5);
}

// The same grid as wedges without indices: only their bounding boxes are known.
TEST_F(VtkResampling, SpacingFollowsTheCellsOfAMesh) {
  const Map flat = [](const Place& p) { return Place{1000 * p[0], 400 * p[1], 10 * p[2]}; };
  const TestMesh mesh = boxes(16, flat, as_wedges);
  VtkXml xml({"appended-raw", "", false, 8});
  const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
  const auto source = opened(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
  ASSERT_TRUE(source);
  const auto dims = source->info().grid.dims();
  EXPECT_EQ(dims[1], dims[0]);
  EXPECT_EQ(dims[2], dims[0]);
  EXPECT_GT(dims[0], 16);
  const Outcome out = compare(*source, linear);
  EXPECT_LT(out.worst, 1e-3);
  EXPECT_EQ(out.inside, 1);
}

}  // namespace
}  // namespace windsplat::data::vtk_test
