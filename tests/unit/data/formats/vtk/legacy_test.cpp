// Legacy VTK files, as text and as big-endian bytes, old and new lists of cells.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/vtk/vtk_maker.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const char* xml_name(const std::string& type) {
  if (type == "float") return "Float32";
  if (type == "double") return "Float64";
  if (type == "unsigned_char") return "UInt8";
  if (type == "vtktypeint64") return "Int64";
  return type == "short" ? "Int16" : "Int32";
}

// Text after a line that names a type.
std::string values(bool binary, const std::string& type, const std::vector<double>& numbers) {
  return (binary ? packed(xml_name(type), numbers, true) : VtkXml::text(numbers)) + "\n";
}

std::string head(bool binary) {
  return std::string("# vtk DataFile Version 4.2\nwind over a hill\n") +
         (binary ? "BINARY\n" : "ASCII\n");
}

std::vector<double> ramp(std::size_t count, double first = 0) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(first + static_cast<double>(i));
  return out;
}

class VtkLegacyFile : public testing::TestWithParam<bool> {
 protected:
  VtkFolder folder_;
};
INSTANTIATE_TEST_SUITE_P(TextAndBytes, VtkLegacyFile, testing::Bool());

// Nine bits fill two bytes; the following data are read after them. Old files call the spacing an
// aspect ratio.
TEST_P(VtkLegacyFile, BitsAreSkippedAndAnAspectRatioIsASpacing) {
  std::string file = head(GetParam()) + "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 1\n";
  file += "ASPECT_RATIO 2 3 1\nORIGIN 0 0 0\nPOINT_DATA 9\nSCALARS mask bit 1\n";
  file += "LOOKUP_TABLE default\n";
  file += GetParam() ? std::string("\xaa\x80\n") : "1 0 1 0 1 0 1 0 1\n";
  file += "VECTORS flow float\n" + values(GetParam(), "float", ramp(27, 5));
  const auto source = opened(folder_.write("b.vtk", file));
  ASSERT_TRUE(source);
  EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(0, 2, 4));
  EXPECT_THAT(source->info().grid.axes[1].coordinates, ElementsAre(0, 3, 6));
  EXPECT_THAT(reason_of(source->info(), "mask"), HasSubstr("bit"));
  const Volume flow = volume_of(*source, "flow");
  EXPECT_EQ(flow.component(0)[0], 5);
  EXPECT_EQ(flow.component(2)[8], 31);
}

TEST_P(VtkLegacyFile, ImageWithAttributesOfAllKinds) {
  std::string file = head(GetParam()) + "DATASET STRUCTURED_POINTS\nDIMENSIONS 4 3 2\n";
  file += "SPACING 1 2 3\nORIGIN 5 6 7\nFIELD FieldData 1\nTIME 1 1 double\n";
  file += values(GetParam(), "double", {2.5}) + "POINT_DATA 24\nSCALARS the%20count short 1\n";
  file += "LOOKUP_TABLE mine\n" + values(GetParam(), "short", ramp(24, -3));
  file += "LOOKUP_TABLE mine 2\n";
  file += GetParam() ? std::string(8, '\x0a') + "\n" : "0 0 0 1 1 1 1 1\n";
  file += "VECTORS flow float\n" + values(GetParam(), "float", ramp(72));
  file += "METADATA\nCOMPONENT_NAMES\nU\nV\nW%20up\n\n";
  file += "TENSORS stress float\n" + values(GetParam(), "float", ramp(216));
  file += "FIELD more 2\nheat 1 24 double\n" + values(GetParam(), "double", ramp(24, 0.5));
  file += "slip 2 24 float\n" + values(GetParam(), "float", ramp(48));
  const auto source = opened(folder_.write("a.vtk", file));
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.title, "wind over a hill");
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{4, 3, 2}));
  EXPECT_THAT(info.grid.axes[1].coordinates, ElementsAre(6, 8, 10));
  EXPECT_EQ(info.steps.front().value, 2.5);
  EXPECT_EQ(volume_of(*source, "the count").values[23], 20);
  EXPECT_EQ(volume_of(*source, "flow").component(2)[5], 17);
  EXPECT_THAT(info.find("flow")->components, ElementsAre("U", "V", "W up"));
  EXPECT_EQ(volume_of(*source, "heat").values[0], 0.5F);
  EXPECT_EQ(volume_of(*source, "slip").component(1)[23], 47);
  EXPECT_THAT(reason_of(info, "stress"), HasSubstr("9 components"));
}

