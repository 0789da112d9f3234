// Parallel headers (.pvti .pvtr .pvts .pvtu) and their pieces.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/vtk/test_mesh.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;
using Box = std::array<int, 6>;

std::string extent_text(const Box& box) {
  std::string out;
  for (const int n : box) out += (out.empty() ? "" : " ") + std::to_string(n);
  return out;
}

// A header whose pieces are files with extents, or without for an unstructured grid.
struct Header {
  std::string kind = "ImageData";
  std::string attributes;
  std::string declared =
      "<PPointData><PDataArray type=\"Float64\" Name=\"a\" NumberOfComponents=\"1\"/></PPointData>";
  std::string pieces;

  void piece(const std::string& source, const Box* extent = nullptr) {
    pieces += "<Piece Source=\"" + source + "\"";
    if (extent != nullptr) pieces += " Extent=\"" + extent_text(*extent) + "\"";
    pieces += "/>";
  }
  [[nodiscard]] std::string text() const {
    const VtkXml xml({"ascii", "", true, 8});
    return xml.file("P" + kind, attributes, declared + pieces);
  }
};

// The points of a box of a lattice with the given places of indices, in the order of files.
std::vector<Place> places_of(const Box& box, const Map& map) {
  std::vector<Place> out;
  for (int k = box[4]; k <= box[5]; ++k) {
    for (int j = box[2]; j <= box[3]; ++j) {
      for (int i = box[0]; i <= box[1]; ++i) out.push_back(map({i * 1.0, j * 1.0, k * 1.0}));
    }
  }
  return out;
}

std::vector<double> values_at(const std::vector<Place>& places, const Function& f) {
  std::vector<double> out;
  for (const Place& place : places) out.push_back(f(place));
  return out;
}

// The whole 0..8 x 0..6 x 0..4, and its parts: two along x, two along y of the second.
constexpr Box whole_box{0, 8, 0, 6, 0, 4};
constexpr std::array<Box, 3> parts{{{0, 3, 0, 6, 0, 4}, {3, 8, 0, 2, 0, 4}, {3, 8, 2, 6, 0, 4}}};
// Each piece has its own encoding, byte order and width of headers.
const std::array<VtkCoding, 3> codings{
    {{"appended-raw", "ZLib", true, 8}, {"base64", "", false, 4}, {"ascii", "", false, 8}}};

Place image_place(const Place& index) {
  return {10 + 0.5 * index[0], -3 + 2 * index[1], 0.25 * index[2]};
}
Place stretched(const Place& index) {
  return {index[0] * index[0], index[1] + 0.1 * index[1] * index[1], -index[2]};
}

class VtkParallel : public testing::Test {
 protected:
  // Writes a piece of a lattice and returns its name.
  std::string write_piece(const std::string& kind, const Box& box, const VtkCoding& coding,
                          const Map& map, const std::string& name,
                          const std::string& more_data = "") {
    VtkXml xml(coding);
    const auto places = places_of(box, map);
    std::string inner = "<Piece Extent=\"" + extent_text(box) + "\"><PointData>" +
                        xml.array("Float64", "a", 1, values_at(places, linear)) + more_data +
                        "</PointData>";
    if (kind == "StructuredGrid") {
      std::vector<double> points;
      for (const Place& p : places) points.insert(points.end(), p.begin(), p.end());
      inner += "<Points>" + xml.array("Float64", "Points", 3, points) + "</Points>";
    } else if (kind == "RectilinearGrid") {
      inner += "<Coordinates>";
      for (std::size_t a = 0; a < 3; ++a) {
        std::vector<double> axis;
        for (int i = box.at(2 * a); i <= box.at(2 * a + 1); ++i) {
          Place index{0, 0, 0};
          index.at(a) = i;
          axis.push_back(map(index).at(a));
        }
        inner += xml.array("Float64", std::string(1, "xyz"[a]), 1, axis);
      }
      inner += "</Coordinates>";
    }
    const std::string placed =
        kind == "ImageData" ? " Origin=\"10 -3 0\" Spacing=\"0.5 2 0.25\"" : "";
    folder_.write(name, xml.file(kind, "WholeExtent=\"" + extent_text(box) + "\"" + placed,
                                 inner + "</Piece>"));
    return name;
  }

