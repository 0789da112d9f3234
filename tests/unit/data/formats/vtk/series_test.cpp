// Steps in separate files: collections and patterns, their times, their common grid.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/vtk/vtk_maker.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;

std::string image(double value, const std::string& time, std::array<int, 3> dims = {2, 2, 2},
                  const std::string& name = "a") {
  VtkXml xml;
  const auto count = static_cast<std::size_t>(dims[0] * dims[1] * dims[2]);
  std::string file =
      xml.image(dims, "",
                xml.array("Float32", name, 1, std::vector<double>(count, value)) +
                    xml.array("Float32", "b", 1, std::vector<double>(count, -value)));
  if (!time.empty()) {
    file.insert(file.find("<Piece"),
                "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" "
                "NumberOfTuples=\"1\" format=\"ascii\">" +
                    time + "</DataArray></FieldData>");
  }
  return file;
}

std::string collection(const std::string& sets) {
  return "<VTKFile type=\"Collection\" version=\"0.1\"><Collection>" + sets +
         "</Collection></VTKFile>";
}

TEST(VtkSeries, PatternGivesOrderedStepsWithTheFilesTimes) {
  const VtkFolder folder;
  folder.write("f10.vti", image(10, "2.5"));
  folder.write("f2.vti", image(2, "0.5"));
  folder.write("f1.vti", image(1, "0.25"));
  const auto source = opened(folder.path("f*.vti"));
  ASSERT_TRUE(source);
  const auto& steps = source->info().steps;
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_EQ(steps[0].value, 0.25);
  EXPECT_EQ(steps[2].text, "2.5");
  EXPECT_EQ(volume_of(*source, "a", 1).values[0], 2);
  EXPECT_EQ(volume_of(*source, "b", 2).values[7], -10);
}

TEST(VtkSeries, DamagedFilesAreLeftOutAndNamed) {
  const VtkFolder folder;
  folder.write("f1.vti", "");
  folder.write("f2.vti", image(2, "2"));
  folder.write("f3.vti", image(3, "3").substr(0, 300));
  folder.write("f4.vti", image(4, "4"));
  const auto source = opened(folder.path("f*.vti"));
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[1].value, 4);
  EXPECT_EQ(volume_of(*source, "a", 0).values[0], 2);
  EXPECT_EQ(volume_of(*source, "a", 1).values[0], 4);
  EXPECT_THAT(all_notes(source->info()),
              testing::ContainsRegex("2 of 4 files cannot be read.*'f1.vti'.*'f3.vti'"));
}

TEST(VtkSeries, AFirstFileOfAnotherFormatIsLeftOut) {
  const VtkFolder folder;
  folder.write("f1.vti", "<html><body>404 Not Found</body></html>");
  folder.write("f2.vti", image(2, "2"));
  folder.write("f3.vti", image(3, "3"));
  const auto source = opened(folder.path("f*.vti"));
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(volume_of(*source, "a", 1).values[0], 3);
  EXPECT_THAT(all_notes(source->info()), HasSubstr("'f1.vti'"));
}

TEST(VtkSeries, StepsWithoutTimesAreNumbered) {
  const VtkFolder folder;
  folder.write("f1.vti", image(1, ""));
  folder.write("f2.vti", image(2, ""));
  const auto source = opened(folder.path("f*.vti"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps[1].value, 1);
}

TEST(VtkSeries, CollectionGivesTheTimes) {
  const VtkFolder folder;
  std::filesystem::create_directory(folder.path("data"));
  folder.write("data/late.vti", image(5, "77"));
  folder.write("data/early.vti", image(4, "78"));
  const auto source = opened(folder.write(
      "all.pvd", collection("<DataSet timestep=\"1e3\" part=\"0\" file=\"data/late.vti\"/>"
                            "<DataSet timestep=\"-1.5\" part=\"0\" file=\"data/early.vti\"/>")));
  ASSERT_TRUE(source);
  const auto& steps = source->info().steps;
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_EQ(steps[0].value, -1.5);
  EXPECT_EQ(steps[1].value, 1000);
  EXPECT_EQ(volume_of(*source, "a", 0).values[0], 4);
  EXPECT_EQ(volume_of(*source, "a", 1).values[0], 5);
}

TEST(VtkSeries, InvalidCollectionsAreRefused) {
  const VtkFolder folder;
  folder.write("a.vti", image(1, ""));
  const auto set = [](const std::string& file, const std::string& time) {
    return "<DataSet timestep=\"" + time + "\" file=\"" + file + "\"/>";
  };
  const auto refused = [&](const std::string& sets) {
    return refusal(folder.write("all.pvd", collection(sets)));
  };
  EXPECT_THAT(refused(set("a.vti", "0") + set("a.vti", "0")), HasSubstr("twice for a timestep"));
  EXPECT_THAT(refused(set("none.vti", "0")), HasSubstr("none.vti"));
  EXPECT_NE(refused(set("../../../../etc/passwd", "0")), "");
  EXPECT_NE(refused(set("/etc/passwd", "0")), "");
  EXPECT_THAT(refused(set("a.vti", "noon")), HasSubstr("timestep"));
  EXPECT_THAT(refused(""), HasSubstr("without a DataSet"));
  EXPECT_NE(refused(set("all.pvd", "0")), "");
}

TEST(VtkSeries, StepOnAnotherGridIsReported) {
  const VtkFolder folder;
  folder.write("f1.vti", image(1, ""));
  folder.write("f2.vti", image(2, ""));
  folder.write("f3.vti", image(3, "", {3, 2, 2}));
  const std::string message = refusal(folder.path("f*.vti"));
  EXPECT_THAT(message, HasSubstr("f3.vti"));
  EXPECT_THAT(message, HasSubstr("step 2"));
  EXPECT_THAT(message, HasSubstr("differs from that of the first step"));
}

TEST(VtkSeries, FieldMissingInAStepIsOmitted) {
  const VtkFolder folder;
  folder.write("f1.vti", image(1, ""));
  folder.write("f2.vti", image(2, "", {2, 2, 2}, "other"));
  const auto source = opened(folder.path("f*.vti"));
  ASSERT_TRUE(source);
  ASSERT_EQ(source->info().fields.size(), 1U);
  EXPECT_EQ(source->info().fields[0].name, "b");
  EXPECT_THAT(reason_of(source->info(), "a"), HasSubstr("f2.vti"));
}

std::string tetrahedron(double top, double value) {
  std::string file = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  file += "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 " + std::to_string(top);
  file += "\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\nSCALARS a float\n";
  return file + "LOOKUP_TABLE default\n" + std::to_string(value) + "\n";
}

TEST(VtkSeries, MovingMeshesAreRefused) {
  const VtkFolder folder;
  folder.write("m1.vtk", tetrahedron(1, 3));
  folder.write("m2.vtk", tetrahedron(1, 4));
  auto source = opened(folder.path("m*.vtk"));
  ASSERT_TRUE(source);
  EXPECT_EQ(volume_of(*source, "a", 1).range[1], 4);
  folder.write("m2.vtk", tetrahedron(1.5, 4));
  EXPECT_THAT(refusal(folder.path("m*.vtk")), HasSubstr("step 1"));
}

TEST(VtkSeries, ChangedFileIsAnError) {
  const VtkFolder folder;
  folder.write("m1.vtk", tetrahedron(1, 3));
  folder.write("m2.vtk", tetrahedron(1, 4));
  auto source = opened(folder.path("m*.vtk"));
  ASSERT_TRUE(source);
  folder.write("m2.vtk", tetrahedron(1, 4) + "\n\n");
  const auto volume = source->read(0, 1);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("changed"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
