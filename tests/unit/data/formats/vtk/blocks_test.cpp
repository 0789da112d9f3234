// Multi-block files (.vtm), partitioned data sets (.vtpd .vtpc) and parts of a collection.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/vtk/test_mesh.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string blocks_of(const std::string& type, const std::string& inner) {
  return VtkXml().file(type, "", inner);
}

std::string data_set(const std::string& name, const std::string& file) {
  return "<DataSet index=\"0\" name=\"" + name + "\" file=\"" + file + "\"/>";
}

std::string block(const std::string& name, const std::string& inner) {
  return "<Block index=\"0\" name=\"" + name + "\">" + inner + "</Block>";
}

class VtkBlocks : public testing::Test {
 protected:
  // An image whose values are those of linear() at its points.
  std::string image(const std::string& name, const Place& origin, double spacing,
                    const std::array<int, 3>& dims, const std::string& direction = "",
                    const std::string& array = "a") {
    VtkXml xml;
    std::vector<double> values;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) {
          const bool turned = !direction.empty();  // i along y, j against x
          values.push_back(
              linear({origin[0] + spacing * (turned ? -j : i),
                      origin[1] + spacing * (turned ? i : j), origin[2] + spacing * k}));
        }
      }
    }
    std::string placed = "Origin=\"" + VtkXml::text({origin[0], origin[1], origin[2]});
    placed += "\" Spacing=\"" + VtkXml::text({spacing, spacing, spacing}) + "\"";
    if (!direction.empty()) placed += " Direction=\"" + direction + "\"";
    folder_.write(name, xml.image(dims, placed, xml.array("Float64", array, 1, values)));
    return name;
  }

  // A mesh of the unit cube moved by `x`.
  std::string mesh(const std::string& name, double x, const std::string& array = "a") {
    const TestMesh cells = boxes(
        4,
        [x](const Place& p) {
          return Place{p[0] + x, p[1], p[2]};
        },
        as_tetrahedra);
    VtkXml xml({"appended-raw", "", false, 4});
    folder_.write(name,
                  vtu(cells, xml.array("Float64", array, 1, at_points(cells, linear)), "", xml));
    return name;
  }

  std::string surface(const std::string& name) {
    TestMesh cells;
    cells.points = {0, 0, 0, 1, 0, 0, 1, 1, 1};
    cells.cell(5, {0, 1, 2});
    VtkXml xml;
    folder_.write(name, vtu(cells, xml.array("Float64", "shear", 1, {1, 2, 3}), "", xml));
    return name;
  }

  std::string polygons(const std::string& name) {
    folder_.write(name, VtkXml().file("PolyData", "", "<Piece NumberOfPoints=\"0\"/>"));
    return name;
  }

  VtkFolder folder_;
};

TEST_F(VtkBlocks, ImagesOfOneLatticeBecomeAnImage) {
  const auto source = opened(folder_.write(
      "all.vtm", blocks_of("vtkMultiBlockDataSet",
                           block("left", data_set("", image("l.vti", {-1, 0, 2}, 0.5, {3, 4, 2}))) +
                               data_set("right", image("r.vti", {0, 0, 2}, 0.5, {5, 4, 2})))));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().format, "VTK blocks");
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{7, 4, 2}));
  EXPECT_EQ(source->info().grid.axes[0].coordinates.front(), -1);
  EXPECT_EQ(source->info().grid.axes[0].coordinates.back(), 2);
  EXPECT_THAT(all_notes(source->info()),
              HasSubstr("2 blocks are shown as one image: 'left/0', 'right'"));
  const Outcome got = compare(*source, linear);
  EXPECT_LT(got.worst, 1e-6);
  EXPECT_EQ(got.inside, 1);
}

// Blocks with a gap: the samples between them are masked.
TEST_F(VtkBlocks, GapsBetweenImagesAreMasked) {
  const auto source = opened(folder_.write(
      "all.vtpd", blocks_of("vtkPartitionedDataSet",
                            data_set("", image("l.vti", {0, 0, 0}, 1, {2, 2, 2})) +
                                data_set("", image("r.vti", {3, 0, 0}, 1, {2, 2, 2})))));
  ASSERT_TRUE(source);
  const Volume volume = volume_of(*source, "a");
  ASSERT_EQ(volume.dims, (std::array<int, 3>{5, 2, 2}));
  EXPECT_TRUE(std::isnan(volume.values[2]));
  EXPECT_EQ(volume.values[3], static_cast<float>(linear({3, 0, 0})));
  EXPECT_THAT(all_notes(source->info()), HasSubstr("4 points of the whole extent are in no piece"));
}