  // A header of all parts; returns its path.
  std::string write_all(const std::string& kind, const std::string& ending, const Map& map) {
    Header header;
    header.kind = kind;
    header.attributes = "WholeExtent=\"" + extent_text(whole_box) + "\" GhostLevel=\"0\"";
    if (kind == "ImageData") header.attributes += " Origin=\"10 -3 0\" Spacing=\"0.5 2 0.25\"";
    std::filesystem::create_directory(folder_.path("parts"));
    for (std::size_t n = 0; n < parts.size(); ++n) {
      const std::string name = "parts/p" + std::to_string(n) + "." + ending;
      header.piece(write_piece(kind, parts.at(n), codings.at(n), map, name), &parts.at(n));
    }
    return folder_.write("all.p" + ending, header.text());
  }

  VtkFolder folder_;
};

// The exact linear field at every sample, on the axes of the whole.
void expect_linear(Source& source, double tolerance) {
  const Outcome got = compare(source, linear);
  EXPECT_NEAR(got.inside, 1, 1e-12);
  EXPECT_LT(got.worst, tolerance);
}

TEST_F(VtkParallel, PiecesOfImagesFormTheWholeExtent) {
  const auto source = opened(write_all("ImageData", "vti", image_place));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().format, "VTK image data, parallel");
  EXPECT_EQ(source->info().grid.dims(), (std::array<int, 3>{9, 7, 5}));
  EXPECT_EQ(source->info().grid.axes[0].coordinates.front(), 10);
  EXPECT_EQ(source->info().grid.axes[1].coordinates.back(), 9);
  expect_linear(*source, 1e-5);
}

TEST_F(VtkParallel, PiecesOfRectilinearGridsFormTheWholeExtent) {
  const auto source = opened(write_all("RectilinearGrid", "vtr", stretched));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.axes[0].coordinates,
            (std::vector<double>{0, 1, 4, 9, 16, 25, 36, 49, 64}));
  EXPECT_EQ(source->info().grid.axes[2].coordinates.front(), -4);
  expect_linear(*source, 2e-5);
}

// The same samples as those of one file with the whole extent.
TEST_F(VtkParallel, PiecesOfStructuredGridsFormTheWholeExtent) {
  const Map sheared = [](const Place& index) {
    return Place{index[0] + 0.2 * index[2], index[1], index[2]};
  };
  const auto source = opened(write_all("StructuredGrid", "vts", sheared));
  write_piece("StructuredGrid", whole_box, {}, sheared, "whole.vts");
  const auto whole = opened(folder_.path("whole.vts"));
  ASSERT_TRUE(source && whole);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("resampled from 315 points and 192 cells"));
  EXPECT_EQ(all_notes(source->info()), all_notes(whole->info()));
  EXPECT_LT(compare(*source, linear).worst, 1e-5);
  const Volume here = volume_of(*source, "a");
  const Volume there = volume_of(*whole, "a");
  ASSERT_EQ(here.dims, there.dims);
  std::size_t inside = 0;
  for (std::size_t n = 0; n < here.samples(); ++n) {
    const bool masked = std::isnan(there.values[n]);
    inside += masked ? 0 : 1;
    ASSERT_TRUE(masked ? std::isnan(here.values[n]) : here.values[n] == there.values[n]) << n;
  }
  EXPECT_GT(inside, here.samples() / 2);
}

