// --minus and --minus-step: pictures of differences on the command line.
#include <gmock/gmock.h>

#include <string>

#include "tests/integration/cli_program.hpp"
#include "tests/integration/difference_files.hpp"

namespace cli_test {
namespace {

namespace files = difference_files;
using testing::HasSubstr;

class CliDifferences : public testing::Test {
 protected:
  void SetUp() override {
    files::write(folder_.file("a.nc"), files::first);
    files::write(folder_.file("b.nc"), files::second);
    write_file(folder_.file("view.json"), files::explicit_view);
  }
  // The picture of the view with further arguments.
  std::string drawn(const std::string& file, const Words& more = {}) {
    Words words{"render", folder_.file(file),     "--view", folder_.file("view.json"),
                "-o",     folder_.file("out.npy")};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return read_file(folder_.file("out.npy"));
  }
  Outcome refused(const Words& more) {
    Words words{"render", folder_.file("a.nc"), "-o", folder_.file("out.npy")};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }

  Folder folder_;
};

TEST_F(CliDifferences, AreThePicturesOfAFileThatContainsThem) {
  files::write(folder_.file("datasets.nc"), files::minus(files::first, files::second));
  files::write(folder_.file("steps.nc"),
               files::minus(files::first, files::at_step(files::first, 1)));
  EXPECT_TRUE(drawn("a.nc", {"--minus", folder_.file("b.nc")}) == drawn("datasets.nc"));
  EXPECT_TRUE(drawn("a.nc", {"--minus-step", "1"}) == drawn("steps.nc"));
  EXPECT_TRUE(drawn("a.nc", {"--set", "/difference/step=1"}) == drawn("steps.nc"));
  EXPECT_FALSE(drawn("a.nc") == drawn("steps.nc"));
  const std::string reference = "/method/name=reference";
  EXPECT_TRUE(drawn("a.nc", {"--minus-step", "1", "--set", reference}) ==
              drawn("steps.nc", {"--set", reference}));
}

TEST_F(CliDifferences, AnimateSubtractsTheSameStepFromEach) {
  const Outcome outcome = run({"animate", folder_.file("a.nc"), "--view", folder_.file("view.json"),
                               "--minus-step", "0", "-o", folder_.file("f_%d.npy")});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(read_file(folder_.file("f_2.npy")) ==
              drawn("a.nc", {"--minus-step", "0", "--step", "2"}));
}

TEST_F(CliDifferences, AreRefusedForOtherGridsAndStepsAndUnnamedDatasets) {
  files::write(folder_.file("high.nc"), files::second, 600);
  const Outcome grids = refused({"--minus", folder_.file("high.nc")});
  EXPECT_EQ(grids.code, 2);
  EXPECT_THAT(grids.err, HasSubstr("the grids differ along z ('z'): sample 1 is at 500 here, at "
                                   "600 in 'high'"));
  const Outcome step = refused({"--minus-step", "3"});
  EXPECT_EQ(step.code, 2);
  EXPECT_THAT(step.err, HasSubstr("/difference/step"));
  const Outcome unnamed = refused({"--set", "/difference/dataset=b"});
  EXPECT_EQ(unnamed.code, 2);
  EXPECT_THAT(unnamed.err, HasSubstr("by --minus"));
}

}  // namespace
}  // namespace cli_test