TEST_F(VtkBlocks, WhereImagesOverlapTheFirstCounts) {
  for (const int x : {0, 1}) {
    VtkXml xml;
    const std::string values = xml.array("Float64", "a", 1, std::vector<double>(8, 5 + x));
    folder_.write(std::to_string(x) + ".vti",
                  xml.image({2, 2, 2}, "Origin=\"" + std::to_string(x) + " 0 0\"", values));
  }
  const auto source = opened(folder_.write(
      "all.vtm",
      blocks_of("vtkMultiBlockDataSet", data_set("first", "0.vti") + data_set("second", "1.vti"))));
  ASSERT_TRUE(source);
  const Volume volume = volume_of(*source, "a");
  ASSERT_EQ(volume.dims, (std::array<int, 3>{3, 2, 2}));
  for (std::size_t n = 0; n < 12; ++n) EXPECT_EQ(volume.values[n], n % 3 == 2 ? 6 : 5) << n;
}

TEST_F(VtkBlocks, OtherImagesAndMeshesBecomeOneMesh) {
  const std::string turned = "0 -1 0 1 0 0 0 0 1";
  const auto source = opened(folder_.write(
      "all.vtpc", blocks_of("vtkPartitionedDataSetCollection",
                            "<Partitions index=\"0\" name=\"coarse\">" +
                                data_set("", image("c.vti", {0, 0, 0}, 0.25, {5, 5, 5})) +
                                "</Partitions><Partitions index=\"1\" name=\"fine\">" +
                                data_set("", image("f.vti", {2, 0, 0}, 0.125, {9, 9, 9}, turned)) +
                                "</Partitions><Partitions index=\"2\" name=\"cells\">" +
                                data_set("", mesh("m.vtu", 2)) + "</Partitions><DataAssembly/>")));
  ASSERT_TRUE(source);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("3 blocks are shown as one mesh"));
  EXPECT_THAT(all_notes(source->info()), HasSubstr("960 cells"));  // 64 + 512 + 384
  EXPECT_EQ(source->info().grid.axes[0].coordinates.back(), 3);
  const Outcome got = compare(*source, linear);
  EXPECT_LT(got.worst, 1e-5);
  EXPECT_NEAR(got.inside, 1, 1e-9);
}

TEST_F(VtkBlocks, SurfacesAreLeftOutAndMissingFieldsMasked) {
  const auto source = opened(folder_.write(
      "all.vtm", blocks_of("vtkMultiBlockDataSet",
                           block("fluid", data_set("inner", mesh("a.vtu", 0)) +
                                              data_set("outer", mesh("b.vtu", 1, "b")) +
                                              "<DataSet index=\"7\"/>") +
                               block("patches", data_set("wall", surface("s.vtu")) +
                                                    data_set("lid", polygons("p.vtp"))))));
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  const std::string notes = all_notes(info);
  EXPECT_THAT(notes, HasSubstr("2 blocks are left out (surfaces, lines or unsupported data): "
                               "'patches/wall', 'patches/lid (PolyData)'"));
  EXPECT_THAT(notes, HasSubstr("'a' is missing in 1 of 2 blocks, where it is masked: "
                               "'fluid/outer'"));
  EXPECT_THAT(notes, HasSubstr("'b' is missing in 1 of 2 blocks"));
  EXPECT_EQ(info.find("shear"), nullptr);
  const Outcome got = compare(*source, linear);
  EXPECT_LT(got.worst, 1e-5);
  EXPECT_NEAR(got.volume, 1, 0.1);  // of two unit cubes, one has the field
}

TEST_F(VtkBlocks, NamesAfterTheFileChooseBlocks) {
  const std::string path = folder_.write(
      "all.vtm", blocks_of("vtkMultiBlockDataSet",
                           block("fluid", data_set("inner", mesh("a.vtu", 0)) +
                                              data_set("outer", mesh("b.vtu", 1))) +
                               data_set("solid", image("c.vti", {5, 0, 0}, 0.5, {3, 3, 3}))));
  const auto extent = [&](const std::string& chosen) {
    const auto source = opened(path + chosen);
    if (!source) return std::array<double, 2>{};
    const auto& axis = source->info().grid.axes[0].coordinates;
    return std::array<double, 2>{axis.front(), axis.back()};
  };
  EXPECT_EQ(extent(""), (std::array<double, 2>{0, 6}));
  EXPECT_EQ(extent("#/fluid"), (std::array<double, 2>{0, 2}));
  EXPECT_EQ(extent("#/fluid/outer"), (std::array<double, 2>{1, 2}));
  EXPECT_EQ(extent("#/solid"), (std::array<double, 2>{5, 6}));
  EXPECT_EQ(opened(path + "#/solid")->info().format, "VTK image data, a block");
  EXPECT_THAT(refusal(path + "#/flu"),
              HasSubstr("has no block 'flu'; its blocks: 'fluid/inner', 'fluid/outer', 'solid'"));
  EXPECT_THAT(refusal(folder_.path("c.vti") + "#/solid"), HasSubstr("without groups"));
}

