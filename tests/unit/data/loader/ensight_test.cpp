// Cases of EnSight Gold, read by windsplat-vtk in its sandbox. Values of nodes are linear, so that
// they are exact after resampling up to the digits of the files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/data/loader/case_fixture.hpp"
#include "tests/unit/data/loader/ensight_maker.hpp"

namespace windsplat::data::loader {
namespace {

using test::EnSightBox;
using test::EnSightCoding;
using testing::AllOf;
using testing::AnyOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

using Place = std::array<double, 3>;

constexpr const char* case_text =
    "FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: run.geo\n\nVARIABLE\n"
    "scalar per node: 1 pressure data/p.****\nvector per node: 1 velocity data/v.****\n"
    "scalar per element: 1 heat data/h.****\n\nTIME\ntime set: 1\n"
    "number of steps: 2\n"
    "filename start number: 3\nfilename increment: 2\ntime values: 0.5 2\n";

class EnSight : public CaseLoader {
 protected:
  std::string run(EnSightCoding coding, const std::vector<EnSightBox>& parts = {EnSightBox()}) {
    std::filesystem::create_directories(folder_ / "run/data");
    test::write_geometry(folder_ / "run/run.geo", coding, parts);
    for (const auto& written : {std::pair("0003", 0.5), {"0005", 2.0}}) {
      const double time = written.second;
      const std::string end = std::string(".") + written.first;
      test::write_variable(folder_ / ("run/data/p" + end), coding, parts, false,
                           [&](const Place& at) { return pressure_at(at, time); });
      test::write_variable(folder_ / ("run/data/v" + end), coding, parts, false,
                           [&](const Place& at) { return wind_at(at, time); });
      test::write_variable(folder_ / ("run/data/h" + end), coding, parts, true,
                           [&](const Place& at) { return pressure_at(at, time); });
    }
    return write_case(case_text);
  }

  std::string write_case(const std::string& text) {
    std::ofstream(folder_ / "run/run.case") << text;
    return folder_ / "run/run.case";
  }

  static void expect_linear(RemoteSource& source) {
    const double h = EnSightBox().h;
    for (const auto& written : {std::pair(0, 0.5), {1, 2.0}}) {
      const int step = written.first;
      const double time = written.second;
      const auto pressure = volume_of(source, "pressure", step);
      const auto wind = volume_of(source, "velocity", step);
      const auto heat = volume_of(source, "heat", step);
      ASSERT_TRUE(pressure && wind && heat);
      EXPECT_EQ(pressure->masked, 0);
      for_samples(source.info(), [&](std::size_t sample, const Place& at) {
        ASSERT_NEAR(pressure->component(0)[sample], pressure_at(at, time)[0], 1e-4);
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(wind->component(c)[sample], wind_at(at, time)[static_cast<std::size_t>(c)],
                      1e-4);
        }
        // Of the centre of the cell: at most half a cell away along each axis.
        const double apart = (1 + 2 + 4) * h / 2 + 1e-4;
        ASSERT_NEAR(heat->component(0)[sample], pressure_at(at, time)[0], apart);
      });
    }
  }
};

TEST_F(EnSight, TextReadsAsWritten) {
  auto source = opened(run(EnSightCoding::text));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().format, "EnSight Gold (ASCII)");
  expect_linear(*source);
}

TEST_F(EnSight, BinaryReadsAsTextInBothByteOrders) {
  for (const EnSightCoding coding : {EnSightCoding::little, EnSightCoding::big}) {
    auto source = opened(run(coding));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().format, "EnSight Gold (binary)");
    expect_linear(*source);
  }
}

TEST_F(EnSight, TimesAreThoseOfTheCaseFile) {
  const auto source = opened(run(EnSightCoding::text));
  ASSERT_NE(source, nullptr);
  std::vector<double> times;
  for (const TimeStep& step : source->info().steps) times.push_back(step.value);
  EXPECT_THAT(times, ElementsAre(0.5, 2));
  EXPECT_EQ(source->info().time_units, "");  // the format has none
  EXPECT_EQ(source->info().find("velocity")->units, "");
}

