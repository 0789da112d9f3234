// Truncated or inconsistent VTK files: each causes an error, and none makes the reader allocate
// memory for data that the file cannot contain.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include "server/data/open/open.hpp"
#include "tests/unit/data/formats/vtk/vtk_maker.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;

constexpr std::array<int, 3> broken_dims{6, 5, 4};

std::vector<double> waves() {
  std::vector<double> out;
  for (int i = 0; i < 360; ++i) out.push_back(std::sin(i * 0.1));
  return out;
}

std::string image(const VtkCoding& coding) {
  VtkXml xml(coding);
  const auto data = xml.array("Float32", "a", 3, waves());
  return xml.image(broken_dims, "", data);
}

TEST(VtkBroken, EveryTruncationIsAnError) {
  const VtkFolder folder;
  for (const char* format : {"ascii", "base64", "appended-raw", "appended-base64"}) {
    for (const char* compressor : {"", "ZLib", "LZ4"}) {
      const std::string whole = image({format, compressor, false, 4});
      ASSERT_EQ(refusal(folder.write("a.vti", whole)), "");
      // Appended data end before the closing tags, whose loss has no effect.
      const std::size_t end = whole.find("\n</AppendedData>");
      const std::size_t needed = end == std::string::npos ? whole.size() - 12 : end;
      for (std::size_t bytes = 100; bytes < needed; bytes += 100) {
        EXPECT_NE(refusal(folder.write("a.vti", whole.substr(0, bytes))), "")
            << format << compressor << " cut at " << bytes << " of " << whole.size();
      }
    }
  }
}

// Any changed byte causes an error or yields values, never a crash.
TEST(VtkBroken, AnyByteMayBeCorrupt) {
  const VtkFolder folder;
  for (const char* format : {"ascii", "appended-raw"}) {
    const std::string whole = image({format, "ZLib", false, 8});
    for (std::size_t at = 0; at < whole.size(); at += 31) {
      for (const char byte : {'\0', '\xff', '9', '<', '-'}) {
        std::string broken = whole;
        broken[at] = byte;
        auto source = open_file(folder.write("a.vti", broken));
        if (!source) continue;
        const auto volume = (*source)->read(0, 0);
        if (volume) {
          EXPECT_EQ(volume->values.size() % volume->samples(), 0U);
        }
      }
    }
  }
}

std::string claim(const std::string& extent, const std::string& array) {
  return VtkXml().file(
      "ImageData", "WholeExtent=\"" + extent + "\"",
      "<Piece Extent=\"" + extent + "\"><PointData>" + array + "</PointData></Piece>");
}

long peak_kilobytes() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

TEST(VtkBroken, HugeSizesAreRefusedBeforeAllocation) {
  const VtkFolder folder;
  const long before = peak_kilobytes();
  const std::string ascii =
      "<DataArray type=\"Float64\" Name=\"a\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3"
      "</DataArray>";
  EXPECT_THAT(refusal(folder.write("a.vti", claim("0 1023 0 1023 0 1023", ascii))),
              HasSubstr("more values than"));
  EXPECT_THAT(refusal(folder.write("a.vti", claim("0 999999999 0 999999999 0 9", ascii))),
              HasSubstr("limit of"));
  EXPECT_THAT(refusal(folder.write("a.vti", claim("5 1 0 1 0 1", ascii))), HasSubstr("empty"));
  EXPECT_THAT(refusal(folder.write(
                  "a.vti", claim("-9223372036854775808 9223372036854775807 0 1 0 1", ascii))),
              HasSubstr("2^31"));
  // A table that declares blocks much larger than its compressed bytes can produce.
  std::string table;
  for (const std::uint32_t n : {64U, 134217728U, 0U}) table += bytes_of_number(n, false);
  for (int b = 0; b < 64; ++b) table += bytes_of_number<std::uint32_t>(4, false);
  const std::string blocks = "<DataArray type=\"Float64\" Name=\"a\" format=\"binary\">" +
                             base64(table) + base64(std::string(256, 'x')) + "</DataArray>";
  std::string file = claim("0 1023 0 1023 0 1023", blocks);
  file.insert(file.find("header_type"), "compressor=\"vtkZLibDataCompressor\" ");
  EXPECT_THAT(refusal(folder.write("a.vti", file)), HasSubstr("cannot hold"));
  const std::string legacy = "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET ";
  EXPECT_THAT(
      refusal(folder.write("a.vtk", legacy + "UNSTRUCTURED_GRID\nPOINTS 999999999999 float\n")),
      HasSubstr("malformed"));
  EXPECT_THAT(
      refusal(folder.write("a.vtk", legacy + "STRUCTURED_POINTS\nDIMENSIONS 4000 4000 4000\n"
                                             "POINT_DATA 64000000000\nSCALARS a float\n")),
      HasSubstr("malformed"));
  EXPECT_LT(peak_kilobytes() - before, 64 * 1024);
}

