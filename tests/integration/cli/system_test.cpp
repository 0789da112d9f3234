// The program with full or shared outputs, resource limits, signals and links.
#include <gmock/gmock.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

// Runs `command` in a shell, where $W is the program; returns stdout, stderr and the exit code as
// one string.
std::string shell(const std::string& command) {
  const std::string line = "W='" WINDSPLAT_PROGRAM "'; { " + command + "; echo \"exit $?\"; } 2>&1";
  FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) return "no shell";
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t got = fread(buffer.data(), 1, buffer.size(), pipe)) {
    text.append(buffer.data(), got);
  }
  pclose(pipe);
  return text;
}

TEST(CliSystem, EmptyValueIsNotTheDefault) {
  const Folder folder;
  const std::string picture = folder.file("x.png");
  const std::vector<Words> empty{{"render", "climate", "-o", picture, "--size", ""},
                                 {"render", "climate", "-o", picture, "--step", ""},
                                 {"render", "climate", "-o", picture, "--view="},
                                 {"render", "climate", "-o", picture, "--view", ""},
                                 {"render", "climate", "-o", picture, "--report", ""},
                                 {"render", "climate", "-o", ""},
                                 {"animate", "climate", "-o", folder.file("%d.png"), "--steps", ""},
                                 {"synth", "climate", "-o", folder.file("x.nc"), "--dims", ""},
                                 {"study", "", "-o", folder.file("study")},
                                 {"healthcheck", "http://127.0.0.1:1/", "--ca", ""},
                                 {"serve", "--token-file", ""},
                                 {"serve", "--state-dir", ""},
                                 {"serve", "--allow-host", ""},
                                 {"serve", "--config", ""},
                                 {"serve", ""}};
  for (const Words& words : empty) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2) << words[0] << ' ' << words.back() << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_THAT(run({"render", "climate", "-o", picture, "--size", ""}).err,
              HasSubstr("--size has an empty value"));
}

TEST(CliSystem, FailedPrintIsAnError) {
  for (const char* words :
       {"--help", "--version", "render --help", "inspect tornado:8", "inspect tornado:8 --json"}) {
    const std::string full = shell(std::string("$W ") + words + " >/dev/full");
    EXPECT_THAT(full, HasSubstr("exit 1\n")) << words;
    EXPECT_THAT(full, HasSubstr("cannot write to stdout: No space left on device")) << words;
    EXPECT_THAT(shell(std::string("$W ") + words), HasSubstr("exit 0\n")) << words;
  }
}

TEST(CliStudy, FailedPrintIsAnError) {
  const Folder folder;
  const std::string study = shell("$W study tornado:8 --quick --no-reference --no-calibration -o " +
                                  folder.file("study") + " >/dev/full");
  EXPECT_THAT(study, HasSubstr("exit 1\n"));
  EXPECT_THAT(study, HasSubstr("cannot write to stdout: No space left on device"));
}

TEST(CliSystem, PictureIsWrittenThroughLinksStreamsAndStdout) {
  const Folder folder;
  const std::string draw = "$W render tornado:8 --size 16x16 -o ";
  fs::create_symlink("target.png", folder.file("link.png"));
  EXPECT_EQ(shell(draw + folder.file("link.png")), "exit 0\n");
  EXPECT_TRUE(fs::is_symlink(folder.file("link.png")));
  const std::string picture = read_file(folder.file("target.png"));
  EXPECT_EQ(png_size(picture), (std::pair<std::uint32_t, std::uint32_t>{16, 16}));

  const std::string log = folder.file("log");
  shell("{ printf before; " + draw + "/dev/stdout; printf after; } >" + log);
  EXPECT_EQ(read_file(log), "before" + picture + "after");
  shell("mkfifo " + folder.file("pipe") + "; timeout 30 cat " + folder.file("pipe") + " >" +
        folder.file("read") + " & " + draw + folder.file("pipe") + "; wait");
  EXPECT_EQ(read_file(folder.file("read")), picture);
  EXPECT_THAT(shell(draw + folder.file("without-ending")), HasSubstr("must end in"));
}

std::string part_of(const Process& process, const std::string& path) {
  return path + "." + std::to_string(process.id()) + ".part";
}

bool begins_to_write(const Process& process, const std::string& path) {
  const std::string part = part_of(process, path);
  for (int i = 0; i < 6000 && !fs::exists(part); ++i) usleep(10'000);
  return fs::exists(part);
}

TEST(CliSystem, InterruptedSynthLeavesNoFile) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const Folder folder;
    const std::string path = folder.file("large.nc");
    Process process({"synth", "tornado", "--dims", "96x96x96", "--steps", "100000", "-o", path});
    ASSERT_TRUE(begins_to_write(process, path)) << process.messages();
    process.send(signal);
    EXPECT_EQ(process.wait(), 130);
    EXPECT_THAT(process.messages(), HasSubstr("interrupted"));
    EXPECT_TRUE(fs::is_empty(fs::path(path).parent_path()));
  }
}

TEST(CliSystem, SynthInterruptedTwiceLeavesNoFile) {
  for (int n = 0; n < 5; ++n) {
    const Folder folder;
    const std::string path = folder.file("large.nc");
    Process process({"synth", "tornado", "--dims", "96x96x96", "--steps", "100000", "-o", path});
    ASSERT_TRUE(begins_to_write(process, path)) << process.messages();
    process.send(SIGINT);
    process.send(SIGTERM);  // a second SIGINT would be merged with a pending one
    EXPECT_EQ(process.wait(), 130);
    EXPECT_TRUE(fs::is_empty(fs::path(path).parent_path()));
  }
}

TEST(CliSystem, SynthInterruptedTwiceLeavesFilesOfOthers) {
  const Folder folder;
  const std::string path = folder.file("large.nc");
  const std::vector<std::string> words{"synth",   "tornado", "--dims", "96x96x96",
                                       "--steps", "100000",  "-o",     path};
  Process other(words);
  ASSERT_TRUE(begins_to_write(other, path)) << other.messages();
  Process process(words);
  ASSERT_TRUE(begins_to_write(process, path)) << process.messages();
  process.send(SIGINT);
  process.send(SIGTERM);
  EXPECT_EQ(process.wait(), 130);
  EXPECT_TRUE(fs::exists(part_of(other, path)));
  other.send(SIGINT);
  EXPECT_EQ(other.wait(), 130);
}

TEST(CliSystem, SynthDoesNotReplaceAPipe) {
  const Folder folder;
  const std::string pipe = folder.file("pipe.nc");
  shell("mkfifo " + pipe);
  const Outcome refused = run({"synth", "climate", "--dims", "8x8x4", "-o", pipe});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("not a regular file"));
  EXPECT_TRUE(fs::is_fifo(pipe));
}

#ifndef WINDSPLAT_SANITIZED  // its shadow memory needs terabytes of address space
// 512 threads need more than remains, whatever the libraries use.
TEST(CliSystem, InsufficientAddressSpaceIsReported) {
  const std::string text =
      shell("ulimit -v 300000; timeout 30 $W serve --threads 512 --listen 127.0.0.1:0 tornado:8");
  EXPECT_THAT(text, HasSubstr("exit 1\n"));
  EXPECT_THAT(text, HasSubstr("out of memory"));
  EXPECT_THAT(text, HasSubstr("300000 KiB of address space, ulimit -v"));
  EXPECT_THAT(text, Not(HasSubstr("internal error")));
}
#endif

}  // namespace
}  // namespace cli_test
