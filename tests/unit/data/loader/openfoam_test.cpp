// OpenFOAM cases, read by windsplat-vtk in its sandbox: values, orientation, units, times, and
// damaged cases. Values of cells are compared with those at the centres of the cells.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tests/unit/data/loader/case_fixture.hpp"
#include "tests/unit/data/loader/foam_maker.hpp"

namespace windsplat::data::loader {
namespace {

using test::FoamBox;
using test::FoamCase;
using test::FoamCoding;
using test::Place;
using testing::AllOf;
using testing::AnyOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* velocity = "0 1 -1 0 0 0 0";
constexpr const char* kinematic_pressure = "0 2 -2 0 0 0 0";

void write_fields(FoamCase& to, const std::string& name, double time) {
  to.field(name, "p", kinematic_pressure, [&](const Place& at) { return pressure_at(at, time); });
  to.field(name, "U", velocity, [&](const Place& at) { return wind_at(at, time); });
}

// Whether a sample has the value at the centre of the cell around it, or of one beside a face on
// which it lies.
bool is_of_cell(const FoamBox& box, const Place& at, const auto& expected, double value) {
  std::array<std::array<double, 2>, 3> centres{};
  for (std::size_t d = 0; d < 3; ++d) {
    for (std::size_t side = 0; side < 2; ++side) {
      const double slack = side == 0 ? -1e-5 : 1e-5;
      const double index = std::floor((at.at(d) - box.origin.at(d)) / box.h + slack);
      centres.at(d).at(side) =
          box.origin.at(d) + box.h * (std::clamp(index, 0.0, box.cells.at(d) - 1.0) + 0.5);
    }
  }
  for (std::size_t n = 0; n < 8; ++n) {
    const Place centre{centres[0].at(n & 1), centres[1].at(n >> 1 & 1), centres[2].at(n >> 2)};
    if (std::abs(expected(centre) - value) < 1e-5) return true;
  }
  return false;
}

// Compares a field of every sample with a function of the centres of cells; time: of the step.
void expect_cell_values(RemoteSource& source, const std::string& field, std::size_t step,
                        const FoamBox& box, const auto& expected) {
  const auto volume = volume_of(source, field, step);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->masked, 0);
  std::size_t wrong = 0;
  for_samples(source.info(), [&](std::size_t sample, const Place& at) {
    for (int c = 0; c < volume->components; ++c) {
      const auto of_component = [&](const Place& centre) {
        return expected(centre).at(static_cast<std::size_t>(c));
      };
      wrong += is_of_cell(box, at, of_component, volume->component(c)[sample]) ? 0U : 1U;
    }
  });
  EXPECT_EQ(wrong, 0U) << field << " at step " << step;
}

class OpenFoam : public CaseLoader {
 protected:
  // Three times, with all names of a time as OpenFOAM writes them.
  FoamCase cavity(FoamBox box = {}, FoamCoding coding = FoamCoding::ascii) {
    FoamCase::write_control(folder_ / "cavity");
    FoamCase out(folder_ / "cavity", box, coding);
    write_fields(out, "0", 0);
    write_fields(out, "0.5", 0.5);
    write_fields(out, "1e+01", 10);
    return out;
  }

  void expect_cavity(const FoamBox& box) {
    auto source = opened(folder_ / "cavity");
    ASSERT_NE(source, nullptr);
    for (std::size_t d = 0; d < 3; ++d) {
      const auto& axis = source->info().grid.axes.at(d).coordinates;
      EXPECT_LT(axis.front(), box.origin.at(d) + box.h / 2);
      EXPECT_GT(axis.back(), box.origin.at(d) + box.h * (box.cells.at(d) - 0.5));
    }
    for (const auto& written : {std::pair(0, 0.0), {1, 0.5}, {2, 10.0}}) {
      const int step = written.first;
      const double time = written.second;
      expect_cell_values(*source, "p", step, box,
                         [&](const Place& at) { return pressure_at(at, time); });
      expect_cell_values(*source, "U", step, box,
                         [&](const Place& at) { return wind_at(at, time); });
    }
  }
};

TEST_F(OpenFoam, ValuesOfHexahedraAreThoseOfTheirCells) {
  const auto box = cavity().box();
  expect_cavity(box);
}

TEST_F(OpenFoam, BinaryFilesReadAsText) {
  const auto box = cavity({}, FoamCoding::binary).box();
  expect_cavity(box);
}

TEST_F(OpenFoam, CompressedFilesReadAsText) {
  const auto box = cavity({}, FoamCoding::gzip).box();
  expect_cavity(box);
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().find("U")->units, "m s-1");
}

