// windsplat study on the command line: a report, a second run without measurements, an interrupted
// run.
#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/integration/cli_program.hpp"
#include "tests/protocol/support.hpp"

namespace cli_test {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

TEST(CliStudy, QuickStudyWritesItsReportAndSkipsFinishedPoints) {
  const Folder folder;
  const std::string out = folder.file("report");
  const Words words{"study", "--quick", "--scene", "vectors", "--threads", "1", "-o", out};
  const Outcome first = run(words);
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr(" 0 skipped"));
  EXPECT_THAT(first.err, HasSubstr("vectors done"));
  for (const char* file : {"study.json", "study.csv", "index.html"}) {
    EXPECT_TRUE(std::filesystem::exists(out + "/" + file)) << file;
  }
  const Json before = Json::parse(read_file(out + "/study.json"));
  const auto points = before.at("scenes").at(0).at("points").size();
  EXPECT_GT(points, 4U);

  const Outcome second = run(words);
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_THAT(second.out, HasSubstr("0 points measured, " + std::to_string(points) + " skipped"));
  const Json after = Json::parse(read_file(out + "/study.json"));
  EXPECT_EQ(after.at("scenes").at(0).at("points"), before.at("scenes").at(0).at("points"));
}

TEST(CliStudy, FileWithAViewIsStudiedByThatView) {
  const Folder folder;
  const std::string data = synth(folder, "tornado", "12x12x12");
  write_file(folder.file("view.json"), R"({"scalars": [], "vector": {"span": 3}})");
  const std::string out = folder.file("report");
  const Outcome done = run({"study", data, "--view", folder.file("view.json"), "--size", "48x36",
                            "--quick", "--no-reference", "-o", out});
  ASSERT_EQ(done.code, 0) << done.err;
  const Json scene = Json::parse(read_file(out + "/study.json")).at("scenes").at(0);
  EXPECT_EQ(scene.at("name"), "tornado-small");
  EXPECT_EQ(scene.at("reference").at("kind"), "extrapolated");
  EXPECT_EQ(scene.at("reference").at("width"), 48);
  EXPECT_EQ(scene.at("points").at(0).at("knobs").at("span"), 3);
  EXPECT_EQ(scene.at("calibration").at("width"), 96);
  EXPECT_THAT(done.out, HasSubstr("within a factor of 2"));
}

TEST(CliStudy, CalibrationCanBeDisabled) {
  const Folder folder;
  const std::string data = synth(folder, "tornado", "12x12x12");
  const std::string out = folder.file("report");
  const Outcome done = run({"study", data, "--size", "48x36", "--quick", "--no-reference",
                            "--no-calibration", "-o", out});
  ASSERT_EQ(done.code, 0) << done.err;
  EXPECT_FALSE(
      Json::parse(read_file(out + "/study.json")).at("scenes").at(0).contains("calibration"));
}

TEST(CliStudy, InterruptedStudyCanBeResumed) {
  const Folder folder;
  const std::string out = folder.file("report");
  Process process({"study", "--scene", "climate", "-o", out});
  for (int i = 0; i < 2000 && !std::filesystem::exists(out + "/points.csv"); ++i) usleep(5000);
  process.send(SIGINT);
  EXPECT_EQ(process.wait(), 130) << process.messages();
  EXPECT_THAT(process.messages(), HasSubstr("interrupted"));
  EXPECT_TRUE(std::filesystem::exists(out + "/points.csv"));
  EXPECT_FALSE(std::filesystem::exists(out + "/study.json"));
}

TEST(CliStudy, ExtremeCasesOfAGroupPassAndAreReported) {
  const Folder folder;
  const std::string out = folder.file("report");
  const Outcome done = run({"study", "--extremes", "--group", "opacity", "-o", out});
  ASSERT_EQ(done.code, 0) << done.out << done.err;
  EXPECT_THAT(done.out, HasSubstr("48 cases, 0 failed"));
  EXPECT_THAT(done.out, HasSubstr("refused: opacity 1.1: /vector/opacity"));
  const Json study = Json::parse(read_file(out + "/study.json"));
  EXPECT_THAT(windsplat::protocol::testing::schema_complaints("study.schema.json", "", study),
              testing::IsEmpty());
  const Json& cases = study.at("extremes").at("cases");
  EXPECT_EQ(cases.size(), 48U);
  for (const Json& one : cases) {
    EXPECT_EQ(one.at("outcome"), one.at("value") > 1 ? "refused" : "good") << one;
    EXPECT_EQ(one.value("truth", "none"), one.at("value") > 1 ? "none" : "integrator");
  }
  EXPECT_EQ(study.at("extremes").at("trust").size(), 3U);
  EXPECT_EQ(study.at("stability").size(), 0U);
  EXPECT_THAT(read_file(out + "/extremes.csv"), HasSubstr("\nopacity,0.5,slab,perspective,flat,"));
  EXPECT_THAT(read_file(out + "/index.html"), HasSubstr("\"extremes\""));
}

TEST(CliStudy, WrongArgumentsAreUsageErrors) {
  const Folder folder;
  const std::string out = folder.file("report");
  for (const Words& words : std::vector<Words>{{"study"},
                                               {"study", "--standard"},
                                               {"study", "--scene", "hard", "-o", out},
                                               {"study", "--extremes"},
                                               {"study", "tornado", "--extremes", "-o", out},
                                               {"study", "--group", "fov", "-o", out},
                                               {"study", "--extremes", "--group", "x", "-o", out},
                                               {"study", "tornado", "--standard", "-o", out},
                                               {"study", "tornado", "--size", "8", "-o", out},
                                               {"study", "--size", "8x8", "-o", out}}) {
    EXPECT_EQ(run(words).code, 2) << words.back();
  }
  EXPECT_EQ(run({"study", "no-such-sample", "-o", out}).code, 1);
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace cli_test
