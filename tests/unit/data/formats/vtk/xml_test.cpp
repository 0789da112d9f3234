// VTK XML grids: every encoding of numbers, extents, pieces, ghosts, directions, cells.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/vtk/vtk_maker.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::array<int, 3> xml_dims{5, 4, 3};
constexpr std::size_t samples = 60;

std::vector<double> even_ramp(std::size_t count, double first = 1, double step = 1) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(first + step * static_cast<double>(i));
  return out;
}

std::vector<VtkCoding> all_codings() {
  std::vector<VtkCoding> out;
  for (const char* format : {"ascii", "base64", "appended-raw", "appended-base64"}) {
    for (const char* compressor : {"", "ZLib", "LZ4"}) {
      for (const bool big : {false, true}) {
        for (const int header : {4, 8}) out.push_back({format, compressor, big, header});
      }
    }
  }
  return out;
}

TEST(VtkXmlFile, ValuesAreTheSameInEveryEncoding) {
  const VtkFolder folder;
  const std::vector<std::string> types{"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                       "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  for (const VtkCoding& coding : all_codings()) {
    SCOPED_TRACE(coding.format + " " + coding.compressor + (coding.big ? " big " : " little ") +
                 std::to_string(coding.header_bytes));
    VtkXml xml(coding);
    std::string data;
    for (const std::string& type : types) data += xml.array(type, type, 1, even_ramp(samples));
    data += xml.array("Int16", "below", 1, even_ramp(samples, -30));
    data += xml.array("Float32", "flow", 3, even_ramp(3 * samples, -1.5, 0.25));
    const auto source =
        opened(folder.write("a.vti", xml.image(xml_dims, "Origin=\"0 0 0\"", data)));
    ASSERT_TRUE(source);
    EXPECT_EQ(source->info().grid.dims(), xml_dims);
    for (const std::string& type : types) {
      const Volume volume = volume_of(*source, type);
      for (std::size_t i = 0; i < samples; ++i) {
        ASSERT_EQ(volume.values[i], static_cast<float>(i + 1)) << type;
      }
    }
    EXPECT_EQ(volume_of(*source, "below").values[0], -30);
    const Volume flow = volume_of(*source, "flow");
    ASSERT_EQ(flow.components, 3);
    for (std::size_t i = 0; i < samples; ++i) {
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(flow.component(c)[i], -1.5F + 0.25F * (3.0F * static_cast<float>(i) + c));
      }
    }
  }
}

// Some writers pad the base64 of the header separately, even without a compressor.
TEST(VtkXmlFile, SeparatelyEncodedHeaderIsRead) {
  const VtkFolder folder;
  const std::string bytes = packed("Float32", even_ramp(samples), false);
  const std::string data = "<DataArray type=\"Float32\" Name=\"a\" format=\"binary\">" +
                           base64(bytes_of_number<std::uint32_t>(240, false)) + base64(bytes) +
                           "</DataArray>";
  const auto source = opened(folder.write("a.vti", VtkXml().image(xml_dims, "", data)));
  ASSERT_TRUE(source);
  EXPECT_EQ(volume_of(*source, "a").values[59], 60);
}

TEST(VtkXmlFile, OriginSpacingAndExtentPlaceTheSamples) {
  const VtkFolder folder;
  VtkXml xml;
  const auto source = opened(folder.write(
      "a.vti",
      xml.file("ImageData", "WholeExtent=\"2 6 -1 2 0 2\" Origin=\"10 20 30\" Spacing=\"0.5 -2 4\"",
               "<Piece Extent=\"2 6 -1 2 0 2\"><PointData>" +
                   xml.array("Float64", "a", 1, even_ramp(samples)) + "</PointData></Piece>")));
  ASSERT_TRUE(source);
  const auto& axes = source->info().grid.axes;
  EXPECT_THAT(axes[0].coordinates, ElementsAre(11, 11.5, 12, 12.5, 13));
  // 20 - 2 * {-1 .. 2}, reversed to ascend.
  EXPECT_THAT(axes[1].coordinates, ElementsAre(16, 18, 20, 22));
  EXPECT_THAT(axes[2].coordinates, ElementsAre(30, 34, 38));
  const Volume volume = volume_of(*source, "a");
  EXPECT_EQ(volume.values[0], 16);  // j = 3 is lowest
  EXPECT_EQ(volume.values[15], 1);
}

