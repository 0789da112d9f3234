// SIGTERM and SIGINT -> a call in an ordinary thread.
#pragma once

#include <functional>
#include <thread>

namespace windsplat::cli {

// Make it before any other thread: it blocks both signals for the thread that makes it and those
// started from there, and waits for them in a thread of its own.
class SignalWatch {
 public:
  // `on_first` is called once, by the watching thread. A second signal ends the process at once,
  // with exit code 1.
  explicit SignalWatch(std::function<void()> on_first);
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

 private:
  int signal_fd_ = -1;
  int stop_fd_ = -1;
  std::thread watcher_;
};

}  // namespace windsplat::cli