TEST_F(VtkParallel, PiecesOfMeshesAreSeamless) {
  Header header;
  header.kind = "UnstructuredGrid";
  for (int n = 0; n < 3; ++n) {
    const TestMesh mesh = boxes(
        3,
        [n](const Place& p) {
          return Place{p[0] + n, p[1], p[2] + 0.1 * (p[0] + n)};
        },
        n == 1 ? as_tetrahedra : as_hexahedron);
    VtkXml xml(codings.at(static_cast<std::size_t>(n)));
    const auto data = xml.array("Float64", "a", 1, at_points(mesh, linear));
    const std::string name = "p" + std::to_string(n) + ".vtu";
    folder_.write(name, vtu(mesh, data, "", xml));
    header.piece(name);
  }
  folder_.write("empty.vtu", VtkXml().file("UnstructuredGrid", "",
                                           "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>"));
  header.piece("empty.vtu");
  const auto source = opened(folder_.write("all.pvtu", header.text()));
  ASSERT_TRUE(source);
  const Outcome got = compare(*source, linear);
  EXPECT_LT(got.worst, 1e-5);
  EXPECT_NEAR(got.volume, 3, 0.15);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("216 cells"));
  // No sample at the boundary of pieces is masked: those on the central plane are all inside.
  const auto& axes = source->info().grid.axes;
  const Volume volume = volume_of(*source, "a");
  const std::size_t k = axes[2].coordinates.size() / 2;
  const std::size_t j = axes[1].coordinates.size() / 2;
  for (std::size_t i = 0; i < axes[0].coordinates.size(); ++i) {
    const std::size_t at = i + axes[0].coordinates.size() * (j + axes[1].coordinates.size() * k);
    EXPECT_FALSE(std::isnan(volume.values[at])) << axes[0].coordinates[i];
  }
}

// Both pieces have the cell between 1 and 2; that of the other piece is marked and has wrong
// values, which must not be shown.
TEST_F(VtkParallel, GhostCellsCountOnce) {
  Header header;
  header.kind = "UnstructuredGrid";
  header.declared =
      "<PCellData><PDataArray type=\"Float64\" Name=\"a\"/>"
      "<PDataArray type=\"UInt8\" Name=\"vtkGhostType\"/></PCellData>";
  for (int n = 0; n < 2; ++n) {
    const TestMesh mesh = boxes(
        2,
        [n](const Place& p) {
          return Place{2 * p[0] + n, 2 * p[1], 2 * p[2]};
        },
        as_hexahedron);
    std::vector<double> values;
    std::vector<double> ghosts;
    for (int c = 0; c < 8; ++c) {
      const bool ghost = n == 0 && c % 2 == 1;
      values.push_back(ghost ? 99 : n * 2 + c % 2);
      ghosts.push_back(ghost ? 1 : 0);
    }
    VtkXml xml;
    const auto data =
        xml.array("Float64", "a", 1, values) + xml.array("UInt8", "vtkGhostType", 1, ghosts);
    const std::string name = "g" + std::to_string(n) + ".vtu";
    folder_.write(name, vtu(mesh, "", data, xml));
    header.piece(name);
  }
  const auto source = opened(folder_.write("all.pvtu", header.text()));
  ASSERT_TRUE(source);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("12 cells onto"));
  const Outcome got = compare(*source, [](const Place& p) {
    if (p[0] < 1 - 1e-6) return 0.0;
    return p[0] < 2 - 1e-6 ? 2.0 : 3.0;
  });
  EXPECT_NEAR(got.inside, 1, 1e-9);
  // Samples on a shared face belong to either cell.
  const Volume volume = volume_of(*source, "a");
  EXPECT_LT(*std::max_element(volume.values.begin(), volume.values.end()), 4);
  // A piece alone shows its ghost cells, since it has no other.
  EXPECT_EQ(volume_of(*opened(folder_.path("g0.vtu")), "a").range[1], 99);
}

TEST_F(VtkParallel, GhostPointsYieldToTheirOwner) {
  for (const bool owner_first : {false, true}) {
    Header header;
    header.attributes = "WholeExtent=\"0 4 0 1 0 1\" GhostLevel=\"1\"";
    header.declared =
        "<PPointData><PDataArray type=\"Float64\" Name=\"a\"/>"
        "<PDataArray type=\"UInt8\" Name=\"vtkGhostType\"/></PPointData>";
    const std::array<Box, 2> boxes{{{0, 3, 0, 1, 0, 1}, {2, 4, 0, 1, 0, 1}}};
    for (std::size_t n = 0; n < 2; ++n) {
      std::vector<double> values;
      std::vector<double> ghosts;
      for (const Place& p : places_of(boxes.at(n), [](const Place& at) { return at; })) {
        const bool ghost = n == 0 && p[0] == 3;
        values.push_back(ghost ? 99 : p[0]);
        ghosts.push_back(ghost ? 1 : 0);
      }
      VtkXml xml;
      const std::string text = extent_text(boxes.at(n));
      folder_.write(
          "g" + std::to_string(n) + ".vti",
          xml.file("ImageData", "WholeExtent=\"" + text + "\"",
                   "<Piece Extent=\"" + text + "\"><PointData>" +
                       xml.array("Float64", "a", 1, values) +
                       xml.array("UInt8", "vtkGhostType", 1, ghosts) + "</PointData></Piece>"));
    }
    for (const std::size_t n : {owner_first ? 1U : 0U, owner_first ? 0U : 1U}) {
      header.piece("g" + std::to_string(n) + ".vti", &boxes.at(n));
    }
    const auto source = opened(folder_.write("all.pvti", header.text()));
    ASSERT_TRUE(source);
    const Volume volume = volume_of(*source, "a");
    for (std::size_t n = 0; n < 20; ++n) {
      EXPECT_EQ(volume.values[n], static_cast<float>(n % 5)) << n;
    }
  }
}