// As written by foamToVTK: apostrophes, and the time after the blocks.
TEST_F(VtkBlocks, FilesOfBlocksFormSeriesWithTheirTimes) {
  mesh("a.vtu", 0);
  surface("s.vtu");
  for (const int step : {2, 10}) {
    folder_.write("case_" + std::to_string(step) + ".vtm",
                  "<?xml version='1.0'?>\n<VTKFile type='vtkMultiBlockDataSet' version='1.0' "
                  "byte_order='LittleEndian' header_type='UInt64'>\n<vtkMultiBlockDataSet>\n"
                  "<DataSet name='internal' file='a.vtu' />\n<Block name='boundary'>\n"
                  "<DataSet name='wall' file='s.vtu' />\n</Block>\n</vtkMultiBlockDataSet>\n"
                  "<FieldData>\n<DataArray type='Float32' Name='TimeValue' NumberOfTuples='1' "
                  "format='ascii'>\n" +
                      std::to_string(step * 0.25) + "\n</DataArray>\n</FieldData>\n</VTKFile>\n");
  }
  const auto source = opened(folder_.path("case_*.vtm"));
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[0].value, 0.5);
  EXPECT_EQ(source->info().steps[1].value, 2.5);
  EXPECT_EQ(volume_of(*source, "a", 1).range, volume_of(*source, "a", 0).range);
}

TEST_F(VtkBlocks, PartsOfATimestepAreUnited) {
  mesh("a.vtu", 0);
  mesh("b.vtu", 1);
  const auto listed = [](const std::string& file, const std::string& part) {
    return "<DataSet timestep=\"2\" part=\"" + part + "\" file=\"" + file + "\"/>";
  };
  const auto collection = [&](const std::string& sets) {
    return folder_.write(
        "all.pvd", "<VTKFile type=\"Collection\"><Collection>" + sets + "</Collection></VTKFile>");
  };
  const auto source = opened(collection(listed("a.vtu", "0") + listed("b.vtu", "1")));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps.size(), 1U);
  const Outcome got = compare(*source, linear);
  EXPECT_LT(got.worst, 1e-5);
  EXPECT_NEAR(got.volume, 2, 0.2);
  EXPECT_THAT(refusal(collection(listed("a.vtu", "0") + listed("a.vtu", "1"))),
              HasSubstr("names 'a.vtu' twice for a timestep"));
}

TEST_F(VtkBlocks, InvalidBlocksAreRefused) {
  const auto refused = [&](const std::string& inner) {
    return refusal(folder_.write("bad.vtm", blocks_of("vtkMultiBlockDataSet", inner)));
  };
  EXPECT_THAT(refused(""), HasSubstr("no block with a file"));
  EXPECT_THAT(refused(data_set("me", "bad.vtm")), HasSubstr("cannot be a block"));
  EXPECT_THAT(refused(data_set("up", "../a.vti")), HasSubstr("outside"));
  EXPECT_THAT(refused(data_set("root", "/etc/passwd")), HasSubstr("outside"));
  EXPECT_THAT(refused(data_set("gone", "gone.vti")), HasSubstr("'gone.vti', referred to by"));
  EXPECT_THAT(refused(data_set("flat", surface("s.vtu"))), HasSubstr("surface"));
  EXPECT_THAT(refused(data_set("poly", polygons("p.vtp"))),
              HasSubstr("no block with a grid that can be shown; 1 block is left out"));
  std::string deep = data_set("a", mesh("a.vtu", 0));
  for (int n = 0; n < 32; ++n) deep = block("b", deep);
  EXPECT_EQ(refused(deep), "");
  EXPECT_THAT(refused(block("b", deep)), HasSubstr("more than 32 deep"));
  EXPECT_THAT(refused(data_set(std::string(600, 'n'), "a.vtu")), HasSubstr("512 bytes"));
  EXPECT_THAT(refusal(folder_.write("h.vth", blocks_of("vtkOverlappingAMR", ""))),
              HasSubstr("'vtkOverlappingAMR'"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
