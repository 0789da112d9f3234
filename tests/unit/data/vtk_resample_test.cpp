// Meshes resampled on an even lattice: linear fields are reproduced, the share of inside samples is
// the mesh's share of its box, smooth fields converge with the square of the cell size.
#include <gmock/gmock.h>

#include <functional>
#include <numbers>

#include "vtk_maker.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;
using Place = std::array<double, 3>;
using Map = std::function<Place(const Place&)>;
using Function = std::function<double(const Place&)>;

struct TestMesh {
  std::vector<double> points;
  std::vector<double> connectivity;
  std::vector<double> offsets;
  std::vector<double> types;
  void cell(int type, const std::vector<int>& corners) {
    connectivity.insert(connectivity.end(), corners.begin(), corners.end());
    offsets.push_back(static_cast<double>(connectivity.size()));
    types.push_back(type);
  }
};

// The unit cube in n^3 boxes, transformed by `map`, each split by `cut` into cells.
TestMesh boxes(int n, const Map& map,
               const std::function<void(TestMesh&, const std::array<int, 8>&)>& cut) {
  TestMesh mesh;
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        const Place p = map({i / double(n), j / double(n), k / double(n)});
        mesh.points.insert(mesh.points.end(), p.begin(), p.end());
      }
    }
  }
  const auto at = [n](int i, int j, int k) { return (k * (n + 1) + j) * (n + 1) + i; };
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        cut(mesh,
            {at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
             at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
      }
    }
  }
  return mesh;
}

void as_hexahedron(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(12, {c.begin(), c.end()});
}
void as_voxel(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(11, {c[0], c[1], c[3], c[2], c[4], c[5], c[7], c[6]});
}
void as_wedges(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(13, {c[0], c[1], c[2], c[4], c[5], c[6]});
  mesh.cell(13, {c[0], c[2], c[3], c[4], c[6], c[7]});
}
void as_tetrahedra(TestMesh& mesh, const std::array<int, 8>& c) {
  for (const auto& [a, b] : {std::pair(1, 2), {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}}) {
    mesh.cell(10, {c[0], c[static_cast<std::size_t>(a)], c[static_cast<std::size_t>(b)], c[6]});
  }
}
// Three pyramids that share the corner 6.
void as_pyramids(TestMesh& mesh, const std::array<int, 8>& c) {
  mesh.cell(14, {c[0], c[1], c[2], c[3], c[6]});
  mesh.cell(14, {c[0], c[4], c[5], c[1], c[6]});
  mesh.cell(14, {c[0], c[3], c[7], c[4], c[6]});
}

std::string piece_of(const TestMesh& mesh, const std::string& point_data,
                     const std::string& cell_data, VtkXml& xml) {
  std::string inner = "<Piece NumberOfPoints=\"" + std::to_string(mesh.points.size() / 3);
  inner += "\" NumberOfCells=\"" + std::to_string(mesh.types.size()) + "\"><PointData>";
  inner += point_data + "</PointData><CellData>" + cell_data + "</CellData><Points>";
  inner += xml.array("Float64", "Points", 3, mesh.points) + "</Points><Cells>";
  inner += xml.array("Int64", "connectivity", 1, mesh.connectivity);
  inner += xml.array("Int32", "offsets", 1, mesh.offsets);
  return inner + xml.array("UInt8", "types", 1, mesh.types) + "</Cells></Piece>";
}

std::string vtu(const TestMesh& mesh, const std::string& point_data, const std::string& cell_data,
                VtkXml& xml) {
  const std::string inner = piece_of(mesh, point_data, cell_data, xml);
  return xml.file("UnstructuredGrid", "", inner);
}

std::vector<double> at_points(const TestMesh& mesh, const Function& f) {
  std::vector<double> out;
  for (std::size_t p = 0; p < mesh.points.size(); p += 3) {
    out.push_back(f({mesh.points[p], mesh.points[p + 1], mesh.points[p + 2]}));
  }
  return out;
}

struct Outcome {
  double worst = 0;   // difference from the field itself, over the samples inside
  double inside = 0;  // their share, those at the ends of an axis counted half
  double volume = 0;  // what they stand for
  std::string notes;
};

Outcome compare(Source& source, const Function& f) {
  const auto& axes = source.info().grid.axes;
  const Volume volume = volume_of(source, "a");
  const auto end_weight = [](const Axis& axis, std::size_t i) {
    return axis.coordinates.size() > 1 && (i == 0 || i + 1 == axis.coordinates.size()) ? 0.5 : 1.0;
  };
  Outcome out;
  double all = 0;
  std::size_t s = 0;
  for (std::size_t k = 0; k < axes[2].coordinates.size(); ++k) {
    for (std::size_t j = 0; j < axes[1].coordinates.size(); ++j) {
      for (std::size_t i = 0; i < axes[0].coordinates.size(); ++i) {
        const float value = volume.values[s++];
        const double weight =
            end_weight(axes[0], i) * end_weight(axes[1], j) * end_weight(axes[2], k);
        all += weight;
        if (std::isnan(value)) continue;
        out.inside += weight;
        const Place place{axes[0].coordinates[i], axes[1].coordinates[j], axes[2].coordinates[k]};
        out.worst = std::max(out.worst, std::abs(value - f(place)));
      }
    }
  }
  out.volume = out.inside;
  for (const Axis& axis : axes) {
    if (axis.coordinates.size() > 1) out.volume *= axis.coordinates[1] - axis.coordinates[0];
  }
  out.inside /= all;
  out.notes = all_notes(source.info());
  return out;
}

