// `windsplat animate` to movies: their pictures, turns and paths of the camera, and what is left
// after failures. A program in place of ffmpeg copies what it gets.
#include <gmock/gmock.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/integration/cli_program.hpp"
#include "tests/unit/movie/movie_files.hpp"

namespace cli_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using windsplat::movie::testing::copies_input;
using windsplat::movie::testing::MovieFolder;
using windsplat::movie::testing::put_ffmpeg;

Words with_size(Words words, const Words& more = {}) {
  words.insert(words.end(), {"--size", "80x60"});
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// Extracts a ZIP into the folder by Python.
void unzip(const std::string& zip, const std::string& folder) {
  EXPECT_EQ(std::system(("python3 -m zipfile -e " + zip + " " + folder).c_str()), 0);
}

std::string series(const Folder& folder) {
  std::string path = folder.file("four.nc");
  EXPECT_EQ(run({"synth", "climate", "--dims", "24x12x6", "--steps", "4", "-o", path}).code, 0);
  return path;
}

TEST(CliMovie, AnArchiveHoldsThePicturesOfRenderAndSoDoesStdout) {
  const Folder folder;
  const std::string path = series(folder);
  const std::string zip = folder.file("out.zip");
  const Outcome made = run(with_size({"animate", path, "-o", zip}));
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.out + made.err, "") << "no progress if stderr is not a terminal";
  unzip(zip, folder.file("pictures"));
  for (const char* step : {"0", "3"}) {
    const std::string one = folder.file("one.png");
    ASSERT_EQ(run(with_size({"render", path, "--step", step, "-o", one})).code, 0);
    EXPECT_EQ(read_file(folder.file(std::string("pictures/frame_00000") + step + ".png")),
              read_file(one))
        << step;
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("pictures/frame_000004.png")));
  const Outcome piped = run(with_size({"animate", path, "--output", "-", "--format", "zip"}));
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_EQ(piped.out, read_file(zip));
}

TEST(CliMovie, FfmpegGetsThePicturesOfBothPanels) {
  const Folder folder;
  const MovieFolder tools;
  put_ffmpeg(tools, copies_input);
  const std::string path = series(folder);
  const std::string out = folder.file("out.mp4");
  const Words search{"PATH=" + tools.path() + ":/usr/bin:/bin"};
  const Outcome made =
      run(with_size({"animate", path, "-o", out, "--fps", "7.5"}, {"--beside-step", "1"}), search);
  ASSERT_EQ(made.code, 0) << made.err;
  // Two pictures of 80 columns and a line of 2.
  EXPECT_EQ(read_file(out).size(), 4U * 162 * 60 * 3);
  EXPECT_THAT(tools.text("noted"), HasSubstr(R"("-video_size", "162x60", "-framerate", "7.5")"));
  // The frame of step 1 has the same picture on both sides, without title and time.
  const Outcome plain = run(with_size({"animate", path, "-o", out, "--steps", "1:1"},
                                      {"--beside-step", "1", "--set", "/annotations/title=false",
                                       "--set", "/annotations/stepTime=false"}),
                            search);
  ASSERT_EQ(plain.code, 0) << plain.err;
  const std::string rgb = read_file(out);
  ASSERT_EQ(rgb.size(), 162U * 60 * 3);
  for (std::size_t y = 0; y < 60; ++y) {
    EXPECT_EQ(rgb.substr(y * 486, 240), rgb.substr(y * 486 + 246, 240)) << y;
  }
}

TEST(CliMovie, AMissingFfmpegIsSaidBeforeAnythingIsDrawn) {
  const Folder folder;
  const std::string path = series(folder);
  const Outcome made =
      run(with_size({"animate", path, "-o", folder.file("out.webm")}), {"PATH=/nonexistent"});
  EXPECT_EQ(made.code, 2);
  EXPECT_THAT(made.err, AllOf(HasSubstr("install the package ffmpeg"), HasSubstr(".zip")));
}

// A whole turn shows what the resting camera shows, and half a turn does not.
TEST(CliMovie, ATurnMovesTheCameraOfOneStep) {
  const Folder folder;
  const std::string path = series(folder);
  const Words camera{"--set",    "/camera/eye=[0,-3,1]",
                     "--set",    "/camera/target=[0,0,0]",
                     "--steps",  "2:2",
                     "--frames", "4"};
  const auto frames = [&](const char* degrees) {
    Words words = with_size({"animate", path, "-o", folder.file("f_%d.png"), "--turn", degrees});
    words.insert(words.end(), camera.begin(), camera.end());
    const Outcome made = run(words);
    EXPECT_EQ(made.code, 0) << made.err;
    Words out;
    for (int n = 0; n < 4; ++n) {
      out.push_back(read_file(folder.file("f_" + std::to_string(n) + ".png")));
    }
    return out;
  };
  const std::string still = folder.file("still.png");
  ASSERT_EQ(run(with_size({"render", path, "--step", "2", "-o", still},
                          {"--set", "/camera/eye=[0,-3,1]", "--set", "/camera/target=[0,0,0]"}))
                .code,
            0);
  const Words twice = frames("720");
  EXPECT_TRUE(twice[0] == read_file(still));
  EXPECT_TRUE(twice[2] == twice[0]) << "360 degrees";
  EXPECT_FALSE(twice[1] == twice[0]);
  const Words half = frames("-180");
  EXPECT_TRUE(half[0] == twice[0]);
  EXPECT_FALSE(half[3] == half[2]);
}

