// Starting, querying and stopping the daemon.
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
using testing::Not;
using testing::StartsWith;

// A listening socket on a free port of 127.0.0.1.
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

  // The text of the URL line without its line feed.
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
  EXPECT_EQ(daemon.read_all(), "") << "stdout contains only the URL";
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
  EXPECT_EQ(run({"healthcheck", url}).code, 1);
}

std::uint16_t port_of(const std::string& url) {
  const std::size_t colon = url.rfind(':');
  return static_cast<std::uint16_t>(colon == std::string::npos ? 0
                                                               : std::stoi(url.substr(colon + 1)));
}

TEST_F(CliServe, StateFolderKeepsViewsAfterAKillAndIsLockedByOneDaemon) {
  const Words words{"serve", "--listen", "127.0.0.1:0", "--threads", "2", dataset};
  const std::string state = folder.file("state");
  const server_test::Headers json{{"Content-Type", "application/json"}};
  std::string location;
  {
    Words with_flag = words;
    with_flag.insert(with_flag.end(), {"--state-dir", state});
    Process daemon(with_flag);
    const auto port = port_of(url_of(daemon));
    const auto made = server_test::request(port, "POST", "/v1/views", json, R"({"step":1})");
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
  const auto found = server_test::get(port, location);
  EXPECT_EQ(found.status, 200) << found.body;
  EXPECT_THAT(found.body, HasSubstr(R"("view":{"step":1})"));
  Process without(words);
  EXPECT_EQ(server_test::get(port_of(url_of(without)), location).status, 404);
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

TEST_F(CliServe, SigtermDoesNotWaitForAHangingLoader) {
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--threads", "2", dataset});
  const std::string url = url_of(daemon);
  const auto port = port_of(url);
  const pid_t loader = child_of(daemon.id());
  ASSERT_GT(loader, 1) << "files are read by a separate process";
  ASSERT_EQ(kill(loader, SIGSTOP), 0);
  server_test::Socket asking(port);
  asking.send(
      "GET /v1/datasets/tornado-small/frame.png?width=32&height=32 HTTP/1.1\r\n"
      "Host: localhost\r\n\r\n");
  EXPECT_EQ(server_test::get(port, "/livez").status, 200);
  const auto begin = std::chrono::steady_clock::now();
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
  // A read may take a minute, a drain 10 s.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

#ifndef WINDSPLAT_SANITIZED  // its shadow memory counts
// The first value of --memory-limit that a message suggests.
std::string limit_told(const std::string& message) {
  const std::string before = ": --memory-limit ";
  const std::size_t at = message.find(before);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + before.size();
  return message.substr(begin, message.find(' ', begin) - begin);
}

TEST_F(CliServe, DatasetWithoutAFittingStepIsRefusedWithTheRequiredLimit) {
  const std::string large = "efield:200x200x200";  // 91.6 MiB, read as a whole
  const Outcome refused =
      run({"serve", "--listen", "127.0.0.1:0", "--memory-limit", "192M", large});
  EXPECT_EQ(refused.code, 1);
  EXPECT_EQ(refused.out, "");
  EXPECT_THAT(refused.err, HasSubstr("windsplat: 'E' needs 91.6 MiB at a step; --memory-limit 192M "
                                     "leaves 68.0 MiB for data; 'E', 'energy' and 'walls' need "
                                     "152.6 MiB together: --memory-limit 283M would suffice\n"));
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--memory-limit", "192M", large, dataset});
  const auto port = port_of(url_of(daemon));
  EXPECT_THAT(server_test::get(port, "/v1/datasets").body, HasSubstr("91.6 MiB"));
  const auto picture = server_test::get(port, "/v1/datasets/" + large + "/frame.png?width=32");
  EXPECT_EQ(picture.status, 404);
  EXPECT_THAT(picture.body, HasSubstr("--memory-limit 283M would suffice"));
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(CliServe, DatasetThatIsReadByBoxesIsProbedWithoutAFittingStep) {
  const std::string large = "tornado:200x200x200";  // 91.6 MiB of wind, 30.5 MiB of cloud
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--memory-limit", "192M", large});
  const auto port = port_of(url_of(daemon));
  EXPECT_THAT(daemon.messages(), HasSubstr("can be probed, but its default view is not shown"));
  const auto probe = server_test::get(port, "/v1/datasets/" + large + "/probe?index=7,8,9");
  EXPECT_EQ(probe.status, 200) << probe.body;
  const auto picture = server_test::get(port, "/v1/datasets/" + large + "/frame.png?width=32");
  EXPECT_EQ(picture.status, 507);
  EXPECT_THAT(picture.body, HasSubstr("'wind' and 'cloud' need 122.1 MiB together: "
                                      "--memory-limit 250M would suffice"));
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);

  Process enough({"serve", "--listen", "127.0.0.1:0", "--memory-limit", "250M", large});
  const auto drawn = server_test::get(port_of(url_of(enough)),
                                      "/v1/datasets/" + large + "/frame.png?width=640&height=640");
  EXPECT_EQ(drawn.status, 200) << drawn.body;
}

// The reported memory includes a loader and the buffers for reading.
TEST_F(CliServe, ReportedRequiredLimitSufficesForFiles) {
  const std::string file = folder.file("large.nc");
  ASSERT_EQ(run({"synth", "tornado", "--dims", "180x180x180", "--steps", "1", "-o", file}).code, 0);
  const Outcome refused = run(
      {"render", file, "--memory-limit", "192M", "--size", "640x640", "-o", folder.file("a.png")});
  EXPECT_EQ(refused.code, 1);
  const std::string limit = limit_told(refused.err);
  ASSERT_NE(limit, "") << refused.err;
  const Outcome drawn = run(
      {"render", file, "--memory-limit", limit, "--size", "640x640", "-o", folder.file("a.png")});
  EXPECT_EQ(drawn.code, 0) << limit << ": " << drawn.err;
}

TEST_F(CliServe, DatasetAboveTheMemoryLimitIsReportedWithTheOption) {
  const std::string large = "tornado:170x170x170";  // 56.2 MiB of wind, 18.7 MiB of cloud
  Process daemon({"serve", "--listen", "127.0.0.1:0", "--memory-limit", "192M", large});
  const std::string url = url_of(daemon);
  const auto port = port_of(url);
  const std::string of = "/v1/datasets/" + large + '/';
  // Small pictures use levels of detail, which also need memory.
  const auto picture = server_test::get(port, of + "frame.png?width=512&height=512");
  ASSERT_EQ(picture.status, 507);
  EXPECT_THAT(picture.body, HasSubstr("dataset '" + large + "'"));
  EXPECT_THAT(picture.body, HasSubstr("--memory-limit 192M leaves 68.0 MiB for data"));
  EXPECT_THAT(picture.body, HasSubstr("'wind' and 'cloud' need 75.0 MiB together"));
  EXPECT_EQ(limit_told(picture.body), "200M");
  EXPECT_EQ(server_test::get(port, of + "fields/wind/range").status, 200) << "a single field fits";
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(daemon.messages(), HasSubstr("may be too small for a dataset's first view"));
}
#endif

TEST_F(CliServe, SigintDrains) {
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

TEST_F(CliServe, LogIsWrittenToStderrAsJsonLines) {
  Process daemon({"serve", "--listen", ":0", dataset}, {"WINDSPLAT_LOG_FORMAT=json"});
  url_of(daemon);
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(daemon.messages(), StartsWith("{\"time\":\""));
  EXPECT_THAT(daemon.messages(), HasSubstr("\"dataset\":\"tornado-small\""));
}

TEST_F(CliServe, NonLoopbackAddressRequiresItsFlag) {
  const Outcome refused = run({"serve", "--listen", "0.0.0.0:0", dataset});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--allow-remote"));
  Process daemon({"serve", "--listen", "0.0.0.0:0", "--allow-remote", "--allow-root", dataset});
  EXPECT_THAT(url_of(daemon), StartsWith("http://"));
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(CliServe, PortInUseIsReported) {
  const Port port;
  port.take();
  const Outcome outcome = run({"serve", "--listen", "127.0.0.1:" + port.text(), dataset});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr(port.text()));
  EXPECT_THAT(outcome.err, HasSubstr("use port 0 for any free port"));
}

TEST_F(CliServe, StrictRefusesToStartWithADatasetThatFailsToOpen) {
  const std::string bad = folder.file("bad.nc");
  write_file(bad, "not a data file");
  const Outcome outcome = run({"serve", "--strict", "--listen", "127.0.0.1:0", bad, dataset});
  EXPECT_NE(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("not a netCDF file"));
}

TEST_F(CliServe, DatasetThatFailsToOpenIsListedAsFailed) {
  const std::string bad = folder.file("bad.nc");
  write_file(bad, "not a data file");
  Process daemon({"serve", "--listen", "127.0.0.1:0", bad, folder.file("absent.nc"), dataset});
  const std::uint16_t port = port_of(daemon);
  const std::string list = server_test::get(port, "/v1/datasets").body;
  EXPECT_THAT(list, HasSubstr(R"("id":"tornado-small")"));
  EXPECT_THAT(list, HasSubstr(R"("id":"bad")"));
  EXPECT_THAT(list, HasSubstr("not a netCDF file"));
  EXPECT_THAT(list, HasSubstr(R"("id":"absent")"));
  EXPECT_EQ(server_test::get(port, "/v1/datasets/tornado-small").status, 200);
  const auto refused = server_test::get(port, "/v1/datasets/bad");
  EXPECT_EQ(refused.status, 404);
  EXPECT_THAT(refused.body, HasSubstr("could not be opened"));
  EXPECT_THAT(daemon.messages(), HasSubstr("listed as failed"));
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(CliServe, FailedDatasetRecoversWithItsFileOrIsRemoved) {
  const std::string mended = folder.file("mended.nc");
  const std::string bad = folder.file("bad.nc");
  write_file(bad, "not a data file");
  Process daemon({"serve", "--listen", "127.0.0.1:0", bad, mended, dataset});
  const std::uint16_t port = port_of(daemon);
  const auto status_of = [&](const char* id) {
    return server_test::get(port, std::string("/v1/datasets/") + id).status;
  };
  EXPECT_EQ(status_of("mended"), 404);
  std::filesystem::copy_file(dataset, mended);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (status_of("mended") != 200 && std::chrono::steady_clock::now() < deadline) {
    usleep(20'000);
  }
  EXPECT_EQ(status_of("mended"), 200) << daemon.messages();

  EXPECT_EQ(server_test::request(port, "DELETE", "/v1/datasets/bad").status, 404);
  EXPECT_EQ(server_test::request(port, "DELETE", "/v1/datasets/bad?forget=true").status, 204);
  EXPECT_THAT(server_test::get(port, "/v1/datasets").body, Not(HasSubstr(R"("id":"bad")")));
  EXPECT_EQ(server_test::request(port, "DELETE", "/v1/datasets/bad?forget=true").status, 404);
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(CliServe, WithoutAnyUsableDatasetStartupFails) {
  const std::string bad = folder.file("bad.nc");
  write_file(bad, "not a data file");
  const Outcome outcome = run({"serve", "--listen", ":0", folder.file("absent.nc"), bad});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("bad.nc"));
  EXPECT_THAT(outcome.err, HasSubstr("absent.nc"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("listed")));
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
