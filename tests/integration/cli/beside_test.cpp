// --beside, --beside-step and --beside-set: files of two pictures on the command line.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>

#include "tests/integration/cli_program.hpp"
#include "tests/integration/difference_files.hpp"

namespace cli_test {
namespace {

namespace files = difference_files;
using testing::HasSubstr;

class CliBeside : public testing::Test {
 protected:
  void SetUp() override {
    files::write(folder_.file("a.nc"), files::first);
    files::write(folder_.file("b.nc"), files::second);
  }
  Outcome windsplat(const char* command, const Words& more) {
    Words words{command, folder_.file("a.nc"), "--size", "120x80"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  std::string drawn(const Words& more) {
    Words words = more;
    words.insert(words.end(), {"-o", folder_.file("one.png")});
    const Outcome outcome = windsplat("render", words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return read_file(folder_.file("one.png"));
  }

  Folder folder_;
};

TEST_F(CliBeside, AnimateMovesBothPicturesUnlessOneKeepsItsStep) {
  const std::string b = folder_.file("b.nc");
  for (const Words& beside : {Words{"--beside", b}, Words{"--beside-step", "0"}}) {
    Words words = beside;
    words.insert(words.end(), {"-o", folder_.file("f_%d.png"), "--report", folder_.file("r")});
    const Outcome outcome = windsplat("animate", words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    words = beside;
    words.insert(words.end(), {"--step", "2"});
    EXPECT_TRUE(read_file(folder_.file("f_2.png")) == drawn(words)) << beside[0];
    const std::string reports = read_file(folder_.file("r"));
    EXPECT_EQ(std::count(reports.begin(), reports.end(), '\n'), 6) << "two a frame";
  }
}

TEST_F(CliBeside, SubtractsFromBothPictures) {
  EXPECT_FALSE(drawn({"--beside-step", "1", "--minus-step", "0"}) == drawn({"--beside-step", "1"}));
  const Outcome unnamed =
      windsplat("render", {"--beside-set", "/difference/dataset=b", "-o", folder_.file("x.png")});
  EXPECT_EQ(unnamed.code, 2);
  EXPECT_THAT(unnamed.err, HasSubstr("of the picture beside"));
}

TEST_F(CliBeside, IsRefusedAsAnArray) {
  const Outcome outcome = windsplat("render", {"--beside-step", "1", "-o", folder_.file("x.npy")});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr(".npy file holds one picture"));
}

}  // namespace
}  // namespace cli_test
