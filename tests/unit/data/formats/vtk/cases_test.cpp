// Cases of other programs, which are refused with advice on how to convert them.
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
  EXPECT_THAT(refusal(folder.path("cavity/system/controlDict")), advice);
  EXPECT_THAT(refusal(folder.path("cavity/system")), testing::Not(advice));
}

TEST(OtherCases, EnSightIsRefusedWithAdvice) {
  const VtkFolder folder;
  const std::string path =
      folder.write("run.case", "FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: run.geo\n");
  EXPECT_THAT(refusal(path), HasSubstr("'run.case' is an EnSight case, which is not read"));
}

}  // namespace
}  // namespace windsplat::data::vtk_test