// i runs along y, j against x, k along z: world = origin + direction * (spacing * index).
TEST(VtkXmlFile, DirectionMayPermuteAndReverseAxes) {
  const VtkFolder folder;
  VtkXml xml;
  const auto source = opened(folder.write(
      "a.vti", xml.image(xml_dims, "Spacing=\"1 10 100\" Direction=\"0 -1 0 1 0 0 0 0 1\"",
                         xml.array("Float64", "a", 1, even_ramp(samples, 0)))));
  ASSERT_TRUE(source);
  const auto& axes = source->info().grid.axes;
  EXPECT_THAT(axes[0].coordinates, ElementsAre(-30, -20, -10, 0));
  EXPECT_THAT(axes[1].coordinates, ElementsAre(0, 1, 2, 3, 4));
  const Volume volume = volume_of(*source, "a");
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 4; ++x) {
        const auto at = static_cast<std::size_t>((z * 5 + y) * 4 + x);
        ASSERT_EQ(volume.values[at], static_cast<float>((z * 4 + (3 - x)) * 5 + y));
      }
    }
  }
  const std::string slanted = "Direction=\"0.8 -0.6 0 0.6 0.8 0 0 0 1\"";
  EXPECT_THAT(
      refusal(folder.write(
          "b.vti", xml.image(xml_dims, slanted, xml.array("Float64", "a", 1, even_ramp(60))))),
      HasSubstr("Direction"));
}

TEST(VtkXmlFile, RectilinearGridKeepsUnevenAndReversesDescendingAxes) {
  const VtkFolder folder;
  VtkXml xml({"appended-raw", "ZLib", true, 8});
  std::string inner = "<Piece Extent=\"0 4 0 3 0 2\"><PointData>";
  inner += xml.array("Float32", "a", 1, even_ramp(samples, 0)) + "</PointData><Coordinates>";
  inner +=
      xml.array("Float64", "x", 1, {0, 1, 4, 9, 16}) + xml.array("Float64", "y", 1, {0, 1, 2, 5});
  inner += xml.array("Float32", "z", 1, {3, 2, -1}) + "</Coordinates></Piece>";
  const auto source = opened(
      folder.write("a.vtr", xml.file("RectilinearGrid", "WholeExtent=\"0 4 0 3 0 2\"", inner)));
  ASSERT_TRUE(source);
  EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(0, 1, 4, 9, 16));
  EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(-1, 2, 3));
  EXPECT_EQ(volume_of(*source, "a").values[0], 40);
  EXPECT_EQ(volume_of(*source, "a").values[40], 0);
}

TEST(VtkXmlFile, PiecesAreAssembledAndGapsMasked) {
  const VtkFolder folder;
  VtkXml xml({"appended-base64", "LZ4", false, 4});
  const auto piece = [&](int first, int last, double value) {
    const std::string extent = std::to_string(first) + " " + std::to_string(last) + " 0 1 0 1";
    const auto count = static_cast<std::size_t>(4 * (last - first + 1));
    return "<Piece Extent=\"" + extent + "\"><PointData>" +
           xml.array("Float32", "a", 1, std::vector<double>(count, value)) + "</PointData></Piece>";
  };
  const auto source =
      opened(folder.write("a.vti", xml.file("ImageData", "WholeExtent=\"0 5 0 1 0 1\"",
                                            piece(0, 1, 7) + piece(2, 3, 8) + piece(2, 4, 8))));
  ASSERT_TRUE(source);
  const Volume volume = volume_of(*source, "a");
  for (std::size_t row = 0; row < 4; ++row) {
    EXPECT_EQ(volume.values[row * 6 + 1], 7);
    EXPECT_EQ(volume.values[row * 6 + 4], 8);
    EXPECT_TRUE(std::isnan(volume.values[row * 6 + 5]));
  }
  EXPECT_EQ(volume.masked, 4);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("4 points of the whole extent are in no piece"));
}

