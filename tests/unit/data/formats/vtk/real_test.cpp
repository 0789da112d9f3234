// Files that were not made for these tests: those of Debian's package mayavi2, fetched by
// scripts/fetch-test-data. The expected values were read by VTK itself, which can be repeated:
// vtkDataSetReader, vtkXMLUnstructuredGridReader (Debian: python3-vtk9) and vtkProbeFilter.
#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/unit/data/formats/vtk/vtk_maker.hpp"
#include "tests/unit/data/test_data.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;

std::unique_ptr<Source> real(const std::string& name) {
  const std::string path = test::test_data(name);
  EXPECT_TRUE(std::filesystem::exists(path)) << "run scripts/fetch-test-data";
  return opened(path);
}

// A sample by its indices.
double at(const DatasetInfo& info, const Volume& volume, std::array<std::size_t, 3> index,
          int component = 0) {
  const auto dims = info.grid.dims();
  const std::size_t row = index[2] * static_cast<std::size_t>(dims[1]) + index[1];
  return volume.component(component)[row * static_cast<std::size_t>(dims[0]) + index[0]];
}

// The coordinates of a sample.
std::array<double, 3> place(const DatasetInfo& info, std::array<std::size_t, 3> index) {
  const auto& axes = info.grid.axes;
  return {axes[0].coordinates[index[0]], axes[1].coordinates[index[1]],
          axes[2].coordinates[index[2]]};
}

TEST(VtkRealFile, LegacyRectilinearGrid) {
  const auto source = real("RectGrid2.vtk");
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.format, "VTK rectilinear grid, legacy");
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{47, 33, 11}));
  const auto where = place(info, {20, 9, 7});
  EXPECT_NEAR(where[0], -0.182292, 1e-6);
  EXPECT_NEAR(where[1], -0.546875, 1e-6);
  EXPECT_NEAR(where[2], 0.7, 1e-6);
  const Volume speed = volume_of(*source, "scalars");
  const Volume flow = volume_of(*source, "vectors");
  EXPECT_FLOAT_EQ(at(info, speed, {20, 9, 7}), 1.01418F);
  EXPECT_FLOAT_EQ(at(info, flow, {20, 9, 7}, 0), 0.950352F);
  EXPECT_FLOAT_EQ(at(info, flow, {20, 9, 7}, 1), -0.189069F);
  EXPECT_FLOAT_EQ(at(info, flow, {20, 9, 7}, 2), 0.299413F);
  double sum = 0;
  for (const float v : flow.values) sum += std::abs(v);
  EXPECT_NEAR(sum, 12838.950805628714, 1e-6);
  EXPECT_EQ(speed.masked, 0);
  EXPECT_FLOAT_EQ(speed.range[1], 10.3964F);
}

TEST(VtkRealFile, ImageWithDifferentSpacings) {
  const auto source = real("heart.vti");
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{32, 32, 12}));
  EXPECT_EQ(place(info, {11, 17, 5}), (std::array<double, 3>{11, 17, 20}));
  const Volume volume = volume_of(*source, "scalars");
  EXPECT_EQ(at(info, volume, {11, 17, 5}), 83);
  double sum = 0;
  for (const float v : volume.values) sum += v;
  EXPECT_EQ(sum, 832283);
}

// The volume of the bounding box is 36, that of the cells 35.5475.
TEST(VtkRealFile, UnstructuredGridOfHexahedra) {
  const auto source = real("fire_ug.vtu");
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_THAT(all_notes(info), HasSubstr("from 12323 points and 10462 cells onto 42 x 18 x 17"));
  const Volume heat = volume_of(*source, "t");
  const Volume flow = volume_of(*source, "uvw");
  EXPECT_NEAR(1 - static_cast<double>(heat.masked) / heat.samples(), 35.5475 / 36, 0.02);
  struct Known {
    std::array<std::size_t, 3> index;
    std::array<double, 3> place;
    double heat;
    std::array<double, 3> flow;
  };
  const std::vector<Known> known{{{20, 8, 8},
                                  {2.926829268292683, 1.1768292682926829, 1.1999999284744263},
                                  341.10754,
                                  {0.22013187, 0.04669349, -0.05535454}},
                                 {{5, 3, 2},
                                  {0.7317073170731707, 0.44512195121951215, 0.32195114798662144},
                                  304.88864,
                                  {-0.29798448, 0.08040650, -0.08195020}},
                                 {{37, 14, 13},
                                  {5.414634146341463, 2.0548780487804876, 1.931707245547597},
                                  341.04471,
                                  {0.42562472, 0.09014037, -0.08115468}}};
  for (const Known& k : known) {
    const auto where = place(info, k.index);
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(where[a], k.place[a], 1e-9);
    EXPECT_NEAR(at(info, heat, k.index), k.heat, 1e-4);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(at(info, flow, k.index, c), k.flow[static_cast<std::size_t>(c)], 1e-7);
    }
  }
}

TEST(VtkRealFile, CurvedStructuredGrid) {
  const auto source = real("SampleStructGrid.vtk");
  ASSERT_TRUE(source);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("resampled from 24000 points"));
  EXPECT_GT(volume_of(*source, "scalars").range[0], 0);
}

}  // namespace
}  // namespace windsplat::data::vtk_test