TEST_F(VtkParallel, OverlapsWithoutMarksMustAgree) {
  const std::array<Box, 2> boxes{{{0, 3, 0, 1, 0, 1}, {2, 4, 0, 1, 0, 1}}};
  // Of the second piece relative to the first; copies computed twice differ by rounding.
  for (const double difference : {0.0, 1e-5, 0.5}) {
    Header header;
    header.attributes = "WholeExtent=\"0 4 0 1 0 1\" GhostLevel=\"4\"";
    for (std::size_t n = 0; n < 2; ++n) {
      std::vector<double> values;
      for (const Place& p : places_of(boxes.at(n), [](const Place& at) { return at; })) {
        values.push_back(p[0] + static_cast<double>(n) * difference);
      }
      VtkXml xml;
      const std::string text = extent_text(boxes.at(n));
      const std::string name = "o" + std::to_string(n) + ".vti";
      folder_.write(name,
                    xml.file("ImageData", "WholeExtent=\"" + text + "\"",
                             "<Piece Extent=\"" + text + "\"><PointData>" +
                                 xml.array("Float64", "a", 1, values) + "</PointData></Piece>"));
      header.piece(name, &boxes.at(n));
    }
    const auto source = opened(folder_.write("all.pvti", header.text()));
    ASSERT_TRUE(source);
    const auto volume = source->read(0, 0);
    EXPECT_EQ(volume.has_value(), difference < 0.1) << difference;
    if (!volume) {
      EXPECT_THAT(volume.error().message,
                  HasSubstr("pieces that overlap with different values of 'a' (by up to 0.5)"));
    }
  }
}

// vtkProcessId; but integers that vary within a piece must agree.
TEST_F(VtkParallel, OverlappingPiecesMayNumberThemselves) {
  const std::array<Box, 2> boxes{{{0, 3, 0, 1, 0, 1}, {2, 4, 0, 1, 0, 1}}};
  for (const bool varies : {false, true}) {
    Header header;
    header.attributes = "WholeExtent=\"0 4 0 1 0 1\" GhostLevel=\"4\"";
    header.declared = "<PPointData><PDataArray type=\"Int32\" Name=\"a\"/></PPointData>";
    for (std::size_t n = 0; n < 2; ++n) {
      std::vector<double> ranks(places_of(boxes.at(n), image_place).size(),
                                static_cast<double>(n + 3));
      if (varies) ranks.front() = 7;
      VtkXml xml;
      const std::string text = extent_text(boxes.at(n));
      const std::string name = "r" + std::to_string(n) + ".vti";
      folder_.write(name, xml.file("ImageData", "WholeExtent=\"" + text + "\"",
                                   "<Piece Extent=\"" + text + "\"><PointData>" +
                                       xml.array("Int32", "a", 1, ranks) + "</PointData></Piece>"));
      header.piece(name, &boxes.at(n));
    }
    const auto source = opened(folder_.write("all.pvti", header.text()));
    ASSERT_TRUE(source);
    const auto volume = source->read(0, 0);
    EXPECT_EQ(volume.has_value(), !varies);
    if (volume) {
      EXPECT_EQ(volume->values[0], 3);
      EXPECT_EQ(volume->values[4], 4);
    }
  }
}

