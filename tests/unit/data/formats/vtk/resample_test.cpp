// Meshes resampled on a uniform lattice: linear fields are reproduced, the fraction of samples
// inside is the fraction of the box inside the mesh, and for smooth fields the error decreases with
// the square of the cell size.
#include <gmock/gmock.h>

#include <numbers>

#include "tests/unit/data/formats/vtk/test_mesh.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;

// Rotated about z by up to a third of a right angle with height: the internal faces are not planar.
Place twist(const Place& p) {
  const double angle = p[2] * std::numbers::pi / 6;
  const double x = p[0] - 0.5;
  const double y = p[1] - 0.5;
  return {x * std::cos(angle) - y * std::sin(angle), x * std::sin(angle) + y * std::cos(angle),
          2 * p[2]};
}

TEST_F(VtkResampling, LinearFieldsAreExactOnTwistedCellsOfEveryShape) {
  // The twist keeps areas at each height, so the volume is 2.
  for (const auto& cut : {as_hexahedron, as_voxel, as_wedges, as_tetrahedra, as_pyramids}) {
    const TestMesh mesh = boxes(12, twist, cut);
    const Outcome out = outcome(mesh, linear);
    SCOPED_TRACE("type " + std::to_string(static_cast<int>(mesh.types.front())));
    EXPECT_LT(out.worst, 1e-5);
    EXPECT_NEAR(out.volume, 2, 0.06);
    EXPECT_THAT(out.notes, HasSubstr("resampled from 2197 points and "));
  }
}

TEST_F(VtkResampling, SmoothFieldsConvergeWithTheSquareOfTheCellSize) {
  const Function smooth = [](const Place& p) { return std::sin(2 * p[0]) * std::cos(p[1] + p[2]); };
  for (const auto& cut : {as_hexahedron, as_tetrahedra, as_wedges}) {
    const double coarse = outcome(boxes(8, twist, cut), smooth).worst;
    const double fine = outcome(boxes(16, twist, cut), smooth).worst;
    EXPECT_GT(std::log2(coarse / fine), 1.7);
    EXPECT_LT(fine, 0.01);
  }
}

// A shell: samples in its hole and outside are in no cell and must be masked.
TEST_F(VtkResampling, ShareOfInsideSamplesIsThatOfTheMesh) {
  const Map shell = [](const Place& p) {
    const double angle = p[0] * 2 * std::numbers::pi;
    const double radius = 1 + p[1];
    return Place{radius * std::cos(angle), radius * std::sin(angle), 3 * p[2]};
  };
  const Outcome out = outcome(boxes(24, shell, as_hexahedron), linear);
  // A polygon of 24 corners instead of the circle.
  const double polygon = 12 * std::sin(std::numbers::pi / 12);
  EXPECT_NEAR(out.volume, 9 * polygon, 0.03 * 9 * polygon);
  EXPECT_LT(out.worst, 1e-5);
}

TEST_F(VtkResampling, CurvedStructuredGridIsResampledWithoutHiddenCells) {
  constexpr int n = 11;
  std::vector<double> points;
  std::vector<double> values;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const Place p = twist({i / 10.0, j / 10.0, k / 10.0});
        points.insert(points.end(), p.begin(), p.end());
        values.push_back(linear(p));
      }
    }
  }
  std::vector<double> ghosts(1000, 0);
  std::fill_n(ghosts.begin(), 500, 32);  // the lower half
  double inside = 0;
  for (const bool half : {false, true}) {
    VtkXml xml({"base64", "ZLib", false, 4});
    std::string inner = "<Piece Extent=\"0 10 0 10 0 10\"><PointData>";
    inner += xml.array("Float64", "a", 1, values) + "</PointData><CellData>";
    if (half) inner += xml.array("UInt8", "vtkGhostType", 1, ghosts);
    inner += "</CellData><Points>" + xml.array("Float64", "p", 3, points) + "</Points></Piece>";
    const auto source = opened(folder_.write(
        "a.vts", xml.file("StructuredGrid", "WholeExtent=\"0 10 0 10 0 10\"", inner)));
    ASSERT_TRUE(source);
    const Outcome out = compare(*source, linear);
    EXPECT_LT(out.worst, 1e-5);
    const double height = source->info().grid.axes[2].coordinates.front();
    EXPECT_NEAR(height, half ? 1 : 0, 0.1);
    EXPECT_GT(out.inside, 0.5);
    inside = out.inside;
  }
  EXPECT_LT(inside, 0.7);
}