TEST_F(EnSight, PartsAreUnited) {
  EnSightBox left;
  left.cells = {2, 3, 2};
  EnSightBox right = left;
  right.origin[0] = 0.5;
  auto source = opened(run(EnSightCoding::little, {left, right}));
  ASSERT_NE(source, nullptr);
  expect_linear(*source);
}

TEST_F(EnSight, AVariableWithoutTimesIsReadAtEachStep) {
  run(EnSightCoding::text);
  test::write_variable(folder_ / "run/still", EnSightCoding::text, {EnSightBox()}, false,
                       [](const Place& at) { return std::vector<double>{at[2]}; });
  std::string text = case_text;
  text.insert(text.find("scalar per node"), "scalar per node: still still\n");
  auto source = opened(write_case(text));
  ASSERT_NE(source, nullptr);
  for (const std::size_t step : {0U, 1U}) {
    const auto volume = volume_of(*source, "still", step);
    ASSERT_TRUE(volume) << volume.error().message;
    for_samples(source->info(), [&](std::size_t sample, const Place& at) {
      ASSERT_NEAR(volume->component(0)[sample], at[2], 1e-4);
    });
  }
}

// Of another time set: VTK would show its values at times that it does not have.
TEST_F(EnSight, AVariableOfOtherTimesIsLeftOut) {
  run(EnSightCoding::text);
  test::write_variable(folder_ / "run/late.0000", EnSightCoding::text, {EnSightBox()}, false,
                       [](const Place& at) { return std::vector<double>{at[2]}; });
  std::string text = std::string(case_text) + R"(time set: 7
number of steps: 1
filename start number: 0
filename increment: 1
time values: 1.5
)";
  text.insert(text.find("scalar per node"), "scalar per node: 7 late late.****\n");
  auto source = opened(write_case(text));
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_DOUBLE_EQ(source->info().steps[1].value, 2);
  EXPECT_EQ(source->info().find("late"), nullptr);
  bool is_told = false;
  for (const auto& left : source->info().left_out) {
    is_told =
        is_told || (left.name == "late" && left.reason.find("time set 7") != std::string::npos);
  }
  EXPECT_TRUE(is_told);
  expect_linear(*source);
}

TEST_F(EnSight, SeveralStepsInOneFileAreRefused) {
  run(EnSightCoding::text);
  const std::string text = std::string(case_text) + R"(FILE
file set: 1
number of steps: 2
)";
  EXPECT_THAT(refusal(write_case(text)),
              AllOf(HasSubstr("'run.case'"), HasSubstr("several steps in one file")));
}

TEST_F(EnSight, DamagedFilesAreRefusedByName) {
  const std::string path = run(EnSightCoding::text);
  std::filesystem::remove(folder_ / "run/run.geo");
  EXPECT_THAT(refusal(path), AllOf(HasSubstr("'run.case'"), HasSubstr("run.geo")));
  run(EnSightCoding::text);
  std::filesystem::remove(folder_ / "run/data/p.0003");
  EXPECT_THAT(refusal(path), AllOf(HasSubstr("'run.case'"), HasSubstr("p.0003")));
}

TEST_F(EnSight, FilesThatEndEarlyAreRefused) {
  for (const EnSightCoding coding : {EnSightCoding::text, EnSightCoding::little}) {
    for (const char* name : {"run/run.geo", "run/data/p.0003"}) {
      const std::string path = run(coding);
      const std::string file = folder_ / name;
      std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
      EXPECT_THAT(refusal(path), AllOf(HasSubstr("'run.case'"),
                                       HasSubstr(std::filesystem::path(name).filename().native())));
    }
  }
}

