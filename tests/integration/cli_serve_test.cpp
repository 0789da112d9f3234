// The daemon as a person starts, asks and stops it.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <string>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;
using testing::StartsWith;

// A socket of ours on a free port of 127.0.0.1.
class Port {
 public:
  Port() : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(bind(socket_, generic, length), 0);
    EXPECT_EQ(getsockname(socket_, generic, &length), 0);
    number_ = ntohs(address.sin_port);
  }
  ~Port() { close(socket_); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  void take() const { EXPECT_EQ(listen(socket_, 1), 0); }
  [[nodiscard]] std::string text() const { return std::to_string(number_); }

 private:
  int socket_;
  int number_ = 0;
};

class CliServe : public testing::Test {
 protected:
  void SetUp() override { dataset = synth(folder, "tornado", "8x8x8"); }

  // The URL line's text without its line feed.
  static std::string url_of(Process& daemon) {
    std::string line = daemon.read_until('\n');
    EXPECT_FALSE(line.empty()) << daemon.messages();
    if (!line.empty()) line.pop_back();
    return line;
  }

  Folder folder;
  std::string dataset;
};

TEST_F(CliServe, PrintsItsUrlAnswersHealthcheckAndDrainsOnSigterm) {
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--threads", "2", dataset});
  const std::string url = url_of(daemon);
  EXPECT_THAT(url, MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+/"));
  const Outcome healthy = run({"healthcheck", url});
  EXPECT_EQ(healthy.code, 0) << healthy.err;
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.read_all(), "") << "the URL is all that goes to stdout";
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
  EXPECT_EQ(run({"healthcheck", url}).code, 1);
}

TEST_F(CliServe, SigintDrainsToo) {
  Process daemon({"serve", "--listen", ":0", dataset});
  url_of(daemon);
  daemon.send(SIGINT);
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
}

TEST_F(CliServe, BasePathIsPartOfTheUrlAndOfHealthcheck) {
  Process daemon({"serve", "--listen", ":0", "--base-path", "/weather/", dataset});
  const std::string url = url_of(daemon);
  EXPECT_THAT(url, testing::EndsWith("/weather/"));
  EXPECT_EQ(run({"healthcheck", url}).code, 0);
  EXPECT_EQ(run({"healthcheck", url.substr(0, url.size() - 1)}).code, 0);
}

TEST_F(CliServe, LogGoesToStderrAsJsonLinesWhenAskedFor) {
  Process daemon({"serve", "--listen", ":0", dataset}, {"WINDSPLAT_LOG_FORMAT=json"});
  url_of(daemon);
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(daemon.messages(), StartsWith("{\"time\":\""));
  EXPECT_THAT(daemon.messages(), HasSubstr("\"dataset\":\"tornado-small\""));
}

TEST_F(CliServe, AnAddressThatOthersReachNeedsItsFlag) {
  const Outcome refused = run({"serve", "--listen", "0.0.0.0:0", dataset});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--allow-remote"));
  Process daemon({"serve", "--listen", "0.0.0.0:0", "--allow-remote", dataset});
  EXPECT_THAT(url_of(daemon), StartsWith("http://"));
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(CliServe, ATakenPortIsAnErrorThatNamesIt) {
  const Port port;
  port.take();
  const Outcome outcome = run({"serve", "--listen", "127.0.0.1:" + port.text(), dataset});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr(port.text()));
}

// It serves all that it was asked to, or nothing.
TEST_F(CliServe, OneDatasetThatFailsStopsTheStart) {
  const std::string bad = folder.file("bad.nc");
  write_file(bad, "nothing of use");
  const Outcome outcome = run({"serve", "--listen", ":0", dataset, bad});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("bad.nc"));
  EXPECT_EQ(run({"serve", "--listen", ":0", folder.file("absent.nc")}).code, 1);
}

TEST_F(CliServe, HealthcheckOfAClosedPortFails) {
  std::string url;
  {
    const Port port;
    url = "http://127.0.0.1:" + port.text() + "/";
  }
  const Outcome outcome = run({"healthcheck", url});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err, "");
  EXPECT_EQ(outcome.out, "");
}

}  // namespace
}  // namespace cli_test
