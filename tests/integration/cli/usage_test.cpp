// Help, version and errors for invalid arguments.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(CliUsage, HelpNamesTheCommands) {
  const Outcome help = run({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* command :
       {"serve", "render", "animate", "study", "inspect", "synth", "healthcheck"}) {
    EXPECT_THAT(help.out, HasSubstr(command));
    const Outcome own = run({command, "--help"});
    EXPECT_EQ(own.code, 0) << command;
    EXPECT_EQ(own.err, "") << command;
  }
  EXPECT_THAT(run({"serve", "--help"}).out, HasSubstr("--allow-remote"));
}

TEST(CliUsage, VersionIsOneLineOnStdout) {
  const Outcome version = run({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out, "windsplat " WINDSPLAT_VERSION "\n");
}

TEST(CliUsage, NonNumericLimitIsReportedWithItsRange) {
  for (const char* wrong : {"abc", "-1", "1e19"}) {
    const Outcome outcome = run({"serve", "--max-handshakes", wrong});
    EXPECT_EQ(outcome.code, 2) << wrong;
    EXPECT_THAT(
        outcome.err,
        StartsWith(std::string("windsplat: --max-handshakes: must be a number from 0 (no limit) "
                               "to 1e+18, not '") +
                   wrong + "'"));
  }
}

TEST(CliUsage, InvalidArgumentsExitWith2AndReportOnStderrOnly) {
  const std::vector<Words> wrong{{},
                                 {"paint"},
                                 {"animate", "climate"},
                                 {"animate", "climate", "-o", "f.jpg"},
                                 {"animate", "climate", "-o", "f_%d_%d.jpg"},
                                 {"animate", "climate", "-o", "f_%s.jpg"},
                                 {"animate", "climate", "-o", "f_%99d.jpg"},
                                 {"animate", "climate", "-o", "f_%%d.jpg"},
                                 {"animate", "climate", "-o", "f_%04d"},
                                 {"animate", "climate", "-o", "f_%d.jpg", "--steps", "3"},
                                 {"animate", "climate", "-o", "f_%d.jpg", "--steps", "3:1"},
                                 {"animate", "climate", "-o", "f_%d.jpg", "--steps", "0:2:0"},
                                 {"animate", "climate", "-o", "f_%d.jpg", "--steps", "0:999999"},
                                 {"animate", "climate", "-o", "f_%d.jpg", "--per-step", "0"},
                                 {"animate", "climate", "-o", "f_%d.jpg", "--per-step", "2"},
                                 {"render"},
                                 {"render", "tornado"},
                                 {"render", "tornado", "-o", "picture.tiff"},
                                 {"render", "tornado", "-o", "picture"},
                                 {"render", "tornado", "-o", "a.png", "--size", "640"},
                                 {"render", "tornado", "-o", "a.png", "--size", "0x480"},
                                 {"render", "tornado", "-o", "a.png", "--set", "/step"},
                                 {"render", "tornado", "-o", "a.png", "--threads", "-1"},
                                 {"render", "tornado", "-o", "a.png", "--sideways"},
                                 {"synth", "hurricane", "-o", "a.nc"},
                                 {"synth", "tornado"},
                                 {"synth", "tornado", "--dims", "8x8", "-o", "a.nc"},
                                 {"synth", "tornado", "--dims", "8x8x0", "-o", "a.nc"},
                                 {"synth", "tornado", "--dims", "99999x8x8", "-o", "a.nc"},
                                 {"synth", "tornado", "--steps", "0", "-o", "a.nc"},
                                 {"inspect"},
                                 {"healthcheck", "not a url"},
                                 {"serve", "--listen", "8080"},
                                 {"serve", "--listen", "127.0.0.1:99999"},
                                 {"serve", "--listen", "no-such-name.invalid:80"},
                                 {"serve", "--listen", "0.0.0.0:0"},
                                 {"serve", "--listen", "[::]:0"},
                                 {"serve", "--base-path", "no-slash"},
                                 {"serve", "--memory-limit", "lots"},
                                 {"serve", "--memory-limit", "0"},
                                 {"serve", "--memory-limit", "191M"},
                                 {"serve", "--memory-limit", "99999999T"},
                                 {"serve", "--memory-limit", "8388608T"},
                                 {"serve", "--memory-limit", "1.5"},
                                 {"serve", "--memory-limit", "1..5G"},
                                 {"serve", "--memory-limit", "-1G"},
                                 {"serve", "--memory-limit", "infM"},
                                 {"inspect", "--memory-limit", "lots", "tornado"},
                                 {"render", "--memory-limit", "0", "tornado", "-o", "a.png"},
                                 {"serve", "--max-sessions", "0"},
                                 {"serve", "--log-format", "xml"}};
  for (const Words& words : wrong) {
    const Outcome outcome = run(words);
    std::string line;
    for (const std::string& word : words) line += word + ' ';
    EXPECT_EQ(outcome.code, 2) << line << outcome.err;
    EXPECT_THAT(outcome.err, StartsWith(words.empty() ? "windsplat draws" : "windsplat: ")) << line;
    EXPECT_EQ(outcome.out, "") << line;
  }
}

TEST(CliUsage, InsufficientMemoryLimitIsRefusedWithTheRequiredAmount) {
  const Outcome outcome = run({"serve", "--memory-limit", "40M", "tornado"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err,
              StartsWith("windsplat: --memory-limit '40M' is below the minimum of 192M: "
                         "112M for the program and a picture"));
}

TEST(CliUsage, MemoryLimitAcceptsLowerCaseUnitsAndDecimals) {
  for (const char* limit : {"192m", "1.5G", "0.25g", "201326592", "128T"}) {
    const Outcome outcome = run({"inspect", "tornado:8", "--memory-limit", limit});
    EXPECT_EQ(outcome.code, 0) << limit << ": " << outcome.err;
  }
  const Outcome absurd = run({"inspect", "tornado:8", "--memory-limit", "8388608T"});
  EXPECT_EQ(absurd.code, 2);
  EXPECT_THAT(absurd.err, HasSubstr("'8388608T' is above 128T"));
}

TEST(CliUsage, HelpStatesTheMinimumMemoryLimit) {
  for (const char* command : {"serve", "render", "animate", "inspect", "study"}) {
    EXPECT_THAT(run({command, "--help"}).out, HasSubstr("at least 192M")) << command;
  }
}

TEST(CliUsage, UnknownWordIsReportedWithASuggestion) {
  EXPECT_THAT(
      run({"render", "tornado", "-o", "x.png", "--siez", "3x3"}).err,
      StartsWith("windsplat: '--siez' is not an option of 'render'; did you mean --size?\n"));
  EXPECT_THAT(run({"serve", "--memory-limt=4G"}).err, HasSubstr("did you mean --memory-limit?"));
  EXPECT_THAT(run({"serve", "--banana"}).err,
              StartsWith("windsplat: '--banana' is not an option of 'serve'\n"));
  EXPECT_THAT(run({"render", "tornado", "extra", "-o", "x.png"}).err,
              HasSubstr("'extra' is an unexpected argument of 'render'\n"));
  EXPECT_THAT(run({"render", WINDSPLAT_PROGRAM, WINDSPLAT_PROGRAM, "-o", "x.png"}).err,
              HasSubstr("a pattern of files must be in quotes"));
}

// Text from arguments must not imitate lines or colours of the program's messages.
TEST(CliUsage, MessagesEscapeControlCharactersOfArguments) {
  for (const Words& words : std::vector<Words>{
           {"x\ny\x1b[0m"}, {"serve", "--log-format", "x\nwindsplat: all well\x1b]0;t\a"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.err.find_first_of("\x1b\a"), std::string::npos) << outcome.err;
    EXPECT_THAT(outcome.err, Not(HasSubstr("\nwindsplat: all well"))) << outcome.err;
  }
  EXPECT_THAT(run({"paint"}).err, HasSubstr("unknown command 'paint'"));
}

// A flag without effect must be rejected.
TEST(CliUsage, MissingDataRootIsRefused) {
  const Outcome outcome = run({"serve", "--data-root", "x"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--data-root 'x'"));
}

TEST(CliUsage, UnusableStateFolderIsRefused) {
  for (const Words& environment : {Words{}, Words{"WINDSPLAT_STATE_DIR=/dev/null/state"}}) {
    Words words{"serve", "--listen", "127.0.0.1:0", "tornado"};
    if (environment.empty()) words.insert(words.end(), {"--state-dir", "/dev/null/state"});
    const Outcome outcome = run(words, environment);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr("/dev/null/state"));
  }
  EXPECT_THAT(run({"serve", "--help"}).out, HasSubstr("WINDSPLAT_STATE_DIR"));
}

TEST(CliUsage, CommandLineOverridesTheEnvironment) {
  const Words environment{"WINDSPLAT_LISTEN=nonsense"};
  const Outcome from_environment = run({"serve"}, environment);
  EXPECT_EQ(from_environment.code, 2);
  EXPECT_THAT(from_environment.err, HasSubstr("nonsense"));
  const Outcome overridden = run({"serve", "--listen", "absurd"}, environment);
  EXPECT_EQ(overridden.code, 2);
  EXPECT_THAT(overridden.err, HasSubstr("absurd"));
  EXPECT_EQ(run({"serve"}, {"WINDSPLAT_LOG_LEVEL=loud"}).code, 2);
}

// NaN passes comparisons with both limits; a dataset that is set would be replaced.
TEST(CliUsage, ValuesThatHadNoMeaningAreRefused) {
  for (const char* dpi : {"nan", "inf", "9.99", "2401", "1e400", "300x"}) {
    const Outcome refused = run({"render", "tornado:8", "-o", "x.svg", "--dpi", dpi});
    EXPECT_EQ(refused.code, 2) << dpi;
    EXPECT_THAT(refused.err, HasSubstr("is not a number from 10 to 2400")) << dpi;
  }
  const Outcome refused = run({"render", "tornado:8", "-o", "x.png", "--set", "/dataset=climate"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err,
              HasSubstr("/dataset: --set: the dataset is that of the argument DATASET"));
}

}  // namespace
}  // namespace cli_test