// Pieces of 0..2 and 3..4 along x contain all points together, but not the cells from 2 to 3.
TEST(VtkXmlFile, CellsBetweenPiecesAreMaskedAndNoted) {
  const VtkFolder folder;
  for (const bool of_cells : {false, true}) {
    VtkXml xml;
    std::string pieces;
    for (const auto& [first, last] : {std::pair(0, 2), std::pair(3, 4)}) {
      const int count = of_cells ? (last - first) * 2 : (last - first + 1) * 3 * 2;
      const std::string where = of_cells ? "CellData" : "PointData";
      pieces += "<Piece Extent=\"" + std::to_string(first) + " " + std::to_string(last);
      pieces += " 0 2 0 1\"><" + where + ">";
      pieces +=
          xml.array("Float32", "a", 1, std::vector<double>(static_cast<std::size_t>(count), 1));
      pieces += "</" + where + "></Piece>";
    }
    const auto source =
        opened(folder.write("a.vti", xml.file("ImageData", "WholeExtent=\"0 4 0 2 0 1\"", pieces)));
    ASSERT_TRUE(source);
    EXPECT_EQ(volume_of(*source, "a").masked, of_cells ? 2 : 0);
    if (of_cells) {
      EXPECT_THAT(all_notes(source->info()), HasSubstr("2 cells of the whole extent"));
    } else {
      EXPECT_EQ(all_notes(source->info()), "");
    }
  }
}

// x descends: the first piece is in the east. Values are 10 times the world x, plus y.
TEST(VtkXmlFile, PiecesAlongADescendingAxisKeepTheirPositions) {
  const VtkFolder folder;
  VtkXml xml;
  const auto piece = [&](int first, const std::vector<double>& x) {
    const std::string extent =
        std::to_string(first) + " " + std::to_string(first + static_cast<int>(x.size()) - 1);
    std::vector<double> values;
    for (const double y : {0, 1}) {
      for (const double at : x) values.push_back(10 * at + y);
    }
    return "<Piece Extent=\"" + extent + " 0 1 0 0\"><PointData>" +
           xml.array("Float64", "a", 1, values) + "</PointData><Coordinates>" +
           xml.array("Float64", "x", 1, x) + xml.array("Float64", "y", 1, {0, 1}) +
           xml.array("Float64", "z", 1, {0}) + "</Coordinates></Piece>";
  };
  const auto source =
      opened(folder.write("a.vtr", xml.file("RectilinearGrid", "WholeExtent=\"0 4 0 1 0 0\"",
                                            piece(0, {16, 9}) + piece(2, {4, 1, 0}))));
  ASSERT_TRUE(source);
  EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(0, 1, 4, 9, 16));
  const Volume volume = volume_of(*source, "a");
  const std::vector<float> values(volume.values.data(), volume.values.data() + 10);
  EXPECT_THAT(values, ElementsAre(0, 10, 40, 90, 160, 1, 11, 41, 91, 161));
}

TEST(VtkXmlFile, HiddenPointsAndNanAreMasked) {
  const VtkFolder folder;
  VtkXml xml({"base64", "", false, 4});
  std::vector<double> values = even_ramp(samples);
  values[7] = std::nan("");
  std::vector<double> ghosts(samples, 0);
  ghosts[9] = 2;   // hidden
  ghosts[11] = 1;  // a duplicate with the same value as the original
  const auto source =
      opened(folder.write("a.vti", xml.image(xml_dims, "",
                                             xml.array("Float64", "a", 1, values) +
                                                 xml.array("UInt8", "vtkGhostType", 1, ghosts))));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().fields.size(), 1U);
  const Volume volume = volume_of(*source, "a");
  EXPECT_EQ(volume.masked, 2);
  EXPECT_TRUE(std::isnan(volume.values[7]) && std::isnan(volume.values[9]));
  EXPECT_EQ(volume.values[11], 12);
}