TEST(CliMovie, APathOfTheCameraPassesItsKeyframesInSecondsAndSteps) {
  const Folder folder;
  const std::string path = series(folder);
  const auto camera = [](const std::string& eye) {
    return R"(, "camera": {"eye": )" + eye + R"(, "target": [0.1, 0, 0]}})";
  };
  write_file(folder.file("time.json"), R"({"keyframes": [{"time": 0)" + camera("[0, -3, 1]") +
                                           R"(, {"time": 1.5)" + camera("[2, -1, 1.5]") + "]}");
  write_file(folder.file("step.json"), R"({"keyframes": [{"step": 0)" + camera("[0, -3, 1]") +
                                           R"(, {"step": 3)" + camera("[2, -1, 1.5]") + "]}");
  const std::string still = folder.file("still.png");
  ASSERT_EQ(run(with_size({"render", path, "--step", "3", "-o", still},
                          {"--set", "/camera/eye=[2,-1,1.5]", "--set", "/camera/target=[0.1,0,0]"}))
                .code,
            0);
  // 1.5 s at 2 pictures a second: frames 0 to 3, one for each step.
  const Outcome by_time = run(with_size({"animate", path, "-o", folder.file("t_%d.png")},
                                        {"--path", folder.file("time.json"), "--fps", "2"}));
  ASSERT_EQ(by_time.code, 0) << by_time.err;
  EXPECT_EQ(read_file(folder.file("t_3.png")), read_file(still));
  EXPECT_FALSE(std::filesystem::exists(folder.file("t_4.png")));
  const std::string command = std::string(WINDSPLAT_PROGRAM) + " animate " + path +
                              " --size 80x60 --path - -o " + folder.file("s_%d.png") + " < " +
                              folder.file("step.json");
  ASSERT_EQ(std::system(command.c_str()), 0) << "the path from standard input";
  EXPECT_EQ(read_file(folder.file("s_3.png")), read_file(still));
  EXPECT_EQ(read_file(folder.file("s_0.png")), read_file(folder.file("t_0.png")));
  write_file(folder.file("bad.json"), R"({"keyframes": [{"time": 0, "camera": {"eye": [1, 1]}}]})");
  const Outcome bad = run(with_size({"animate", path, "-o", folder.file("b_%d.png")},
                                    {"--path", folder.file("bad.json")}));
  EXPECT_EQ(bad.code, 2);
  EXPECT_THAT(bad.err, AllOf(HasSubstr("bad.json"), HasSubstr("/keyframes")));
}

// Frame k of N frames has the part k * steps / N of the series, and phase motion goes on between.
TEST(CliMovie, FramesAreSpreadOverTheSteps) {
  const Folder folder;
  const std::string path = series(folder);
  const Words phase{"--set", "/vector/motion/mode=phase"};
  Words more{"--frames", "8"};
  more.insert(more.end(), phase.begin(), phase.end());
  ASSERT_EQ(run(with_size({"animate", path, "-o", folder.file("f_%d.png")}, more)).code, 0);
  more = {"--per-step", "2"};
  more.insert(more.end(), phase.begin(), phase.end());
  ASSERT_EQ(run(with_size({"animate", path, "-o", folder.file("p_%d.png")}, more)).code, 0);
  for (const char* n : {"0", "1", "6", "7"}) {
    EXPECT_EQ(read_file(folder.file(std::string("f_") + n + ".png")),
              read_file(folder.file(std::string("p_") + n + ".png")));
  }
  ASSERT_EQ(
      run(with_size({"animate", path, "-o", folder.file("h_%d.png")}, {"--frames", "2"})).code, 0);
  const std::string still = folder.file("still.png");
  ASSERT_EQ(run(with_size({"render", path, "--step", "2", "-o", still})).code, 0);
  EXPECT_EQ(read_file(folder.file("h_1.png")), read_file(still));
}

