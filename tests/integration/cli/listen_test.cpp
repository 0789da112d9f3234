// Where serve listens: UNIX sockets, names, and several places at once.
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// The status of a GET over a UNIX socket; 0: nobody answers.
int status_at_socket(const std::string& path, const std::string& headers = "") {
  const int handle = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  std::string answer;
  if (::connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    const std::string text =
        "GET /v1 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + headers + "\r\n";
    EXPECT_EQ(::send(handle, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
    std::array<char, 4096> bytes{};
    for (ssize_t got = 1; got > 0;) {
      got = ::recv(handle, bytes.data(), bytes.size(), 0);
      if (got > 0) answer.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }
  ::close(handle);
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}

class CliListen : public testing::Test {
 protected:
  Words serve(const Words& more) const {
    Words words{"serve", "--threads", "2", "tornado:8x8x8"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  Folder folder;
  const std::string path = folder.file("windsplat.sock");
  const std::string place = "unix:" + path;
};

TEST_F(CliListen, AUnixSocketHasItsModeAndGoesWithTheDaemon) {
  Process daemon(serve({"--listen", place, "--listen-mode", "0620"}));
  const std::string line = daemon.read_until('\n');
  EXPECT_THAT(line, StartsWith("http+unix://%2F"));
  struct stat facts {};
  ASSERT_EQ(::stat(path.c_str(), &facts), 0);
  EXPECT_TRUE(S_ISSOCK(facts.st_mode));
  EXPECT_EQ(facts.st_mode & 0777U, 0620U);
  EXPECT_EQ(status_at_socket(path), 200);
  EXPECT_EQ(run({"healthcheck", place}).code, 0);
  EXPECT_EQ(run({"healthcheck", line.substr(0, line.size() - 1)}).code, 0);
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_NE(::stat(path.c_str(), &facts), 0) << "the file is removed";
  EXPECT_EQ(run({"healthcheck", place}).code, 1);
}

TEST_F(CliListen, OnlyASocketThatNobodyAnswersIsReplaced) {
  {
    Process killed(serve({"--listen", place}));
    killed.read_until('\n');
    const Outcome second = run(serve({"--listen", place}));
    EXPECT_EQ(second.code, 1);
    EXPECT_THAT(second.err, HasSubstr("another process listens there"));
    EXPECT_EQ(status_at_socket(path), 200) << "the first one keeps its socket";
    killed.send(SIGKILL);
    killed.wait();
  }
  struct stat facts {};
  ASSERT_EQ(::stat(path.c_str(), &facts), 0) << "left behind";
  Process next(serve({"--listen", place}));
  next.read_until('\n');
  EXPECT_EQ(status_at_socket(path), 200);
  const std::string file = folder.file("notes.txt");
  write_file(file, "keep");
  const Outcome other = run(serve({"--listen", "unix:" + file}));
  EXPECT_EQ(other.code, 1);
  EXPECT_THAT(other.err, HasSubstr("no socket"));
  EXPECT_EQ(read_file(file), "keep");
}

TEST_F(CliListen, PeersOfAUnixSocketAreCountedByUserOrByATrustedProxysHeader) {
  const auto statuses = [&](const Words& more) {
    Words words = serve({"--listen", place, "--max-requests-per-address", "0.2"});
    words.insert(words.end(), more.begin(), more.end());
    Process daemon(words);
    daemon.read_until('\n');
    std::vector<int> found;
    for (const char* const client : {"192.0.2.1", "192.0.2.2", "192.0.2.3"}) {
      found.push_back(status_at_socket(path, "X-Forwarded-For: " + std::string(client) + "\r\n"));
    }
    return found;
  };
  EXPECT_EQ(statuses({}), (std::vector<int>{200, 200, 429})) << "one user, two at once";
  EXPECT_EQ(statuses({"--trusted-proxy", "unix"}), (std::vector<int>{200, 200, 200}));
  EXPECT_EQ(statuses({"--trusted-proxy", "127.0.0.1"}), (std::vector<int>{200, 200, 429}));
}

TEST_F(CliListen, SeveralPlacesAndAllAddressesOfANameAreServed) {
  Process daemon(serve({"--listen", "localhost:0", "--listen", place}));
  const std::string first = daemon.read_until('\n');
  EXPECT_THAT(first, StartsWith("http://127.0.0.1:"));
  EXPECT_EQ(run({"healthcheck", first.substr(0, first.size() - 1)}).code, 0);
  std::string line = daemon.read_until('\n');
  if (line.starts_with("http://[::1]:")) {  // a machine without IPv6 has one address less
    EXPECT_EQ(run({"healthcheck", line.substr(0, line.size() - 1)}).code, 0);
    line = daemon.read_until('\n');
  }
  EXPECT_THAT(line, StartsWith("http+unix://"));
  EXPECT_EQ(run({"healthcheck", place}).code, 0);
}

TEST_F(CliListen, WhatIsNoPlaceIsRefusedByName) {
  const auto refusal = [&](const Words& more) {
    const Outcome outcome = run(serve(more));
    EXPECT_NE(outcome.code, 0);
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_THAT(refusal({"--listen", "no-such-name.invalid:0"}),
              HasSubstr("'no-such-name.invalid': the name has no address"));
  EXPECT_THAT(refusal({"--listen", "unix:relative.sock"}), HasSubstr("absolute path"));
  EXPECT_THAT(refusal({"--listen", "unix:/" + std::string(107, 'x')}), HasSubstr("107 bytes"));
  EXPECT_THAT(refusal({"--listen", "unix:" + folder.file("none/a.sock")}),
              HasSubstr("No such file"));
  EXPECT_THAT(refusal({"--listen", place, "--listen-mode", "rw"}), HasSubstr("--listen-mode"));
  EXPECT_THAT(refusal({"--listen", place, "--listen-mode", "0999"}), HasSubstr("--listen-mode"));
}

}  // namespace
}  // namespace cli_test
