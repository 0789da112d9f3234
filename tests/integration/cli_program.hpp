// Runs the built program for command line tests: arguments in, exit code and output out.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

extern char** environ;  // POSIX requires programs to declare it

namespace cli_test {

using Words = std::vector<std::string>;

// A folder for the files of one test, removed with it.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-cli-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "cannot make a folder";
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void write_file(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

// A running program. `environment` is added to the current one, without its WINDSPLAT_ variables.
class Process {
 public:
  explicit Process(const Words& arguments, const Words& environment = {}) {
    Words words{WINDSPLAT_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    Words variables = environment;
    for (char** at = environ; *at != nullptr; ++at) {
      if (std::string(*at).rfind("WINDSPLAT_", 0) != 0) variables.emplace_back(*at);
    }
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
      ADD_FAILURE() << "no pipe";
      return;
    }
    stdout_ = ends[0];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
    posix_spawn_file_actions_addopen(&actions, 2, folder_.file("stderr").c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int fault = posix_spawn(&pid_, WINDSPLAT_PROGRAM, &actions, nullptr,
                                  pointers(words).data(), pointers(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (fault != 0) {
      ADD_FAILURE() << "cannot start " << WINDSPLAT_PROGRAM;
      pid_ = -1;
    }
  }

  ~Process() {
    if (pid_ > 0) {
      send(SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    if (stdout_ >= 0) close(stdout_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Signals this program only: kill() with a pid of -1 or 0 would signal every process.
  void send(int signal) const {
    if (pid_ > 0) {
      kill(pid_, signal);
    } else {
      ADD_FAILURE() << "the program is not running";
    }
  }

  // stdout up to and including `stop`, or to its end.
  std::string read_until(char stop) { return read_stdout(&stop); }
  std::string read_all() { return read_stdout(nullptr); }

  // The exit code; 128 + n if terminated by signal n. Kills a program that runs for more than a
  // minute.
  int wait() {
    if (pid_ <= 0) {
      ADD_FAILURE() << "the program is not running";
      return -1;
    }
    int status = 0;
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (waitpid(pid_, &status, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > deadline) {
        ADD_FAILURE() << "the program does not end";
        send(SIGKILL);
        waitpid(pid_, &status, 0);
        break;
      }
      usleep(2000);
    }
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  // -1 once it has ended.
  [[nodiscard]] pid_t id() const { return pid_; }

  [[nodiscard]] std::string messages() const { return read_file(folder_.file("stderr")); }

 private:
  static std::vector<char*> pointers(Words& words) {
    std::vector<char*> out;
    for (std::string& word : words) out.push_back(word.data());
    out.push_back(nullptr);
    return out;
  }

  std::string read_stdout(const char* stop) {
    std::string text;
    char buffer[65536];
    while (stop == nullptr || text.empty() || text.back() != *stop) {
      pollfd event{stdout_, POLLIN, 0};
      if (poll(&event, 1, 60000) <= 0) {
        ADD_FAILURE() << "no output from the program; so far: " << text;
        break;
      }
      const ssize_t got = read(stdout_, buffer, stop == nullptr ? sizeof buffer : 1);
      if (got <= 0) break;
      text.append(buffer, static_cast<std::size_t>(got));
    }
    return text;
  }

  Folder folder_;
  pid_t pid_ = -1;
  int stdout_ = -1;
};

struct Outcome {
  int code = -1;
  std::string out;
  std::string err;
};

inline Outcome run(const Words& arguments, const Words& environment = {}) {
  Process process(arguments, environment);
  Outcome outcome;
  outcome.out = process.read_all();
  outcome.code = process.wait();
  outcome.err = process.messages();
  return outcome;
}

// The port in the URL line of a daemon.
inline std::uint16_t port_of(Process& daemon) {
  const std::string url = daemon.read_until('\n');
  const auto colon = url.rfind(':');
  if (colon == std::string::npos) {
    ADD_FAILURE() << daemon.messages();
    return 0;
  }
  return static_cast<std::uint16_t>(std::stoi(url.substr(colon + 1)));
}

// A small series of a built-in sample, written by the program itself.
inline std::string synth(const Folder& folder, const std::string& sample, const std::string& dims) {
  std::string path = folder.file(sample + "-small.nc");
  const Outcome made = run({"synth", sample, "--dims", dims, "--steps", "2", "-o", path});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.out, "");
  return path;
}

// Width and height of a PNG (from its IHDR chunk).
inline std::pair<std::uint32_t, std::uint32_t> png_size(const std::string& png) {
  if (png.size() < 24 || png.compare(0, 8, "\x89PNG\r\n\x1a\n") != 0) return {0, 0};
  const auto big_endian = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i)
      value = value << 8 | static_cast<unsigned char>(png[i]);
    return value;
  };
  return {big_endian(16), big_endian(20)};
}

}  // namespace cli_test