TEST_F(OpenFoam, PolyhedraHaveTheValuesOfTheirCells) {
  FoamBox box;
  box.has_polyhedra = true;
  cavity(box);
  expect_cavity(box);
}

TEST_F(OpenFoam, DecomposedCasesAreUnited) {
  const std::string folder = folder_ / "cavity";
  FoamCase::write_control(folder);
  FoamBox whole;
  whole.cells = {4, 3, 2};
  for (int p = 0; p < 2; ++p) {
    FoamBox half = whole;
    half.cells[0] = 2;
    half.origin[0] = 2 * whole.h * p;
    FoamCase part(folder + "/processor" + std::to_string(p), half);
    // A copy, which must not replace p in any of the folders.
    part.field("0", "p", kinematic_pressure, [](const Place&) { return std::vector<double>{-9}; });
    std::filesystem::copy_file(part.path("0/p"), part.path("0/a"));
    write_fields(part, "0", 0);
    write_fields(part, "0.5", 0.5);
    write_fields(part, "1e+01", 10);
  }
  expect_cavity(whole);
  const auto source = opened(folder);
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("united from 2 folders processor*")));
}

TEST_F(OpenFoam, ValuesOfPointsAreInterpolated) {
  FoamCase made(folder_ / "cavity", {});
  FoamCase::write_control(folder_ / "cavity");
  const auto displacement = [](const Place& at) {
    return std::vector<double>{at[0], at[0] + 2 * at[1], 3 - at[2]};
  };
  made.field("0", "pointDisplacement", "0 1 0 0 0 0 0", displacement, true);
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().find("pointDisplacement")->units, "m");
  const auto volume = volume_of(*source, "pointDisplacement", 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->masked, 0);
  for_samples(source->info(), [&](std::size_t sample, const Place& at) {
    const auto expected = displacement(at);
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(volume->component(c)[sample], expected[static_cast<std::size_t>(c)], 1e-6);
    }
  });
}

TEST_F(OpenFoam, UnitsAreThoseOfTheDimensions) {
  FoamCase::write_control(folder_ / "run");
  FoamCase made(folder_ / "run", {});
  const auto one = [](const Place& at) { return std::vector<double>{at[0]}; };
  const std::vector<std::array<std::string, 3>> cases{{"T", "0 0 0 1 0 0 0", "K"},
                                                      {"p_rgh", "1 -1 -2 0 0 0 0", "Pa"},
                                                      {"k", "0 2 -2 0 0", "m2 s-2"},
                                                      {"alpha.water", "0 0 0 0 0 0 0", "1"},
                                                      {"rho", "1 -3 0 0 0 0 0", "kg m-3"},
                                                      {"J", "0 -2 0 0 0 1 0", "m-2 A"},
                                                      {"odd", "0 0.5 -1 0 0 0 0", "m^0.5 s-1"}};
  for (const auto& [name, dimensions, units] : cases) made.field("0", name, dimensions, one);
  const auto source = opened(folder_ / "run");
  ASSERT_NE(source, nullptr);
  for (const auto& [name, dimensions, units] : cases) {
    const FieldInfo* const field = source->info().find(name);
    ASSERT_NE(field, nullptr) << name;
    EXPECT_EQ(field->units, units) << name;
  }
  for (const Axis& axis : source->info().grid.axes) EXPECT_EQ(axis.units, "m");
}

TEST_F(OpenFoam, TimesAreThoseOfTheFoldersInSeconds) {
  cavity();
  std::filesystem::create_directories(folder_ / "cavity/0.orig");
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().time_units, "s");
  std::vector<double> times;
  for (const TimeStep& step : source->info().steps) times.push_back(step.value);
  EXPECT_THAT(times, ElementsAre(0, 0.5, 10));
}

TEST_F(OpenFoam, AFileNamedFoamStandsForItsFolder) {
  cavity();
  std::ofstream(folder_ / "cavity/view.foam");
  std::ofstream(folder_ / "cavity/view.OpenFOAM") << " ";
  const auto folder = opened(folder_ / "cavity");
  ASSERT_NE(folder, nullptr);
  for (const char* name : {"cavity/view.foam", "cavity/view.OpenFOAM"}) {
    const auto file = opened(folder_ / name);
    ASSERT_NE(file, nullptr) << name;
    auto a = folder->read(0, 1);
    auto b = file->read(0, 1);
    ASSERT_TRUE(a && b);
    expect_same(*a, *b);
  }
}

