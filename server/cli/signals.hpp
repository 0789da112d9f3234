// Handles SIGTERM, SIGINT and optionally SIGHUP by calls on ordinary threads.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace windsplat::cli {

// Runs a call on a separate thread, so that requesting it never blocks. A request during a call
// causes one more call. Exceptions are logged.
class Errand {
 public:
  explicit Errand(std::function<void()> call);
  ~Errand();  // waits for a running call
  Errand(const Errand&) = delete;
  Errand& operator=(const Errand&) = delete;

  void want();
  // Starts no further call. Returns whether none is running after at most `patience`.
  bool end(std::chrono::milliseconds patience);

 private:
  void run(const std::function<void()>& call);

  std::mutex mutex_;
  std::condition_variable changed_;
  bool wanted_ = false;
  bool ending_ = false;
  bool ended_ = false;
  std::thread thread_;  // declared last: uses the other members
};

// Action on a second SIGTERM or SIGINT: exit at once.
struct AtOnce {
  int code = 1;                            // exit code
  std::function<void()> before = nullptr;  // called on the watching thread before the action
};

// Construct before any other thread: blocks the signals for this thread and those it starts, and
// waits for them on a separate thread.
class SignalWatch {
 public:
  // Calls `on_first` once on the watching thread for SIGTERM or SIGINT: it must not block. Calls
  // `on_hangup` on another thread after every SIGHUP, which is unchanged if it is empty.
  explicit SignalWatch(std::function<void()> on_first, std::function<void()> on_hangup = nullptr,
                       AtOnce on_second = {});
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  // Stops calling `on_hangup`. False if a call did not end within `patience`: the destructor would
  // wait for it.
  bool settle(std::chrono::milliseconds patience);

 private:
  int signal_fd_ = -1;
  int stop_fd_ = -1;
  std::optional<Errand> hangup_;
  std::thread watcher_;
};

}  // namespace windsplat::cli