TEST_F(VtkParallel, ArraysMustBeDeclaredAndAgree) {
  Header header;
  header.attributes = "WholeExtent=\"0 8 0 6 0 4\" Origin=\"10 -3 0\" Spacing=\"0.5 2 0.25\"";
  header.declared =
      "<PPointData><PDataArray type=\"Float64\" Name=\"a\"/>"
      "<PDataArray type=\"Float32\" Name=\"b\"/>"
      "<PDataArray type=\"Float64\" Name=\"c\" NumberOfComponents=\"3\"/>"
      "<PDataArray type=\"Float64\" Name=\"d\"/></PPointData>";
  for (std::size_t n = 0; n < parts.size(); ++n) {
    VtkXml xml;
    const std::vector<double> ones(places_of(parts.at(n), image_place).size(), 1);
    std::string more = xml.array("Float64", "b", 1, ones) + xml.array("Float64", "c", 1, ones) +
                       xml.array("Float64", "e", 1, ones);
    if (n != 1) more += xml.array("Float64", "d", 1, ones);
    const std::string name = "p" + std::to_string(n) + ".vti";
    write_piece("ImageData", parts.at(n), {}, image_place, name, more);
    header.piece(name, &parts.at(n));
  }
  const auto source = opened(folder_.write("all.pvti", header.text()));
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  ASSERT_EQ(std::count_if(info.fields.begin(), info.fields.end(),
                          [](const FieldInfo& f) { return f.name.size() == 1; }),
            1);
  EXPECT_EQ(reason_of(info, "b"),
            "is 1 x float64 in the piece 'p0.vti', but 1 x float32 in 'all.pvti'");
  EXPECT_THAT(reason_of(info, "c"), HasSubstr("but 3 x float64 in 'all.pvti'"));
  EXPECT_EQ(reason_of(info, "d"), "is missing in the piece 'p1.vti'");
  EXPECT_THAT(reason_of(info, "e"), HasSubstr("not declared in 'all.pvti'"));
}

TEST_F(VtkParallel, ContradictionsOfHeaderAndPiecesAreRefused) {
  write_all("ImageData", "vti", image_place);
  const auto refused = [&](const std::string& whole, const std::vector<Box>& extents,
                           const std::string& placed = "Origin=\"10 -3 0\" Spacing=\"0.5 2 0.25\"",
                           const std::vector<std::string>& names = {"parts/p0.vti", "parts/p1.vti",
                                                                    "parts/p2.vti"}) {
    Header header;
    header.attributes = "WholeExtent=\"" + whole + "\" " + placed;
    for (std::size_t n = 0; n < extents.size(); ++n) header.piece(names.at(n), &extents.at(n));
    return refusal(folder_.write("bad.pvti", header.text()));
  };
  const std::vector<Box> all(parts.begin(), parts.end());
  const std::string whole = extent_text(whole_box);
  EXPECT_EQ(refused(whole, all), "");
  EXPECT_THAT(refused("0 16 0 6 0 4", all), HasSubstr("whole extent 0 16 0 6 0 4 of 595 points"));
  EXPECT_THAT(refused("0 7 0 6 0 4", all), HasSubstr("not within the whole extent 0 7 0 6 0 4"));
  EXPECT_THAT(refused(whole, {parts[0], parts[1], {3, 8, 2, 5, 0, 4}}),
              HasSubstr("declares 3 8 2 5 0 4"));
  EXPECT_THAT(refused(whole, {parts[0], parts[1], {2, 8, 2, 6, 0, 4}}),
              HasSubstr("'p2.vti' has 150 points, but 'bad.pvti' declares the extent 2 8 2 6 0 4"));
  EXPECT_THAT(refused(whole, all, "Origin=\"10 -3 0\" Spacing=\"0.5 2 0.5\""),
              HasSubstr("another Origin, Spacing or Direction than 'bad.pvti'"));
  // A gap of one part is refused; the same part twice overlaps.
  EXPECT_THAT(refused(whole, {parts[0], parts[1]}), HasSubstr("2 piece(s) with 230 points"));
  EXPECT_THAT(refused(whole, {parts[0], parts[1], parts[2], parts[2]},
                      "Origin=\"10 -3 0\" Spacing=\"0.5 2 0.25\"",
                      {"parts/p0.vti", "parts/p1.vti", "parts/p2.vti", "parts/p2.vti"}),
              HasSubstr("overlap by 4 cells, more than its GhostLevel of 0"));
}

