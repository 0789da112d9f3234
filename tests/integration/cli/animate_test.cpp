// `windsplat animate`: names of the files written, and step and time of each picture.
#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>
#include <set>
#include <string>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using testing::HasSubstr;

const Words small{"--size", "80x60"};

Outcome run_with(Words words, const Words& more) {
  words.insert(words.end(), small.begin(), small.end());
  words.insert(words.end(), more.begin(), more.end());
  return run(words);
}

std::size_t files_like(const Folder& folder, const std::string& ending) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file(""))) {
    count += entry.path().extension() == ending ? 1U : 0U;
  }
  return count;
}

TEST(CliAnimate, EveryFrameEqualsRenderOfItsStep) {
  const Folder folder;
  const std::string path = folder.file("four.nc");
  ASSERT_EQ(run({"synth", "climate", "--dims", "24x12x6", "--steps", "4", "-o", path}).code, 0);
  const Outcome made = run_with({"animate", path, "-o", folder.file("f_%03d.png")}, {});
  EXPECT_EQ(made.code, 0);
  EXPECT_EQ(made.out + made.err, "") << "no progress bar if stderr is not a terminal";
  EXPECT_EQ(files_like(folder, ".png"), 4U);
  std::set<std::string> pictures;
  for (const char* step : {"0", "1", "2", "3"}) {
    const std::string one = folder.file("one.png");
    ASSERT_EQ(run_with({"render", path, "-o", one}, {"--step", step}).code, 0);
    const std::string frame = read_file(folder.file(std::string("f_00") + step + ".png"));
    EXPECT_EQ(frame, read_file(one)) << step;
    pictures.insert(frame);
  }
  EXPECT_EQ(pictures.size(), 4U) << "the steps differ";
}

TEST(CliAnimate, StepsMayStartLaterAndSkip) {
  const Folder folder;
  const std::string path = folder.file("four.nc");
  ASSERT_EQ(run({"synth", "climate", "--dims", "24x12x6", "--steps", "4", "-o", path}).code, 0);
  const Outcome made =
      run_with({"animate", path, "-o", folder.file("100%% %d.jpg")}, {"--steps", "1:3:2"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(files_like(folder, ".jpg"), 2U);
  const std::string last = folder.file("last.jpg");
  ASSERT_EQ(run_with({"render", path, "-o", last}, {"--step", "3"}).code, 0);
  EXPECT_EQ(read_file(folder.file("100% 1.jpg")), read_file(last));
}

// Frame k of N frames per step is at time k / N.
TEST(CliAnimate, FramesBetweenStepsHaveTheirTimes) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "12x12x12");
  const Words phase{"--set", "/vector/motion/mode=phase"};
  Words more = phase;
  more.insert(more.end(), {"--steps", "0:1", "--per-step", "4"});
  const Outcome made = run_with({"animate", path, "-o", folder.file("f_%d.png")}, more);
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(files_like(folder, ".png"), 8U);
  const std::string one = folder.file("one.npy.png");
  more = phase;
  more.insert(more.end(), {"--step", "1", "--set", "/vector/motion/time=0.75"});
  ASSERT_EQ(run_with({"render", path, "-o", one}, more).code, 0);
  EXPECT_EQ(read_file(folder.file("f_7.png")), read_file(one));
}

// Between rendered steps time increases uniformly, by the stride, from the time of the view.
TEST(CliAnimate, TimesContinueFromTheViewsTimeAcrossAStride) {
  const Folder folder;
  const std::string path = folder.file("four.nc");
  ASSERT_EQ(run({"synth", "tornado", "--dims", "12x12x12", "--steps", "4", "-o", path}).code, 0);
  const Words phase{"--set", "/vector/motion/mode=phase", "--set", "/vector/motion/rate=0.3"};
  Words more = phase;
  more.insert(more.end(), {"--set", "/vector/motion/time=0.5"});
  more.insert(more.end(), {"--steps", "0:2:2", "--per-step", "4"});
  const Outcome made = run_with({"animate", path, "-o", folder.file("f_%d.png")}, more);
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(files_like(folder, ".png"), 8U);
  struct Case {
    const char* frame;
    const char* step;
    const char* time;
  };
  for (const Case& each : {Case{"f_0.png", "0", "0.5"}, Case{"f_3.png", "0", "2"},
                           Case{"f_4.png", "2", "0.5"}, Case{"f_5.png", "2", "1"}}) {
    const std::string one = folder.file("one.nc.png");
    more = phase;
    more.insert(more.end(), {"--step", each.step, "--set"});
    more.push_back(std::string("/vector/motion/time=") + each.time);
    ASSERT_EQ(run_with({"render", path, "-o", one}, more).code, 0);
    EXPECT_EQ(read_file(folder.file(each.frame)), read_file(one)) << each.frame;
  }
}

// The signal may arrive during any frame: every existing file must be complete.
TEST(CliAnimate, SignalStopsBetweenWholeFiles) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const Folder folder;
    const std::string path = synth(folder, "tornado", "12x12x12");
    Process process({"animate", path, "-o", folder.file("f_%d.png"), "--size", "320x240", "--set",
                     "/vector/motion/mode=phase", "--per-step", "1000"});
    for (int n = 0; n < 30000 && !std::filesystem::exists(folder.file("f_1.png")); ++n) {
      usleep(2000);
    }
    process.send(signal);
    EXPECT_EQ(process.wait(), 130);
    EXPECT_THAT(process.messages(), HasSubstr("interrupted"));
    for (const auto& entry : std::filesystem::directory_iterator(folder.file(""))) {
      if (entry.path() == path) continue;
      const std::string bytes = read_file(entry.path().string());
      EXPECT_EQ(entry.path().extension(), ".png") << entry.path();
      ASSERT_GT(bytes.size(), 8U) << entry.path();
      EXPECT_EQ(png_size(bytes), (std::pair<std::uint32_t, std::uint32_t>(320, 240)));
      EXPECT_EQ(bytes.substr(bytes.size() - 8, 4), "IEND") << entry.path();
    }
    EXPECT_LT(files_like(folder, ".png"), 2000U);
  }
}

TEST(CliAnimate, StopsAtTheFirstErrorAndNamesIt) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "8x8x8");
  const Outcome refused =
      run_with({"animate", path, "-o", folder.file("f_%d.png")}, {"--set", "/vector/field=nope"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("/vector/field"));
  EXPECT_EQ(files_like(folder, ".png"), 0U);
  const Outcome nowhere = run_with({"animate", path, "-o", folder.file("no/f_%d.png")}, {});
  EXPECT_EQ(nowhere.code, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("f_0.png"));
}

TEST(CliAnimate, SkipsUnnecessaryRendering) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "8x8x8");
  const Outcome refused =
      run_with({"animate", path, "-o", folder.file("f_%d.png")}, {"--per-step", "3"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("/vector/motion/mode=phase"));
  const Outcome without_lines = run_with(
      {"animate", path, "-o", folder.file("f_%d.png")},
      {"--per-step", "3", "--set", "/vector/motion/mode=phase", "--set", "/vector/field=null"});
  EXPECT_EQ(without_lines.code, 2);
  EXPECT_THAT(without_lines.err, HasSubstr("lines"));
  EXPECT_EQ(files_like(folder, ".png"), 0U);
}

}  // namespace
}  // namespace cli_test