TEST(VtkXmlFile, CellCentersAreUsedWhereTheyHaveMoreFields) {
  const VtkFolder folder;
  VtkXml xml;
  const auto source =
      opened(folder.write("a.vti", xml.image(xml_dims, "Spacing=\"1 2 4\"",
                                             xml.array("Float32", "p", 1, even_ramp(samples)),
                                             xml.array("Float32", "c", 1, even_ramp(24)) +
                                                 xml.array("Float32", "d", 2, even_ramp(48)))));
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{4, 3, 2}));
  EXPECT_THAT(info.grid.axes[0].coordinates, ElementsAre(0.5, 1.5, 2.5, 3.5));
  EXPECT_THAT(info.grid.axes[2].coordinates, ElementsAre(2, 6));
  EXPECT_EQ(volume_of(*source, "c").values[23], 24);
  EXPECT_EQ(volume_of(*source, "d").components, 2);
  EXPECT_EQ(volume_of(*source, "d").component(1)[0], 2);
  EXPECT_THAT(reason_of(info, "p"), HasSubstr("at points"));
}

TEST(VtkXmlFile, UnsupportedArraysAreOmittedWithTheReason) {
  const VtkFolder folder;
  VtkXml xml;
  std::string data = xml.array("Float32", "stress", 6, even_ramp(6 * samples));
  data += xml.array("Float32", "flow", 3, even_ramp(3 * samples),
                    "ComponentName0=\"U\" ComponentName1=\"V\" ComponentName2=\"W\"");
  data += "<Array type=\"String\" Name=\"words\" format=\"ascii\">1 2</Array>";
  const auto source = opened(folder.write("a.vti", xml.image(xml_dims, "", data)));
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  ASSERT_EQ(info.fields.size(), 2U);
  EXPECT_EQ(info.fields[1].name, "flow_magnitude");  // derived
  EXPECT_EQ(info.fields[0].kind, FieldKind::vector);
  EXPECT_THAT(info.fields[0].components, ElementsAre("U", "V", "W"));
  EXPECT_THAT(reason_of(info, "stress"), HasSubstr("6 components"));
  EXPECT_THAT(reason_of(info, "words"), HasSubstr("String"));
}

TEST(VtkXmlFile, LzmaAndUnsupportedDataSetsAreRefusedWithTheReason) {
  const VtkFolder folder;
  EXPECT_THAT(
      refusal(folder.write("a.vti", VtkXml({"ascii", "LZMA", false, 4}).image(xml_dims, "", ""))),
      HasSubstr("vtkLZMADataCompressor"));
  EXPECT_THAT(refusal(folder.write("a.vtp", VtkXml().file("PolyData", "", ""))),
              HasSubstr("'PolyData'"));
}

// Numbers beyond the range of double are data: infinite with their sign, or 0.
TEST(VtkXmlFile, TextBeyondTheNumericRangeIsMaskedOrZero) {
  const VtkFolder folder;
  VtkXml xml;
  std::string data = xml.array("Float64", "a", 1, {11, 22, 33, 44});
  data.replace(data.find("11"), 2, "1e999");
  data.replace(data.find("22"), 2, "-1e999");
  data.replace(data.find("33"), 2, "-1e-999");
  const auto source = opened(folder.write("a.vti", xml.image({2, 2, 1}, "", data)));
  ASSERT_TRUE(source);
  const Volume volume = volume_of(*source, "a");
  EXPECT_EQ(volume.masked, 2);
  EXPECT_EQ(volume.values[2], 0);
  EXPECT_EQ(volume.values[3], 44);
  data.replace(data.find("44"), 2, "4x");
  EXPECT_THAT(refusal(folder.write("a.vti", xml.image({2, 2, 1}, "", data))), HasSubstr("'4x'"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
