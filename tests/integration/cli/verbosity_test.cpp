// -q and -v: what the daemon logs and what commands write beside their results.
#include <gmock/gmock.h>

#include <csignal>
#include <string>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// What a daemon that ends without a fault has logged.
std::string logged(Words options, const Words& environment = {}) {
  Words words{"serve", "--threads", "1", "--listen", "127.0.0.1:0", "tornado:8x8x8"};
  words.insert(words.end(), options.begin(), options.end());
  Process daemon(words, environment);
  daemon.read_until('\n');
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
  return daemon.messages();
}

TEST(CliVerbosity, AQuietDaemonLogsNothingWithoutAFault) {
  EXPECT_THAT(logged({}), HasSubstr("draining"));
  EXPECT_THAT(logged({"-q"}), IsEmpty());
}

TEST(CliVerbosity, TheFlagsOfServeReplaceTheLevelOfTheEnvironment) {
  EXPECT_THAT(logged({}, {"WINDSPLAT_LOG_LEVEL=off"}), IsEmpty());
  EXPECT_THAT(logged({"-v"}, {"WINDSPLAT_LOG_LEVEL=off"}), HasSubstr("draining"));
  EXPECT_THAT(logged({"--quiet"}, {"WINDSPLAT_LOG_LEVEL=debug"}), IsEmpty());
}

TEST(CliVerbosity, TwoLevelsAreRefused) {
  for (const Words& options : {Words{"-q", "-v"}, Words{"-q", "--log-level", "debug"},
                               Words{"--log-level", "info", "--verbose"}}) {
    Words words{"serve", "tornado:8x8x8"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome refused = run(words);
    EXPECT_EQ(refused.code, 2) << options[0];
    EXPECT_THAT(refused.err, HasSubstr("excludes")) << options[0];
  }
}

TEST(CliVerbosity, ConfigurationFilesHaveALogLevelInPlaceOfTheFlags) {
  const Folder folder;
  const std::string config = folder.file("config.json");
  write_file(config, R"({"quiet": true})");
  const Outcome refused = run({"serve", "--config", config});
  EXPECT_NE(refused.code, 0);
  EXPECT_THAT(refused.err, HasSubstr("quiet"));
}

TEST(CliVerbosity, HealthcheckSaysWhatItFoundIfAsked) {
  Process daemon({"serve", "--threads", "1", "--listen", "127.0.0.1:0", "tornado:8x8x8"});
  std::string url = daemon.read_until('\n');
  url.pop_back();
  EXPECT_THAT(run({"healthcheck", url}).err, IsEmpty());
  EXPECT_THAT(run({"healthcheck", "-v", url}).err, AllOf(HasSubstr("is ready"), HasSubstr(url)));
}

// A pipe or file has no terminal, whatever is asked for.
TEST(CliVerbosity, RenderShowsProgressOnTerminalsOnly) {
  const Folder folder;
  const Outcome drawn =
      run({"render", "tornado:8x8x8", "-v", "--size", "64x48", "-o", folder.file("out.png")});
  EXPECT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_THAT(drawn.err, AllOf(HasSubstr("pixels in"), Not(HasSubstr("[#")), Not(HasSubstr("%"))));
}

}  // namespace
}  // namespace cli_test