TEST(CliMovie, OptionsWithoutEffectAndOutputsOfNoKindAreRefused) {
  const Folder folder;
  const std::string path = series(folder);
  struct Case {
    Words words;
    const char* message;
  };
  for (const Case& each : {
           Case{{"-o", "x.gif"}, ".mp4, .webm or .zip"},
           Case{{"-o", "x_%d.zip"}, "no number"},
           Case{{"-o", "-"}, "--format"},
           Case{{"-o", "x.zip", "--format", "mp4"}, "--format"},
           Case{{"-o", "f_%d.png", "--format", "mp4"}, "--format"},
           Case{{"-o", "f_%d.png", "--fps", "3"}, "--fps"},
           Case{{"-o", "x.zip", "--fps", "nan"}, "--fps"},
           Case{{"-o", "x.zip", "--turn", "inf"}, "--turn"},
           Case{{"-o", "x.zip", "--turn", "1", "--path", "p.json"}, "--path"},
           Case{{"-o", "x.zip", "--frames", "9"}, "--frames: more pictures"},
           Case{{"-o", "x.zip", "--set", "/quality/maxError=0.1"}, "/quality"},
           Case{{"-o", "-", "--format", "zip", "--report", "-"}, "stdout is used by -o"},
           Case{{"-o", "x.zip", "--view", "-", "--path", "-"}, "stdin is used by --view"},
       }) {
    Words words{"animate", path};
    words.insert(words.end(), each.words.begin(), each.words.end());
    const Outcome refused = run(with_size(words));
    EXPECT_EQ(refused.code, 2) << each.words[1];
    EXPECT_THAT(refused.err, HasSubstr(each.message));
    EXPECT_EQ(refused.out, "");
  }
}

// Ctrl-C leaves no part of a movie.
TEST(CliMovie, AnInterruptedMovieIsRemoved) {
  const Folder folder;
  const std::string path = series(folder);
  std::filesystem::create_directory(folder.file("out"));
  Process process(with_size({"animate", path, "-o", folder.file("out/movie.zip")},
                            {"--turn", "360", "--frames", "100000"}));
  const auto is_begun = [&] { return !std::filesystem::is_empty(folder.file("out")); };
  for (int n = 0; n < 30000 && !is_begun(); ++n) usleep(2000);
  ASSERT_TRUE(is_begun());
  process.send(SIGINT);
  EXPECT_EQ(process.wait(), 130);
  EXPECT_THAT(process.messages(), HasSubstr("interrupted after"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.file("out")));
}

TEST(CliMovie, QuietWritesErrorsOnlyAndVerboseWhatWasDone) {
  const Folder folder;
  const std::string path = series(folder);
  const Words empty{"--set", "/vector/minMagnitude=1e30", "--set", "/scalars=[]"};
  const auto messages = [&](const char* option) {
    Words words = with_size({"animate", path, "-o", folder.file("out.zip")}, empty);
    if (*option != '\0') words.emplace_back(option);
    const Outcome made = run(words);
    EXPECT_EQ(made.code, 0) << made.err;
    return made.err;
  };
  EXPECT_THAT(messages(""),
              AllOf(HasSubstr("nothing of the data"), Not(HasSubstr("4 pictures in"))));
  EXPECT_THAT(messages("-v"), AllOf(HasSubstr("nothing of the data"), HasSubstr("4 pictures in")));
  EXPECT_THAT(messages("--quiet"), IsEmpty());
  const Outcome both = run(with_size({"animate", path, "-o", folder.file("out.zip"), "-q", "-v"}));
  EXPECT_EQ(both.code, 2);
}

// Stderr is a terminal of Python's.
TEST(CliMovie, ATerminalShowsProgressWithTheTimeLeft) {
  const Folder folder;
  const std::string path = series(folder);
  write_file(folder.file("terminal.py"), R"(
import os, pty, subprocess, sys
ours, theirs = pty.openpty()
process = subprocess.Popen(sys.argv[1:], stderr=theirs)
os.close(theirs)
text = b""
while True:
    try:
        more = os.read(ours, 4096)
    except OSError:
        break
    if not more:
        break
    text += more
sys.stdout.write(text.decode())
sys.exit(process.wait())
)");
  const auto shown = [&](const std::string& option) {
    const std::string command = "python3 " + folder.file("terminal.py") + " " + WINDSPLAT_PROGRAM +
                                " animate " + path + " --size 320x240 --turn 360 --frames 60 -o " +
                                folder.file("out.zip") + " " + option + " > " +
                                folder.file("shown");
    EXPECT_EQ(std::system(command.c_str()), 0);
    return read_file(folder.file("shown"));
  };
  EXPECT_THAT(shown(""),
              AllOf(HasSubstr(" left  "), HasSubstr(" of 60 pictures"), HasSubstr(" %")));
  EXPECT_EQ(shown("-q"), "");
}

}  // namespace
}  // namespace cli_test