TEST_F(OpenFoam, WhatIsNotShownIsNamedWithTheReason) {
  auto made = cavity();
  made.write("0.5", "phi", "surfaceScalarField", "dimensions [0 3 -1 0 0 0 0];\n");
  made.write("0.5", "R", "volSymmTensorField", "dimensions [0 2 -2 0 0 0 0];\n");
  made.field("0.5", "once", "0 0 0 0 0 0 0", [](const Place&) { return std::vector<double>{1}; });
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().left_out, Contains(testing::Field(&LeftOut::name, "phi")));
  EXPECT_THAT(source->info().left_out,
              Contains(AllOf(testing::Field(&LeftOut::name, "R"),
                             testing::Field(&LeftOut::reason, HasSubstr("volSymmTensorField")))));
  EXPECT_THAT(source->info().left_out,
              Contains(AllOf(testing::Field(&LeftOut::name, "once"),
                             testing::Field(&LeftOut::reason, "is missing at the time 0"))));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("patches and zones are not")));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("resampled from 60 points and 24 cells")));
}

TEST_F(OpenFoam, InitialValuesAreOmittedWhereFieldsComeLater) {
  auto made = cavity();
  for (const char* time : {"0.5", "1e+01"}) {
    made.field(time, "nut", "0 2 -1 0 0 0 0", [](const Place&) { return std::vector<double>{1}; });
  }
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_NE(source->info().find("nut"), nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[0].value, 0.5);
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("the time 0 is omitted")));
}

TEST_F(OpenFoam, DamagedFilesAreRefusedByName) {
  const auto made = cavity();
  const std::string points = made.path("constant/polyMesh/points");
  std::filesystem::resize_file(points, std::filesystem::file_size(points) / 2);
  EXPECT_THAT(refusal(folder_ / "cavity"),
              AllOf(HasSubstr("'cavity'"), HasSubstr("constant/polyMesh/points")));
  std::filesystem::remove(points);
  EXPECT_THAT(refusal(folder_ / "cavity"), HasSubstr("'constant/polyMesh/points': no such file"));
}

TEST_F(OpenFoam, FacesThatReferToAbsentPointsAreRefused) {
  const auto made = cavity();
  const std::string path = made.path("constant/polyMesh/faces");
  std::ifstream in(path);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto face = text.find("4(");
  ASSERT_NE(face, std::string::npos);
  text.replace(face, 3, "4(60");  // 60 points: 0 to 59
  std::ofstream(path) << text;
  EXPECT_THAT(refusal(folder_ / "cavity"),
              AllOf(HasSubstr("'cavity'"), HasSubstr("out of range: 60 points")));
}

TEST_F(OpenFoam, AListOfOwnersForOtherFacesIsRefused) {
  auto made = cavity();
  made.write("constant/polyMesh", "owner", "labelList", "3\n(\n0\n1\n2\n)\n");
  EXPECT_THAT(refusal(folder_ / "cavity"), AllOf(HasSubstr("'cavity'"), HasSubstr("owner")));
}

TEST_F(OpenFoam, ValuesThatEndEarlyAreRefusedByFileAndTime) {
  auto made = cavity();
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  made.write("0.5", "p", "volScalarField",
             "dimensions [0 2 -2 0 0 0 0];\ninternalField nonuniform List<scalar>\n24\n(\n1\n2\n");
  auto again = opened(folder_ / "cavity");
  ASSERT_NE(again, nullptr);
  const auto volume = volume_of(*again, "p", 1);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, AllOf(HasSubstr("'cavity'"), HasSubstr("0.5/p")));
}

TEST_F(OpenFoam, FilesThatChangeAreNoticed) {
  auto made = cavity();
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  made.field("0.5", "p", kinematic_pressure, [](const Place&) { return std::vector<double>{1}; });
  const auto volume = volume_of(*source, "p", 1);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("changed"));
}

TEST_F(OpenFoam, AMeshThatMovesIsRefusedAtThatStep) {
  cavity();
  FoamBox moved;
  moved.origin[0] = 0.01;
  const FoamCase other(folder_ / "other", moved);
  std::filesystem::copy(other.path("constant/polyMesh"), folder_ / "cavity/1e+01/polyMesh",
                        std::filesystem::copy_options::recursive);
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(volume_of(*source, "p", 1));
  const auto volume = volume_of(*source, "p", 2);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("mesh that differs from that of the first step"));
}

TEST_F(OpenFoam, FilesOutsideTheCaseAreNotRead) {
  auto made = cavity();
  std::ofstream(folder_ / "secret") << "internalField uniform 7;\n";
  made.write("0.5", "p", "volScalarField",
             "dimensions [0 2 -2 0 0 0 0];\n#include \"../../secret\"\n");
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  const auto volume = volume_of(*source, "p", 1);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("'cavity'"));
}