TEST_F(VtkParallel, TooManyArraysAreRefused) {
  Header header;
  header.attributes = "WholeExtent=\"0 8 0 6 0 4\"";
  header.declared = "<PPointData>";
  for (int n = 0; n < 4097; ++n) {
    header.declared += "<PDataArray type=\"Float64\" Name=\"a" + std::to_string(n) + "\"/>";
  }
  header.declared += "</PPointData>";
  header.piece("p.vti", parts.data());
  EXPECT_THAT(refusal(folder_.write("all.pvti", header.text())),
              HasSubstr("declares more than 4096 arrays of points and cells"));
}

TEST_F(VtkParallel, ReferencesAreConfined) {
  write_all("ImageData", "vti", image_place);
  const auto refused = [&](const std::string& source) {
    Header header;
    header.attributes = "WholeExtent=\"0 8 0 6 0 4\"";
    header.piece(source, &whole_box);
    return refusal(folder_.write("bad.pvti", header.text()));
  };
  EXPECT_THAT(refused("bad.pvti"), HasSubstr("which is not that of a piece of 'bad.pvti'"));
  EXPECT_THAT(refused("all.pvti"), HasSubstr("'PImageData'"));
  EXPECT_THAT(refused("none.vti"), HasSubstr("'none.vti', referred to by 'bad.pvti', is missing"));
  EXPECT_THAT(refused("../../etc/passwd"), HasSubstr("outside"));
  EXPECT_THAT(refused("/etc/passwd"), HasSubstr("outside"));
  EXPECT_THAT(refused(""), HasSubstr("no Source for the piece 0"));
  Header many;
  many.kind = "UnstructuredGrid";
  folder_.write("empty.vtu", VtkXml().file("UnstructuredGrid", "",
                                           "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>"));
  for (int n = 0; n < 16'384; ++n) many.piece("empty.vtu");
  EXPECT_THAT(refusal(folder_.write("many.pvtu", many.text())),
              HasSubstr("refers to more than 16384 files"));
}

// Pieces are named relative to their header, which the collection names relative to itself.
TEST_F(VtkParallel, HeadersFormSeriesAndCollections) {
  std::string sets;
  for (int step = 0; step < 3; ++step) {
    const std::string folder = "t" + std::to_string(step);
    std::filesystem::create_directories(folder_.path("run/" + folder));
    Header header;
    header.attributes = "WholeExtent=\"0 2 0 1 0 1\"";
    const std::array<Box, 2> boxes{{{0, 1, 0, 1, 0, 1}, {1, 2, 0, 1, 0, 1}}};
    for (std::size_t n = 0; n < 2; ++n) {
      VtkXml xml;
      const std::string text = extent_text(boxes.at(n));
      const std::string name = folder + "/p" + std::to_string(n) + ".vti";
      folder_.write("run/" + name,
                    xml.file("ImageData", "WholeExtent=\"" + text + "\"",
                             "<Piece Extent=\"" + text + "\"><PointData>" +
                                 xml.array("Float64", "a", 1, std::vector<double>(8, step)) +
                                 "</PointData></Piece>"));
      header.piece(name, &boxes.at(n));
    }
    folder_.write("run/s" + std::to_string(step) + ".pvti", header.text());
    sets += "<DataSet timestep=\"" + std::to_string(step * 0.5) + "\" file=\"run/s" +
            std::to_string(step) + ".pvti\"/>";
  }
  const std::string all = folder_.write(
      "all.pvd", "<VTKFile type=\"Collection\"><Collection>" + sets + "</Collection></VTKFile>");
  for (const std::string& path : {folder_.path("run/s*.pvti"), all}) {
    const auto source = opened(path);
    ASSERT_TRUE(source) << path;
    ASSERT_EQ(source->info().steps.size(), 3U);
    EXPECT_EQ(source->info().steps[2].value, path == all ? 1 : 2);
    EXPECT_EQ(volume_of(*source, "a", 2).range, (std::array<float, 2>{2, 2}));
  }
  // A piece that changes after opening is an error of the read.
  const auto source = opened(folder_.path("run/s*.pvti"));
  ASSERT_TRUE(source);
  std::filesystem::remove(folder_.path("run/t1/p1.vti"));
  const auto volume = source->read(0, 1);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("p1.vti"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
