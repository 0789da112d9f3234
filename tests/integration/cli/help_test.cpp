// What the program tells about itself: help, suggestions, completions, manual pages.
#include <gmock/gmock.h>

#include <cstdlib>
#include <regex>
#include <set>
#include <string>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

const Words commands{"serve",       "render", "animate", "inspect", "synth",
                     "healthcheck", "study",  "help",    "man",     "completions"};

// Runs a command line of a shell: exit code and both outputs.
std::pair<int, std::string> shell(const Folder& folder, const std::string& line) {
  const int status = std::system(("( " + line + " ) > " + folder.file("said") + " 2>&1").c_str());
  return {status, read_file(folder.file("said"))};
}

bool is_installed(const Folder& folder, const std::string& program) {
  return shell(folder, "command -v " + program).first == 0;
}

// "--size" and so on, as help lists them.
std::set<std::string> options_in(const std::string& text) {
  const std::regex option(R"((^|[ ,])(--[a-z0-9][a-z0-9-]*))");
  std::set<std::string> out;
  for (std::sregex_iterator at(text.begin(), text.end(), option), end; at != end; ++at) {
    out.insert((*at)[2]);
  }
  return out;
}

TEST(CliHelp, HelpIsThatOfTheCommand) {
  EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
  for (const std::string& command : commands) {
    const Outcome help = run({"help", command});
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_EQ(help.out, run({command, "--help"}).out) << command;
  }
  const Outcome unknown = run({"help", "animat"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_EQ(unknown.err, "windsplat: unknown command 'animat'; did you mean 'animate'?\n");
}

TEST(CliHelp, MisspeltWordsAreSuggested) {
  EXPECT_THAT(run({"rendr", "tornado"}).err,
              StartsWith("windsplat: unknown command 'rendr'; did you mean 'render'?\n"));
  EXPECT_THAT(
      run({"render", "tornado", "--ouput", "x.png"}).err,
      StartsWith("windsplat: '--ouput' is not an option of 'render'; did you mean --output?\n"))
      << "although the required option lacks";
  EXPECT_THAT(run({"render", "tornadoo", "-o", "x.png"}).err,
              HasSubstr("no such file; did you mean 'tornado'? The built-in samples are"));
  const auto set = [](const char* setting) {
    return run({"render", "tornado:8", "-o", "x.png", "--set", setting}).err;
  };
  EXPECT_THAT(set("/vector/colour/by=magnitude"),
              HasSubstr("/vector/colour: unknown key; did you mean 'color'? Known keys: field"));
  EXPECT_THAT(set("/vector/color/by=magnitud"), HasSubstr("did you mean 'magnitude'?"));
  EXPECT_THAT(set("/banana=1"),
              AllOf(HasSubstr("unknown key; known keys: "), Not(HasSubstr("mean"))));
}

TEST(CliHelp, BashCompletesCommandsOptionsAndValues) {
  const Folder folder;
  const Outcome script = run({"completions", "bash"});
  ASSERT_EQ(script.code, 0) << script.err;
  write_file(folder.file("windsplat.bash"), script.out);
  write_file(folder.file("view.json"), "{}");
  const auto completed = [&](const std::string& words) {
    const auto said = shell(folder, "cd " + folder.file("") +
                                        " && bash -c 'source ./windsplat.bash; "
                                        "COMP_WORDS=(" +
                                        words +
                                        "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); "
                                        "_windsplat; echo ${COMPREPLY[@]}'");
    EXPECT_EQ(said.first, 0) << said.second;
    return said.second;
  };
  EXPECT_EQ(completed("windsplat ren"), "render\n");
  EXPECT_THAT(completed("windsplat \"\""), AllOf(HasSubstr("animate"), HasSubstr("--version")));
  EXPECT_EQ(completed("windsplat render --si"), "--size\n");
  EXPECT_EQ(completed("windsplat serve winds.nc --log-f"), "--log-format\n");
  EXPECT_EQ(completed("windsplat serve --log-format \"\""), "text json\n");
  EXPECT_EQ(completed("windsplat serve --log-format = j"), "json\n");
  EXPECT_EQ(completed("windsplat inspect --ranges f"), "first\n");
  EXPECT_EQ(completed("windsplat render tor"), "tornado\n");
  EXPECT_EQ(completed("windsplat render climate --view vi"), "view.json\n");
  EXPECT_EQ(completed("windsplat render climate --threads \"\""), "\n");
  EXPECT_EQ(completed("windsplat help stu"), "study\n");
  EXPECT_EQ(completed("windsplat completions z"), "zsh\n");
}

TEST(CliHelp, EveryOptionIsInEveryTextAndNoneElse) {
  const std::string bash = run({"completions", "bash"}).out;
  const std::string zsh = run({"completions", "zsh"}).out;
  const std::string fish = run({"completions", "fish"}).out;
  for (const std::string& command : commands) {
    const std::set<std::string> options = options_in(run({command, "--help"}).out);
    EXPECT_GE(options.size(), 1U) << command;
    std::string page = run({"man", command}).out;
    page = std::regex_replace(page, std::regex(R"(\\-)"), "-");
    page = std::regex_replace(page, std::regex(R"(\\fB|\\fR)"), " ");
    for (const std::string& option : options) {
      EXPECT_THAT(bash, HasSubstr(option)) << command;
      EXPECT_THAT(zsh, HasSubstr(option + "[")) << command;
      EXPECT_THAT(fish, HasSubstr(" -l " + option.substr(2))) << command;
      EXPECT_THAT(page, HasSubstr(" " + option + " ")) << command;
    }
  }
  for (const char* shell : {"bash", "zsh", "fish"}) {
    EXPECT_EQ(run({"completions", shell}, {"LC_ALL=C", "TZ=Asia/Tokyo"}).out,
              run({"completions", shell}).out)
        << "the same text in every environment";
  }
}

TEST(CliHelp, ShellsParseTheirCompletions) {
  const Folder folder;
  std::string missing;
  for (const std::string shell_name : {"bash", "zsh", "fish"}) {
    if (!is_installed(folder, shell_name)) {
      missing += " " + shell_name;
      continue;
    }
    write_file(folder.file("script"), run({"completions", shell_name}).out);
    const auto said = shell(folder, shell_name + " -n " + folder.file("script"));
    EXPECT_EQ(said.first, 0) << shell_name;
    EXPECT_EQ(said.second, "") << shell_name;
  }
  if (!missing.empty()) GTEST_SKIP() << "not installed:" << missing;
}

TEST(CliHelp, ManualPagesAreFormattedWithoutWarnings) {
  const Folder folder;
  if (!is_installed(folder, "man")) GTEST_SKIP() << "man is not installed";
  Words pages = commands;
  pages.insert(pages.begin(), "");
  for (const std::string& command : pages) {
    const Outcome page = command.empty() ? run({"man"}) : run({"man", command});
    ASSERT_EQ(page.code, 0) << page.err;
    write_file(folder.file("page.1"), page.out);
    const auto warnings = shell(
        folder, "man --warnings -E UTF-8 -P cat -l " + folder.file("page.1") + " 2>&1 >/dev/null");
    EXPECT_EQ(warnings.second, "") << command;
    const auto text = shell(folder, "MANWIDTH=200 man -E UTF-8 -P cat -l " + folder.file("page.1"));
    const std::string name = command.empty() ? "windsplat" : "windsplat-" + command;
    EXPECT_THAT(text.second,
                AllOf(HasSubstr(name + " - "), HasSubstr("windsplat " WINDSPLAT_VERSION),
                      HasSubstr("EXIT STATUS")));
  }
  EXPECT_THAT(run({"man", "render"}).out, HasSubstr(R"(.BR windsplat\-animate (1))"));
}

// - is standard input or output wherever a file is meant.
TEST(CliHelp, AHyphenIsStandardInputOrOutput) {
  const Folder folder;
  const std::string program = WINDSPLAT_PROGRAM;
  write_file(folder.file("view.json"), R"({"image": {"width": 70, "height": 50}})");
  ASSERT_EQ(run({"render", "tornado:8", "--view", folder.file("view.json"), "--output",
                 folder.file("a.svg")})
                .code,
            0);
  const auto said = shell(folder, program + " render tornado:8 --view - -o - --format svg < " +
                                      folder.file("view.json"));
  EXPECT_TRUE(said.second == read_file(folder.file("a.svg")));
  EXPECT_THAT(run({"render", "tornado:8", "--view", folder.file("view.json"), "-o",
                   folder.file("a.png"), "--report", "-"})
                  .out,
              StartsWith("{"));
  ASSERT_EQ(run({"synth", "tornado", "--dims", "8x8x8", "-o", folder.file("a.nc")}).code, 0);
  const Outcome piped = run({"synth", "tornado", "--dims", "8x8x8", "--output", "-"});
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_EQ(piped.out.size(), read_file(folder.file("a.nc")).size());
  EXPECT_THAT(piped.out, HasSubstr("HDF"));
  EXPECT_EQ(run({"render", "tornado:8", "-o", folder.file("a.png"), "--format", "svg"}).code, 2);
}

TEST(CliHelp, BinaryDataAreNotWrittenToATerminal) {
  const Folder folder;
  write_file(folder.file("terminal.py"),
             "import pty, subprocess, sys\nours, theirs = pty.openpty()\n"
             "sys.exit(subprocess.run(sys.argv[1:], stdout=theirs).returncode)\n");
  for (const std::string command :
       {"render tornado:8 -o -", "animate tornado:8 -o - --format zip", "synth tornado -o -"}) {
    const auto said = shell(
        folder, "python3 " + folder.file("terminal.py") + " " + WINDSPLAT_PROGRAM + " " + command);
    EXPECT_EQ(WEXITSTATUS(said.first), 2) << command;
    EXPECT_THAT(said.second, HasSubstr("-o -: stdout is a terminal")) << command;
  }
}

}  // namespace
}  // namespace cli_test