TEST_P(VtkLegacyFile, RectilinearGridWithCellData) {
  std::string file = head(GetParam()) + "DATASET RECTILINEAR_GRID\nDIMENSIONS 3 4 2\n";
  file += "X_COORDINATES 3 float\n" + values(GetParam(), "float", {0, 2, 6});
  file += "Y_COORDINATES 4 double\n" + values(GetParam(), "double", {9, 4, 1, 0});
  file += "Z_COORDINATES 2 float\n" + values(GetParam(), "float", {0, 1});
  file +=
      "CELL_DATA 6\nSCALARS c float\nLOOKUP_TABLE default\n" + values(GetParam(), "float", ramp(6));
  const auto source = opened(folder_.write("a.vtk", file));
  ASSERT_TRUE(source);
  const auto& axes = source->info().grid.axes;
  EXPECT_THAT(axes[0].coordinates, ElementsAre(1, 4));
  EXPECT_THAT(axes[1].coordinates, ElementsAre(0.5, 2.5, 6.5));
  EXPECT_THAT(axes[2].coordinates, ElementsAre(0.5));
  const Volume volume = volume_of(*source, "c");
  EXPECT_EQ(volume.values[0], 4);
  EXPECT_EQ(volume.values[5], 1);
}

TEST_P(VtkLegacyFile, StructuredGridOnAxesIsNotResampled) {
  std::vector<double> points;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 4; ++i) {  // i runs against y, j along x
        points.insert(points.end(), {j * j * 1.0, 10.0 - i, k * 5.0});
      }
    }
  }
  std::string file = head(GetParam()) + "DATASET STRUCTURED_GRID\nDIMENSIONS 4 3 2\n";
  file += "POINTS 24 float\n" + values(GetParam(), "float", points);
  file += "POINT_DATA 24\nSCALARS a float\nLOOKUP_TABLE default\n" +
          values(GetParam(), "float", ramp(24));
  const auto source = opened(folder_.write("a.vtk", file));
  ASSERT_TRUE(source);
  EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(0, 1, 4));
  EXPECT_THAT(source->info().grid.axes[1].coordinates, ElementsAre(7, 8, 9, 10));
  const Volume volume = volume_of(*source, "a");
  for (std::size_t y = 0; y < 4; ++y) {
    for (std::size_t x = 0; x < 3; ++x) {
      EXPECT_EQ(volume.values[12 + y * 3 + x], static_cast<float>(12 + x * 4 + (3 - y)));
    }
  }
}

// A unit cube of one hexahedron, x + 2 y + 4 z at its corners.
std::string cube(bool binary, bool new_cells) {
  std::string file = head(binary) + "DATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n";
  file += values(binary, "double",
                 {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1});
  if (new_cells) {
    file += "CELLS 2 8\nOFFSETS vtktypeint64\n" + values(binary, "vtktypeint64", {0, 8});
    file += "CONNECTIVITY vtktypeint64\n" + values(binary, "vtktypeint64", ramp(8));
  } else {
    file += "CELLS 1 9\n" + values(binary, "int", {8, 0, 1, 2, 3, 4, 5, 6, 7});
  }
  file += "CELL_TYPES 1\n" + values(binary, "int", {12});
  file += "POINT_DATA 8\nSCALARS a float\nLOOKUP_TABLE default\n";
  return file + values(binary, "float", {0, 1, 3, 2, 4, 5, 7, 6});
}

TEST_P(VtkLegacyFile, CellsOfBothVersionsOfTheFormat) {
  for (const bool new_cells : {false, true}) {
    const auto source = opened(folder_.write("a.vtk", cube(GetParam(), new_cells)));
    ASSERT_TRUE(source);
    const auto& axes = source->info().grid.axes;
    const Volume volume = volume_of(*source, "a");
    ASSERT_EQ(volume.masked, 0);
    std::size_t s = 0;
    for (const double z : axes[2].coordinates) {
      for (const double y : axes[1].coordinates) {
        for (const double x : axes[0].coordinates) {
          ASSERT_NEAR(volume.values[s++], x + 2 * y + 4 * z, 1e-5);
        }
      }
    }
  }
}

TEST_P(VtkLegacyFile, EveryTruncationIsAnError) {
  const std::string whole = cube(GetParam(), true);
  for (std::size_t bytes = 30; bytes + 8 < whole.size(); bytes += 3) {
    EXPECT_NE(refusal(folder_.write("cut.vtk", whole.substr(0, bytes))), "") << bytes;
  }
}

TEST(VtkLegacy, PolyDataIsRefusedWithTheReason) {
  const VtkFolder folder;
  EXPECT_THAT(refusal(folder.write("a.vtk", head(false) + "DATASET POLYDATA\nPOINTS 0 float\n")),
              HasSubstr("'POLYDATA'"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
