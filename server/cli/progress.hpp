// A line of progress on stderr: only on a terminal, and not with --quiet.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>

namespace windsplat::cli {

// "[#######.......]  43 %, 1:05 left  text": the time left follows from the time spent.
std::string progress_line(double done, double spent_s, std::string_view text);

// Receives which part of a task is done, 0 to 1, and what is being done; from any thread.
using ShowDone = std::function<void(double done, std::string_view doing)>;

// Its functions may be called from any thread.
class Progress {
 public:
  Progress();
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done`: 0 to 1. Draws at most ten times a second.
  void show(double done, std::string_view text);
  // Clears the line, as before other messages.
  void clear();
  // Whether anything is shown.
  [[nodiscard]] bool is_shown() const { return terminal_; }

 private:
  using Clock = std::chrono::steady_clock;
  const bool terminal_;
  std::mutex mutex_;  // guards the members below
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_;
};

}  // namespace windsplat::cli