TEST_F(OpenFoam, NamesWithFoldersAboveStayInTheCase) {
  auto made = cavity();
  const auto p_with = [&](const std::string& included) {
    made.write("0.5", "p", "volScalarField",
               "dimensions [0 2 -2 0 0 0 0];\n#include \"" + included +
                   "\"\nboundaryField\n{\nwalls { type zeroGradient; }\n}\n");
  };
  std::ofstream(made.path("constant/start")) << "internalField uniform 7;\n";
  p_with("../constant/start");
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  const auto volume = volume_of(*source, "p", 1);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->range[1], 7);
  // One more leads out; it must not be taken for the file of this name in the case.
  p_with("../../constant/start");
  source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  const auto outside = volume_of(*source, "p", 1);
  ASSERT_FALSE(outside);
  EXPECT_THAT(outside.error().message, HasSubstr("Cannot open file"));
}

TEST_F(OpenFoam, LinksThatLeadOutOfTheCaseAreRefused) {
  const auto made = cavity();
  std::filesystem::rename(made.path("0/p"), folder_ / "p");
  std::filesystem::create_symlink("../../p", made.path("0/p"));
  EXPECT_THAT(refusal(folder_ / "cavity"), HasSubstr("outside the dataset's folder"));
}

// VTK would show the values of the copy as those of p.
TEST_F(OpenFoam, CopiesOfAFieldDoNotReplaceIt) {
  auto made = cavity();
  for (const char* time : {"0", "0.5", "1e+01"}) {
    const std::string folder = time;
    made.field(folder, "p", kinematic_pressure,
               [](const Place&) { return std::vector<double>{-99}; });
    for (const char* copy : {"/a", "/p.orig"}) {
      std::filesystem::copy_file(made.path(folder + "/p"), made.path(folder + copy));
    }
  }
  const auto box = cavity().box();
  expect_cavity(box);
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  for (const char* copy : {"a", "p.orig"}) {
    EXPECT_EQ(source->info().find(copy), nullptr);
    EXPECT_THAT(source->info().left_out,
                Contains(AllOf(testing::Field(&LeftOut::name, copy),
                               testing::Field(&LeftOut::reason, HasSubstr("the object 'p'")))));
  }
}

TEST_F(OpenFoam, OldFilesAreLeftOut) {
  auto made = cavity();
  for (const char* name : {"U_0", "p.bak", "p~"}) {
    for (const char* time : {"0", "0.5", "1e+01"}) {
      made.field(time, name, velocity, [](const Place&) { return std::vector<double>{1}; });
    }
  }
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  for (const char* name : {"U_0", "p.bak", "p~"}) {
    EXPECT_EQ(source->info().find(name), nullptr) << name;
    EXPECT_THAT(source->info().left_out, Contains(testing::Field(&LeftOut::name, name)));
  }
}

// VTK would read the bytes in the order of this machine.
TEST_F(OpenFoam, BinaryDataOfOtherLayoutsAreRefused) {
  const auto made = cavity({}, FoamCoding::binary);
  const auto change_layout = [&](const std::string& name, const std::string& from,
                                 const std::string& to) {
    std::ifstream in(made.path(name), std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
    std::ofstream(made.path(name), std::ios::binary) << text;
  };
  change_layout("0.5/p", "LSB", "MSB");
  const auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().left_out,
              Contains(AllOf(testing::Field(&LeftOut::name, "p"),
                             testing::Field(&LeftOut::reason, HasSubstr("MSB;label=32")))));
  change_layout("constant/polyMesh/owner", "label=32", "label=16");
  EXPECT_THAT(refusal(folder_ / "cavity"), AllOf(HasSubstr("owner"), HasSubstr("label=16")));
}

TEST_F(OpenFoam, ErrorsThatNameTheirFileNameNoOther) {
  auto made = cavity();
  made.write("0.5", "p", "volScalarField",
             "dimensions [0 2 -2 0 0 0 0];\ninternalField uniform #calc \"1\";\n");
  made.field("0.5", "zeta", "0 0 0 0 0 0 0", [](const Place&) { return std::vector<double>{1}; });
  auto source = opened(folder_ / "cavity");
  ASSERT_NE(source, nullptr);
  const auto volume = volume_of(*source, "p", 1);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, AllOf(HasSubstr("0.5/p"), HasSubstr("calc"),
                                            testing::Not(HasSubstr("the last file it read"))));
}

// What a program that cannot read a case says about it.
TEST_F(OpenFoam, WithoutTheProgramOfVtkTheErrorNamesIt) {
  cavity();
  set_case_program("");
  EXPECT_THAT(refusal(folder_ / "cavity"),
              AllOf(HasSubstr("'cavity' is an OpenFOAM case"), HasSubstr("windsplat-vtk")));
}

}  // namespace
}  // namespace windsplat::data::loader