// Eight points and their values; the declared extent is 301^3.
TEST(VtkBroken, PiecesThatCannotFillTheWholeAreRefusedBeforeAllocation) {
  const VtkFolder folder;
  const long before = peak_kilobytes();
  VtkXml xml;
  const std::string data =
      "<PointData>" + xml.array("Float32", "a", 1, {1, 2, 3, 4, 5, 6, 7, 8}) + "</PointData>";
  const std::string corners = xml.array(
      "Float32", "p", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1});
  std::string axes;
  for (const char* name : {"x", "y", "z"}) axes += xml.array("Float32", name, 1, {0, 1});
  const std::vector<std::pair<std::string, std::string>> kinds{
      {"ImageData", ""},
      {"RectilinearGrid", "<Coordinates>" + axes + "</Coordinates>"},
      {"StructuredGrid", "<Points>" + corners + "</Points>"}};
  for (const auto& [kind, geometry] : kinds) {
    const std::string piece = "<Piece Extent=\"0 1 0 1 0 1\">" + data + geometry + "</Piece>";
    const auto file = [&, kind = kind](const std::string& whole) {
      return refusal(folder.write("a.vtk", xml.file(kind, "WholeExtent=\"" + whole + "\"", piece)));
    };
    SCOPED_TRACE(kind);
    EXPECT_EQ(file("0 1 0 1 0 1"), "");
    const std::string message = file("0 300 0 300 0 300");
    EXPECT_THAT(message, HasSubstr("0 300 0 300 0 300 of 27270901 points"));
    EXPECT_THAT(message, HasSubstr("1 piece(s) with 8 points"));
    EXPECT_THAT(message, HasSubstr("the extent 0 1 0 1 0 1"));
    EXPECT_THAT(file("0 2 0 1 0 1"), HasSubstr("of 12 points"));
  }
  const std::string empty = "<Piece Extent=\"0 16777216 0 1 0 0\"/>";
  EXPECT_THAT(refusal(folder.write(
                  "a.vti", xml.file("ImageData", "WholeExtent=\"0 16777216 0 1 0 0\"", empty))),
              HasSubstr("with no array"));
  EXPECT_LT(peak_kilobytes() - before, 64 * 1024);
}

TEST(VtkBroken, OverlapOfPiecesIsBounded) {
  const VtkFolder folder;
  VtkXml xml;
  const std::string data = xml.array("Float32", "a", 1, {1, 2, 3, 4, 5, 6, 7, 8});
  const std::string piece =
      "<Piece Extent=\"0 1 0 1 0 1\"><PointData>" + data + "</PointData></Piece>";
  std::string pieces;
  for (int n = 0; n < 64; ++n) pieces += piece;
  const auto file = [&](const std::string& inner) {
    return refusal(
        folder.write("a.vti", xml.file("ImageData", "WholeExtent=\"0 1 0 1 0 1\"", inner)));
  };
  EXPECT_EQ(file(pieces), "");
  EXPECT_THAT(file(pieces + piece + piece), HasSubstr("overlap"));
}

TEST(VtkBroken, OffsetsMustBeInsideTheFile) {
  const VtkFolder folder;
  for (const char* offset : {"100000", "-5", "18446744073709551615", "x", ""}) {
    VtkXml xml({"appended-raw", "", false, 4});
    std::string file = xml.image(broken_dims, "", xml.array("Float32", "a", 3, waves()));
    const std::string told = "offset=\"0\"";
    file.replace(file.find(told), told.size(), std::string("offset=\"") + offset + "\"");
    EXPECT_THAT(refusal(folder.write("a.vti", file)), HasSubstr("'a'")) << offset;
  }
}

TEST(VtkBroken, DeepAndWideDocumentsAreBounded) {
  const VtkFolder folder;
  std::string deep = "<VTKFile type=\"ImageData\">";
  for (int i = 0; i < 1'100'000; ++i) deep += "<a>";
  EXPECT_THAT(refusal(folder.write("a.vti", deep)), HasSubstr("elements"));
  std::string nested = "<VTKFile type=\"ImageData\">";
  for (int i = 0; i < 100'000; ++i) nested += "<a>";
  EXPECT_NE(refusal(folder.write("a.vti", nested)), "");
}

}  // namespace
}  // namespace windsplat::data::vtk_test
