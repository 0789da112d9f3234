// The daemon as a person starts, asks and stops it.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>

#include "tests/integration/cli_program.hpp"
#include "tests/integration/client.hpp"

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

std::uint16_t port_of(const std::string& url) {
  const std::size_t colon = url.rfind(':');
  return static_cast<std::uint16_t>(colon == std::string::npos ? 0
                                                               : std::stoi(url.substr(colon + 1)));
}

TEST_F(CliServe, AStateFolderKeepsViewsOverAKillAndIsOneDaemonsAlone) {
  const Words words{"serve", "--listen", "127.0.0.1:0", "--threads", "2", dataset};
  const std::string state = folder.file("state");
  const net_test::Headers json{{"Content-Type", "application/json"}};
  std::string location;
  {
    Words with_flag = words;
    with_flag.insert(with_flag.end(), {"--state-dir", state});
    Process daemon(with_flag);
    const auto port = port_of(url_of(daemon));
    const auto made = net_test::request(port, "POST", "/v1/views", json, R"({"step":1})");
    EXPECT_EQ(made.status, 201) << made.body;
    location = made.header("location");
    const Outcome second = run(with_flag);
    EXPECT_EQ(second.code, 2);
    EXPECT_THAT(second.err, HasSubstr("in use"));
    daemon.send(SIGKILL);
    daemon.wait();
  }
  Process daemon(words, {"WINDSPLAT_STATE_DIR=" + state});
  const auto port = port_of(url_of(daemon));
  const auto found = net_test::get(port, location);
  EXPECT_EQ(found.status, 200) << found.body;
  EXPECT_THAT(found.body, HasSubstr(R"("view":{"step":1})"));
  Process without(words);
  EXPECT_EQ(net_test::get(port_of(url_of(without)), location).status, 404);
}

// The first child of a process; -1 if it has none.
pid_t child_of(pid_t parent) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string number = entry.path().filename();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::string stat = read_file(entry.path() / "stat");
    const std::size_t name_end = stat.rfind(')');
    if (name_end == std::string::npos) continue;
    char state = 0;
    int its_parent = 0;
    if (std::sscanf(stat.c_str() + name_end + 1, " %c %d", &state, &its_parent) == 2 &&
        its_parent == parent) {
      return std::stoi(number);
    }
  }
  return -1;
}

TEST_F(CliServe, SigtermDoesNotWaitForALoaderThatHangs) {
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--threads", "2", dataset});
  const std::string url = url_of(daemon);
  const auto port = port_of(url);
  const pid_t loader = child_of(daemon.id());
  ASSERT_GT(loader, 1) << "files are read by a process of their own";
  ASSERT_EQ(kill(loader, SIGSTOP), 0);
  net_test::Socket asking(port);
  asking.send(
      "GET /v1/datasets/tornado-small/frame.png?width=32&height=32 HTTP/1.1\r\n"
      "Host: localhost\r\n\r\n");
  EXPECT_EQ(net_test::get(port, "/livez").status, 200);
  const auto begin = std::chrono::steady_clock::now();
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
  // A read may take a minute, a drain 10 s.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST_F(CliServe, WhatDoesNotFitIntoTheMemoryLimitIsNamedAndSoIsTheOption) {
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--memory-limit", "2K", dataset});
  const std::string url = url_of(daemon);
  const auto port = port_of(url);
  const std::string of = "/v1/datasets/tornado-small/";
  const auto picture = net_test::get(port, of + "frame.png?width=32&height=32");
  EXPECT_EQ(picture.status, 507);
  EXPECT_THAT(picture.body, HasSubstr("dataset 'tornado-small'"));
  EXPECT_THAT(picture.body, HasSubstr("--memory-limit"));
  const auto range = net_test::get(port, of + "fields/wind/range");
  EXPECT_EQ(range.status, 507);
  EXPECT_THAT(range.body, HasSubstr("field 'wind'"));
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(daemon.messages(), HasSubstr("hardly any data fits into the memory limit"));
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
  EXPECT_THAT(outcome.err, HasSubstr("port 0 is any that is free"));
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