TEST_F(VtkResampling, FlatMeshIsAPlane) {
  TestMesh mesh;
  // y = 5; the height of both cells equals their length.
  mesh.points = {0, 5, 0, 2, 5, 0, 2, 5, 2, 0, 5, 2, 4, 5, 0};
  mesh.cell(9, {0, 1, 2, 3});
  mesh.cell(5, {1, 4, 2});
  VtkXml xml;
  const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
  const auto source = opened(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
  ASSERT_TRUE(source);
  const auto dims = source->info().grid.dims();
  EXPECT_EQ(dims[1], 1);
  EXPECT_NEAR(dims[0], 2 * dims[2], 3);
  const Outcome out = compare(*source, linear);
  EXPECT_LT(out.worst, 1e-5);
  EXPECT_NEAR(out.inside, 0.75, 0.03);
}

TEST_F(VtkResampling, CellDataAreThoseOfTheContainingCell) {
  const Map stretch = [](const Place& p) { return Place{p[0] + 0.3 * p[2], p[1], p[2]}; };
  const TestMesh mesh = boxes(2, stretch, as_hexahedron);
  VtkXml xml;
  const auto data = xml.array("Int32", "a", 1, {0, 1, 2, 3, 4, 5, 6, 7});
  const auto source = opened(folder_.write("a.vtu", vtu(mesh, "", data, xml)));
  ASSERT_TRUE(source);
  const auto& axes = source->info().grid.axes;
  const Volume volume = volume_of(*source, "a");
  std::size_t s = 0;
  for (const double z : axes[2].coordinates) {
    for (const double y : axes[1].coordinates) {
      for (const double x : axes[0].coordinates) {
        const float value = volume.values[s++];
        const double u = x - 0.3 * z;
        const bool near_face = std::abs(u - 0.5) < 1e-5 || std::abs(y - 0.5) < 1e-5 ||
                               std::abs(z - 0.5) < 1e-5 || std::abs(u) < 1e-5 ||
                               std::abs(u - 1) < 1e-5;
        if (near_face) continue;
        if (u < 0 || u > 1) {
          EXPECT_TRUE(std::isnan(value));
        } else {
          EXPECT_EQ(value, (u > 0.5 ? 1 : 0) + (y > 0.5 ? 2 : 0) + (z > 0.5 ? 4 : 0));
        }
      }
    }
  }
}

// Tetrahedra along the diagonal, whose boxes contain all samples and which contain only few: those
// with nonnegative barycentric coordinates. In total the boxes contain 600 times the samples.
TestMesh slivers(double width, int count) {
  TestMesh mesh;
  mesh.points = {0, 0, 0, width, 0, 0, 0, width, 0, 1, 1, 1};
  for (int c = 0; c < count; ++c) mesh.cell(10, {0, 1, 2, 3});
  return mesh;
}

TEST_F(VtkResampling, SliversUseTheirBarycentricCoordinates) {
  constexpr double width = 0.1;
  const TestMesh mesh = slivers(width, 20);
  VtkXml xml;
  const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
  const auto source = opened(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
  ASSERT_TRUE(source);
  const auto& axes = source->info().grid.axes;
  const Volume volume = volume_of(*source, "a");
  std::size_t s = 0;
  std::size_t inside = 0;
  for (const double z : axes[2].coordinates) {
    for (const double y : axes[1].coordinates) {
      for (const double x : axes[0].coordinates) {
        const double first = (x - z) / width;
        const double second = (y - z) / width;
        const double least = std::min({first, second, z, 1 - first - second - z});
        const bool hidden = std::isnan(volume.values[s++]);
        if (std::abs(least) < 1e-5) continue;
        ASSERT_EQ(hidden, least < 0) << x << ' ' << y << ' ' << z;
        inside += hidden ? 0 : 1;
      }
    }
  }
  EXPECT_GT(inside, 50);
}

// Wedges one on top of the other in half of a cube: samples of the other half are searched for in
// each of them. A few kilobytes must not cause a minute of work.
TEST_F(VtkResampling, CellsWithExcessiveWorkForTheirFileAreRefused) {
  for (const int count : {20, 200}) {
    TestMesh mesh;
    mesh.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1};
    for (int c = 0; c < count; ++c) mesh.cell(13, {0, 1, 2, 3, 4, 5});
    VtkXml xml;
    const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
    const std::string said = refusal(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
    EXPECT_EQ(said.find("too thin and oblique to be resampled") != std::string::npos, count == 200)
        << said;
  }
  // So thin that the lattice has the maximum number of samples, whose rows intersect every box.
  const TestMesh thin = slivers(1e-4, 60);
  VtkXml xml;
  const auto data = xml.array("Float64", "a", 1, at_points(thin, linear));
  EXPECT_THAT(refusal(folder_.write("a.vtu", vtu(thin, data, "", xml))),
              HasSubstr("too thin and oblique to be resampled"));
}

// The largest overlap of a valid file: a cell repeated a thousand times.
TEST_F(VtkResampling, OverlappingCellsWithinThatBoundAreRead) {
  TestMesh mesh = boxes(
      1, [](const Place& p) { return p; }, as_hexahedron);
  for (int c = 1; c < 1000; ++c) mesh.cell(12, {0, 1, 3, 2, 4, 5, 7, 6});
  const Outcome out = outcome(mesh, linear);
  EXPECT_EQ(out.inside, 1);
  EXPECT_LT(out.worst, 1e-5);
}

// Every piece numbers its points and cells from 0. The value of a cell is the number of its piece.
TEST_F(VtkResampling, PiecesOfOneMeshAreOne) {
  const auto at_x = [](double from) {
    return [from](const Place& p) { return Place{from + p[0], p[1], p[2]}; };
  };
  const std::array<TestMesh, 2> meshes{boxes(4, at_x(0), as_hexahedron),
                                       boxes(4, at_x(1), as_tetrahedra)};
  for (const bool of_cells : {false, true}) {
    VtkXml xml({"appended-raw", "ZLib", false, 4});
    std::string inner;
    double number = 0;
    for (const TestMesh& mesh : meshes) {
      const auto values =
          of_cells ? std::vector<double>(mesh.types.size(), ++number) : at_points(mesh, linear);
      const auto data = xml.array("Float64", "a", 1, values);
      inner += piece_of(mesh, of_cells ? "" : data, of_cells ? data : "", xml);
    }
    const auto source = opened(folder_.write("p.vtu", xml.file("UnstructuredGrid", "", inner)));
    ASSERT_TRUE(source);
    // Samples on a shared face belong to the first cell.
    const Outcome got = compare(*source, [&](const Place& p) {
      return of_cells ? (p[0] < 1 + 1e-6 ? 1.0 : 2.0) : linear(p);
    });
    EXPECT_NEAR(got.inside, 1, 1e-9);
    EXPECT_LT(got.worst, 1e-5);
    EXPECT_GT(source->info().grid.axes[0].coordinates.back(), 1.9);
  }
}

TEST_F(VtkResampling, HiddenCellsHoldNothing) {
  const TestMesh mesh = boxes(
      4, [](const Place& p) { return p; }, as_hexahedron);
  std::vector<double> ghosts(64, 0);
  std::fill(ghosts.begin() + 32, ghosts.end(), 32);  // the upper half
  VtkXml xml;
  const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
  const auto hidden = xml.array("UInt8", "vtkGhostType", 1, ghosts);
  const auto source = opened(folder_.write("h.vtu", vtu(mesh, data, hidden, xml)));
  ASSERT_TRUE(source);
  EXPECT_NEAR(compare(*source, linear).volume, 0.5, 0.01);
}

// At x = 0 the corners at x = 1 have zero weight.
TEST_F(VtkResampling, PointsOfZeroWeightMayBeMissing) {
  const TestMesh mesh = boxes(
      1, [](const Place& p) { return p; }, as_hexahedron);
  VtkXml xml({"base64", "", false, 4});
  const auto data =
      xml.array("Float64", "a", 1,
                at_points(mesh, [](const Place& p) { return p[0] > 0 ? std::nan("") : 5.0; }));
  const auto source = opened(folder_.write("w.vtu", vtu(mesh, data, "", xml)));
  ASSERT_TRUE(source);
  const Volume volume = volume_of(*source, "a");
  const auto width = static_cast<std::size_t>(volume.dims[0]);
  for (std::size_t n = 0; n < volume.samples(); ++n) {
    ASSERT_EQ(std::isnan(volume.values[n]), n % width > 0) << n;
  }
  EXPECT_EQ(volume.range, (std::array<float, 2>{5, 5}));
}

TEST_F(VtkResampling, DegenerateCellsAreCountedAndTheOthersShown) {
  TestMesh mesh = boxes(
      3, [](const Place& p) { return p; }, as_hexahedron);
  mesh.cell(12, {0, 0, 0, 0, 1, 1, 1, 1});
  mesh.cell(42, {0, 1, 2, 3, 4});
  mesh.cell(25, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19});
  mesh.cell(9, {0, 1, 5, 4});
  const auto nan = static_cast<double>(mesh.points.size() / 3);
  mesh.points.insert(mesh.points.end(), {std::nan(""), 0, 0});
  mesh.cell(10, {0, 1, 4, static_cast<int>(nan)});
  const Outcome out =
      outcome(mesh, [](const Place& p) { return std::isnan(p[0]) ? 0 : linear(p); });
  EXPECT_LT(out.worst, 1e-5);
  EXPECT_EQ(out.inside, 1);
  EXPECT_THAT(out.notes, HasSubstr("27 cells"));
  EXPECT_THAT(out.notes, HasSubstr("1 cells of type 42 omitted"));
  EXPECT_THAT(out.notes, HasSubstr("1 cells of type 25 omitted"));
  EXPECT_THAT(out.notes, HasSubstr("1 flat cells"));
  EXPECT_THAT(out.notes, HasSubstr("2 cells without volume"));
}

TEST_F(VtkResampling, BrokenCellsAreErrors) {
  const auto file = [&](const std::function<void(TestMesh&)>& spoil) {
    TestMesh mesh = boxes(2, twist, as_hexahedron);
    spoil(mesh);
    VtkXml xml({"appended-raw", "", false, 4});
    const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
    return refusal(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
  };
  EXPECT_EQ(file([](TestMesh&) {}), "");
  EXPECT_THAT(file([](TestMesh& m) { m.connectivity[5] = 27; }), HasSubstr("point 27"));
  EXPECT_THAT(file([](TestMesh& m) { m.connectivity[5] = -1; }), HasSubstr("not an index"));
  EXPECT_THAT(file([](TestMesh& m) { m.offsets[3] = 2; }),
              HasSubstr("offsets of its cells decrease"));
  EXPECT_THAT(file([](TestMesh& m) { m.offsets[7] = 72; }), HasSubstr("bytes instead of"));
  EXPECT_THAT(file([](TestMesh& m) { m.offsets[7] = 2e9; }), HasSubstr("bytes instead of"));
  EXPECT_THAT(file([](TestMesh& m) { std::fill(m.types.begin(), m.types.end(), 3); }),
              HasSubstr("no cells of a supported kind"));
  EXPECT_THAT(file([](TestMesh& m) {
                std::fill(m.types.begin(), m.types.end(), 12);
                std::fill(m.points.begin(), m.points.end(), 1);
              }),
              HasSubstr("without any volume"));
}

TEST_F(VtkResampling, SurfaceInSpaceIsRefused) {
  TestMesh mesh;
  mesh.points = {0, 0, 0, 1, 0, 0, 1, 1, 1};
  mesh.cell(5, {0, 1, 2});
  VtkXml xml;
  const auto data = xml.array("Float64", "a", 1, {1, 2, 3});
  EXPECT_THAT(refusal(folder_.write("a.vtu", vtu(mesh, data, "", xml))), HasSubstr("surface"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
