// A thread polls a signalfd for the signals and an eventfd for the end of the watch.
#include "server/cli/signals.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <system_error>
#include <utility>

namespace windsplat::cli {
namespace {

void watch(int signal_fd, int stop_fd, const std::function<void()>& on_first) {
  bool seen = false;
  std::array<pollfd, 2> events{{{signal_fd, POLLIN, 0}, {stop_fd, POLLIN, 0}}};
  while (true) {
    if (poll(events.data(), events.size(), -1) < 0) {
      if (errno == EINTR) continue;
      return;
    }
    if ((events[1].revents & POLLIN) != 0) return;
    signalfd_siginfo info{};
    if (read(signal_fd, &info, sizeof info) != sizeof info) continue;
    if (seen) _exit(1);
    seen = true;
    on_first();
  }
}

}  // namespace

SignalWatch::SignalWatch(std::function<void()> on_first) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal_fd_ = signalfd(-1, &signals, SFD_CLOEXEC);
  stop_fd_ = eventfd(0, EFD_CLOEXEC);
  if (signal_fd_ < 0 || stop_fd_ < 0) {
    const int fault = errno;
    close(signal_fd_);
    close(stop_fd_);
    throw std::system_error(fault, std::generic_category(), "cannot wait for signals");
  }
  watcher_ = std::thread(
      [this, on_first = std::move(on_first)] { watch(signal_fd_, stop_fd_, on_first); });
}

SignalWatch::~SignalWatch() {
  const std::uint64_t one = 1;
  while (write(stop_fd_, &one, sizeof one) < 0 && errno == EINTR) {
  }
  watcher_.join();
  close(signal_fd_);
  close(stop_fd_);
}

}  // namespace windsplat::cli