class VtkResampling : public testing::Test {
 protected:
  Outcome outcome(const TestMesh& mesh, const Function& f) {
    VtkXml xml({"appended-raw", "", false, 8});
    const auto data = xml.array("Float64", "a", 1, at_points(mesh, f));
    const auto source = opened(folder_.write("a.vtu", vtu(mesh, data, "", xml)));
    return source ? compare(*source, f) : Outcome();
  }
  VtkFolder folder_;
};

// Rotated about z by up to a third of a right angle with height: the internal faces are not planar.
Place twist(const Place& p) {
  const double angle = p[2] * std::numbers::pi / 6;
  const double x = p[0] - 0.5;
  const double y = p[1] - 0.5;
  return {x * std::cos(angle) - y * std::sin(angle), x * std::sin(angle) + y * std::cos(angle),
          2 * p[2]};
}

double linear(const Place& p) { return 3 * p[0] - 2 * p[1] + 0.5 * p[2] + 1; }

TEST_F(VtkResampling, LinearFieldsAreExactOnTwistedCellsOfEveryShape) {
  // The twist keeps the area at each height, so the volume is 2.
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
  // y = 5; both cells are as high as long.
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

// A model grid: `n` levels that follow a hill from the ground to a lid, over 24 x 20 columns.
struct Terrain {
  static constexpr int columns = 24;
  static constexpr int rows = 20;
  static constexpr double step = 20e3;
  static constexpr double lid = 15e3;
  int levels;
  [[nodiscard]] Place at(int i, int j, int k) const {
    const double ground = 1000 * std::exp(-(std::pow(i - 12, 2) + std::pow(j - 10, 2)) / 20.0);
    return {i * step, j * step, ground + (lid - ground) * k / (levels - 1)};
  }
};

std::string terrain_vts(const Terrain& terrain, VtkXml& xml) {
  std::vector<double> points;
  std::vector<double> height;
  for (int k = 0; k < terrain.levels; ++k) {
    for (int j = 0; j < Terrain::rows; ++j) {
      for (int i = 0; i < Terrain::columns; ++i) {
        const Place p = terrain.at(i, j, k);
        points.insert(points.end(), p.begin(), p.end());
        height.push_back(p[2]);
      }
    }
  }
  const std::string extent = "0 23 0 19 0 " + std::to_string(terrain.levels - 1);
  std::string inner = "<Piece Extent=\"" + extent + "\"><PointData>";
  inner += xml.array("Float64", "a", 1, height) + "</PointData><Points>";
  inner += xml.array("Float64", "p", 3, points) + "</Points></Piece>";
  return xml.file("StructuredGrid", "WholeExtent=\"" + extent + "\"", inner);
}

// 460 km long and 15 km high: equal spacing along all axes has three samples vertically. Half of
// the points and cells gives about as many samples as cells, and as many layers.
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
  const Terrain terrain{400};
  VtkXml xml({"appended-raw", "", false, 8});
  const auto source = opened(folder_.write("a.vts", terrain_vts(terrain, xml)));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.dims()[2], 256);
  EXPECT_GE(source->info().grid.dims()[0], 24);
  EXPECT_THAT(all_notes(source->info()),
              HasSubstr("along z fewer samples than cells: 256 for about 399"));
}

// Layers 0.1 thick that rise by 0.5 from column to column: bounding boxes of cells are 0.6 high.
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

// The same for wedges without indices: only their boxes are known.
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

// Tetrahedra along the diagonal, whose boxes contain all samples and which contain few: those with
// nonnegative barycentric coordinates. The boxes contain 600 times the samples.
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

// Wedges that lie one upon the other in half of a cube: samples of the other half are sought in
// every one of them. A few kilobytes must not make a minute of work.
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
  // So thin that the lattice has the maximum number of samples, whose rows are in every box.
  const TestMesh thin = slivers(1e-4, 60);
  VtkXml xml;
  const auto data = xml.array("Float64", "a", 1, at_points(thin, linear));
  EXPECT_THAT(refusal(folder_.write("a.vtu", vtu(thin, data, "", xml))),
              HasSubstr("too thin and oblique to be resampled"));
}

// The most overlap of a valid file: a cell repeated a thousand times.
TEST_F(VtkResampling, OverlappingCellsWithinThatBoundAreRead) {
  TestMesh mesh = boxes(
      1, [](const Place& p) { return p; }, as_hexahedron);
  for (int c = 1; c < 1000; ++c) mesh.cell(12, {0, 1, 3, 2, 4, 5, 7, 6});
  const Outcome out = outcome(mesh, linear);
  EXPECT_EQ(out.inside, 1);
  EXPECT_LT(out.worst, 1e-5);
}

// Every piece numbers its points and cells from 0. A cell's value is the number of its piece.
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
    // Samples on a shared face belong to the cells that come first.
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
  EXPECT_THAT(out.notes, HasSubstr("1 cells of type 42 left out"));
  EXPECT_THAT(out.notes, HasSubstr("1 cells of type 25 left out"));
  EXPECT_THAT(out.notes, HasSubstr("1 flat cells"));
  EXPECT_THAT(out.notes, HasSubstr("2 cells left out that have no volume"));
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
  EXPECT_THAT(file([](TestMesh& m) { m.connectivity[5] = 27; }), HasSubstr("corner 27"));
  EXPECT_THAT(file([](TestMesh& m) { m.connectivity[5] = -1; }), HasSubstr("not an index"));
  EXPECT_THAT(file([](TestMesh& m) { m.offsets[3] = 2; }), HasSubstr("offsets go back"));
  EXPECT_THAT(file([](TestMesh& m) { m.offsets[7] = 72; }), HasSubstr("bytes where"));
  EXPECT_THAT(file([](TestMesh& m) { m.offsets[7] = 2e9; }), HasSubstr("bytes where"));
  EXPECT_THAT(file([](TestMesh& m) { std::fill(m.types.begin(), m.types.end(), 3); }),
              HasSubstr("no cells of a kind"));
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