// VTK repeats the last line of a text file that ends early.
TEST_F(EnSight, TextWithoutItsLastLineIsRefused) {
  for (const char* name : {"run/run.geo", "run/data/p.0003"}) {
    const std::string path = run(EnSightCoding::text);
    const std::string file = folder_ / name;
    constexpr std::size_t line_min = 13;
    std::filesystem::resize_file(file, std::filesystem::file_size(file) - line_min);
    std::ofstream(file, std::ios::app) << "";
    const bool is_geometry = std::string(name).ends_with("geo");
    if (is_geometry) std::filesystem::resize_file(file, std::filesystem::file_size(file) - 68);
    EXPECT_THAT(refusal(path), HasSubstr("ends early")) << name;
  }
}

TEST_F(EnSight, UndefinedValuesAreRefused) {
  for (const char* mark : {"undef", "partial"}) {
    const std::string path = run(EnSightCoding::text);
    const std::string file = folder_ / "run/data/p.0003";
    std::ofstream(file) << "text\npart\n         1\ncoordinates " << mark << "\n -1.00000e+10\n";
    EXPECT_THAT(refusal(path), AllOf(HasSubstr("'run.case'"), HasSubstr(mark)));
  }
}

TEST_F(EnSight, FilesOutsideTheFolderAreNotRead) {
  run(EnSightCoding::text);
  std::filesystem::rename(folder_ / "run/run.geo", folder_ / "run.geo");
  std::string text = case_text;
  text.replace(text.find("run.geo"), 7, "../run.geo");
  EXPECT_THAT(refusal(write_case(text)),
              AllOf(HasSubstr("'run.case'"), HasSubstr("'../run.geo', which lies outside")));
}

TEST_F(EnSight, FilesOfAbsoluteNamesAreRefused) {
  run(EnSightCoding::text);
  std::string text = case_text;
  text.replace(text.find("data/h.****"), 11, "/proc/self/environ");
  EXPECT_THAT(refusal(write_case(text)),
              AllOf(HasSubstr("'/proc/self/environ'"), HasSubstr("outside the folder")));
}

TEST_F(EnSight, OneNameOfNodesAndElementsGivesTwoFields) {
  run(EnSightCoding::text);
  test::write_variable(folder_ / "run/still", EnSightCoding::text, {EnSightBox()}, true,
                       [](const Place&) { return std::vector<double>{7}; });
  std::string text = case_text;
  text.insert(text.find("scalar per node"), "scalar per element: pressure still\n");
  auto source = opened(write_case(text));
  ASSERT_NE(source, nullptr);
  expect_linear(*source);
  const auto volume = volume_of(*source, "pressure_of_elements", 1);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->range[0], 7);
  EXPECT_EQ(volume->range[1], 7);
}

// VTK has one array for both.
TEST_F(EnSight, AVariableOfTheSameNameIsLeftOut) {
  run(EnSightCoding::text);
  std::string text = case_text;
  text.insert(text.find("vector per node"), "scalar per node: 1 pressure data/v.****\n");
  const auto source = opened(write_case(text));
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().left_out,
              Contains(testing::Field(&LeftOut::reason, "has the name of a variable before it")));
}

// VTK finds steps by their times.
TEST_F(EnSight, TimesThatDoNotAscendAreRefused) {
  run(EnSightCoding::text);
  for (const char* times : {"2 0.5", "2 2", "nan inf"}) {
    std::string text = case_text;
    text.replace(text.find("0.5 2"), 5, times);
    EXPECT_THAT(refusal(write_case(text)), HasSubstr("no ascending numbers")) << times;
  }
}

TEST_F(EnSight, OtherVersionsAreRefusedByName) {
  const std::string path = run(EnSightCoding::text);
  std::string text = case_text;
  text.replace(text.find("ensight gold"), 12, "ensight");
  EXPECT_THAT(refusal(write_case(text)), HasSubstr("is no case of EnSight Gold"));
}

}  // namespace
}  // namespace windsplat::data::loader
