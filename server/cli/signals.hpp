// SIGTERM and SIGINT, and where wanted SIGHUP -> a call in an ordinary thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace windsplat::cli {

// A call that may take any time, by a thread of its own, so that whoever wants it never waits. It
// is made once more where it is wanted while it is under way. What it throws is logged.
class Errand {
 public:
  explicit Errand(std::function<void()> call);
  ~Errand();  // waits for the call that is under way
  Errand(const Errand&) = delete;
  Errand& operator=(const Errand&) = delete;

  void want();
  // No further call is begun. Whether none is under way any more, at the latest after `patience`.
  bool end(std::chrono::milliseconds patience);

 private:
  void run(const std::function<void()>& call);

  std::mutex mutex_;
  std::condition_variable changed_;
  bool wanted_ = false;
  bool ending_ = false;
  bool ended_ = false;
  std::thread thread_;  // last: it uses the others
};

// What a second SIGTERM or SIGINT does: it ends the process at once.
struct AtOnce {
  int code = 1;                            // of the exit
  std::function<void()> before = nullptr;  // by the watching thread, while the others go on
};

// Make it before any other thread: it blocks the signals for the thread that makes it and those
// started from there, and waits for them in a thread of its own.
class SignalWatch {
 public:
  // `on_first` once, by the watching thread, for SIGTERM or SIGINT: it must not wait. `on_hangup`
  // after every SIGHUP, by another thread; without it that one is left alone.
  explicit SignalWatch(std::function<void()> on_first, std::function<void()> on_hangup = nullptr,
                       AtOnce on_second = {});
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  // Calls `on_hangup` no more. False if a call did not end within `patience`: destroying this would
  // wait for it.
  bool settle(std::chrono::milliseconds patience);

 private:
  int signal_fd_ = -1;
  int stop_fd_ = -1;
  std::optional<Errand> hangup_;
  std::thread watcher_;
};

}  // namespace windsplat::cli
