// Cases of OpenFOAM and EnSight, which this process cannot read: only windsplat-vtk does
// (tests/unit/data/loader/openfoam_test.cpp). They are refused with advice on how to convert them.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/vtk/vtk_maker.hpp"

namespace windsplat::data::vtk_test {
namespace {

using testing::HasSubstr;

TEST(OtherCases, OpenFoamIsRefusedWithAdvice) {
  const VtkFolder folder;
  std::filesystem::create_directories(folder.path("cavity/system"));
  const std::string dictionary =
      "/*----*- C++ -*----*/\nFoamFile\n{\n    format ascii;\n    class dictionary;\n}\n";
  folder.write("cavity/system/controlDict", dictionary);
  folder.write("cavity/cavity.foam", "");
  const auto advice = HasSubstr("convert the case with foamToVTK");
  EXPECT_THAT(refusal(folder.path("cavity")), advice);
  EXPECT_THAT(refusal(folder.path("cavity/cavity.foam")), advice);
  EXPECT_THAT(refusal(folder.path("cavity/system/controlDict")),
              HasSubstr("'controlDict' belongs to an OpenFOAM case; open the folder of the case"));
  EXPECT_THAT(refusal(folder.path("cavity/system")), testing::Not(advice));
}

TEST(OtherCases, EnSightIsRefusedWithAdvice) {
  const VtkFolder folder;
  const std::string path =
      folder.write("run.case", "FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: run.geo\n");
  EXPECT_THAT(
      refusal(path),
      HasSubstr("'run.case' is an EnSight case, which only the program windsplat-vtk reads"));
  EXPECT_THAT(refusal(folder.write("run.txt", "FORMAT\ntype: ensight gold\n")),
              HasSubstr("'run.txt' is an EnSight case, whose name must end in .case or .encas"));
  EXPECT_THAT(refusal(folder.write("other.case", "no case at all")),
              testing::Not(HasSubstr("EnSight")));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
