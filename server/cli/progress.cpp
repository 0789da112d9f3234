#include "server/cli/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "server/base/elapsed.hpp"
#include "server/base/error.hpp"
#include "server/cli/command.hpp"

namespace windsplat::cli {
namespace {

constexpr int bar_cells = 28;
constexpr double done_min = 0.005;  // before that the time left is not known
constexpr std::chrono::milliseconds interval{100};
constexpr std::size_t text_bytes_max = 40;
constexpr std::string_view clear_line = "\r\x1b[K";

// 65 -> "1:05", 3725 -> "1:02:05".
std::string clock_text(long long seconds) {
  const auto two = [](long long value) { return (value < 10 ? "0" : "") + std::to_string(value); };
  const long long minutes = seconds / 60;
  if (minutes < 60) return std::to_string(minutes) + ':' + two(seconds % 60);
  return std::to_string(minutes / 60) + ':' + two(minutes % 60) + ':' + two(seconds % 60);
}

}  // namespace

std::string progress_line(double done, double spent_s, std::string_view text) {
  done = std::clamp(done, 0.0, 1.0);
  const auto full = static_cast<std::size_t>(done * bar_cells);
  std::string line = "[" + std::string(full, '#') + std::string(bar_cells - full, '.') + "] ";
  const std::string percent = std::to_string(static_cast<int>(100 * done));
  line += std::string(3 - std::min<std::size_t>(percent.size(), 3), ' ') + percent + " %";
  if (done >= done_min && done < 1) {
    line += ", " + clock_text(std::llround(spent_s / done * (1 - done))) + " left";
  }
  if (!text.empty()) line += "  " + printable(text, text_bytes_max);
  return line;
}

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1 && verbosity() != Verbosity::quiet) {}

Progress::~Progress() { clear(); }

void Progress::show(double done, std::string_view text) {
  if (!terminal_) return;
  const std::lock_guard lock(mutex_);
  const Clock::time_point now = Clock::now();
  if (drawn_ && now - last_ < interval) return;
  last_ = now;
  std::string line(clear_line);
  line += progress_line(done, seconds_since(start_), text);
  std::fwrite(line.data(), 1, line.size(), stderr);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::clear() {
  const std::lock_guard lock(mutex_);
  if (drawn_) std::fwrite(clear_line.data(), 1, clear_line.size(), stderr);
  drawn_ = false;
}

}  // namespace windsplat::cli
