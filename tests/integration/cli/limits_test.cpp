// Time budget and error bound of the views of `windsplat render` and `windsplat animate`.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class CliLimits : public testing::Test {
 protected:
  CliLimits() {
    const Outcome made =
        run({"synth", "climate", "--dims", "24x12x6", "--steps", "2", "-o", path_});
    EXPECT_EQ(made.code, 0) << made.err;
  }

  // Report of a picture of the view; `err` receives stderr.
  json report_of(const Words& more, std::string* err = nullptr) {
    Words words{"render", path_, "-o", folder_.file("a.jpg"), "--report", "-"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    if (err != nullptr) *err = outcome.err;
    return json::parse(outcome.out);
  }

  Folder folder_;
  std::string path_ = folder_.file("two.nc");
};

TEST_F(CliLimits, RenderMeasuresTheErrorThatItReports) {
  const json report = report_of({"--size", "160x120"});
  EXPECT_EQ(report["error"]["kind"], "measured");
  EXPECT_GT(report["error"]["value"], 0);
  EXPECT_LT(report["error"]["value"], 0.01) << "slabs of one cell";
  EXPECT_GT(report["jpegError"], 0);
}

TEST_F(CliLimits, RenderKeepsTheErrorBoundOfTheView) {
  const json whole = report_of({"--size", "192x128"});
  const double own = whole["error"]["value"];
  for (const double most : {0.1, 0.02, 0.5 * own}) {
    std::string err;
    const json report = report_of(
        {"--size", "192x128", "--set", "/quality/maxError=" + std::to_string(most)}, &err);
    EXPECT_THAT(report["error"]["kind"], testing::AnyOf("measured", "estimated")) << most;
    EXPECT_LE(report["error"]["value"], most);
    EXPECT_EQ(err, "") << most;
    // A large error is allowed, and faster settings than the view's own are used.
    if (most > 0.05) {
      EXPECT_EQ(report["method"], "kernel");
    }
    if (most < own) {
      EXPECT_LT(report["slabThickness"], whole["slabThickness"]);
    }
  }
}

TEST_F(CliLimits, RenderSaysThatTheErrorBoundCannotBeKept) {
  std::string err;
  const json report = report_of({"--size", "96x72", "--set", "/quality/maxError=0.000005"}, &err);
  EXPECT_GT(report["error"]["value"], 5e-6);
  EXPECT_THAT(err, HasSubstr("exceeds /quality/maxError 5e-06"));
}

TEST_F(CliLimits, RenderSaysWhyThePictureIsEmpty) {
  std::string err;
  const json report = report_of(
      {"--size", "96x72", "--set", "/scalars=[]", "--set", "/vector/minMagnitude=1000000"}, &err);
  const std::string reason = report.at("empty");
  EXPECT_THAT(reason, HasSubstr("below /vector/minMagnitude 1e+06"));
  EXPECT_EQ(err, "windsplat: the picture shows nothing of the data: " + reason + "\n");
  EXPECT_FALSE(report_of({"--size", "96x72"}).contains("empty"));
}

TEST_F(CliLimits, RenderChoosesTheSettingByTheTimeBudget) {
  const json ample = report_of({"--size", "640x480", "--set", "/quality/budgetMs=10000"});
  EXPECT_EQ(ample["width"], 640);
  EXPECT_EQ(ample["method"], "slab");
  std::string err;
  const json tight = report_of({"--size", "640x480", "--set", "/quality/budgetMs=1"}, &err);
  EXPECT_LT(tight["width"], 640);
  EXPECT_NE(tight["error"]["kind"], "none");
  const double ms = tight["renderMs"].get<double>() + tight["encodeMs"].get<double>();
  if (ms > 1) {
    EXPECT_THAT(err, HasSubstr("ms exceeds /quality/budgetMs 1"));
  }
}

TEST_F(CliLimits, ReferenceRefusesATimeBudget) {
  const Outcome refused = run({"render", path_, "--size", "16x12", "-o", folder_.file("a.png"),
                               "--set", "/method/name=reference", "--set", "/quality/budgetMs=50"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("/quality/budgetMs"));
}

TEST_F(CliLimits, AnimateKeepsTheErrorBoundAndReportsEveryPicture) {
  const Outcome made = run({"animate", path_, "--size", "192x128", "-o", folder_.file("f_%d.jpg"),
                            "--set", "/quality/maxError=0.02", "--report", "-"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.err, "");
  std::istringstream lines(made.out);
  std::string line;
  int count = 0;
  for (; std::getline(lines, line); ++count) {
    const json report = json::parse(line);
    EXPECT_NE(report["error"]["kind"], "none");
    EXPECT_LE(report["error"]["value"], 0.02);
  }
  EXPECT_EQ(count, 2);
}

}  // namespace
}  // namespace cli_test
