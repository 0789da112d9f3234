// A thread polls a signalfd and an eventfd that ends the watch.
#include "server/cli/signals.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <exception>
#include <new>
#include <system_error>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::cli {
namespace {

// Logging may fail when memory is exhausted.
void complain_of(const std::exception& fault) noexcept {
  try {
    log::error("the action of a signal failed", {{"fault", fault.what()}});
  } catch (const std::bad_alloc&) {
    log::error("the action of a signal failed", {});
  }
}

void watch(int signal_fd, int stop_fd, const std::function<void()>& on_first,
           const std::function<void()>& on_hangup, const AtOnce& on_second) {
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
    if (info.ssi_signo == SIGHUP) {
      on_hangup();
      continue;
    }
    if (seen) {
      if (on_second.before) on_second.before();
      _exit(on_second.code);
    }
    seen = true;
    try {
      on_first();
    } catch (const std::exception& fault) {
      complain_of(fault);
    }
  }
}

}  // namespace

Errand::Errand(std::function<void()> call)
    : thread_([this, call = std::move(call)] { run(call); }) {}

Errand::~Errand() {
  end(std::chrono::milliseconds(0));
  thread_.join();
}

void Errand::want() {
  const std::lock_guard lock(mutex_);
  wanted_ = true;
  changed_.notify_all();
}

bool Errand::end(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  ending_ = true;
  changed_.notify_all();
  return changed_.wait_for(lock, patience, [this] { return ended_; });
}

void Errand::run(const std::function<void()>& call) {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return wanted_ || ending_; });
    if (ending_) break;
    wanted_ = false;
    lock.unlock();
    try {
      call();
    } catch (const std::exception& fault) {
      complain_of(fault);
    }
    lock.lock();
  }
  ended_ = true;
  changed_.notify_all();
}

SignalWatch::SignalWatch(std::function<void()> on_first, std::function<void()> on_hangup,
                         AtOnce on_second) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  if (on_hangup) sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal_fd_ = signalfd(-1, &signals, SFD_CLOEXEC);
  stop_fd_ = eventfd(0, EFD_CLOEXEC);
  if (signal_fd_ < 0 || stop_fd_ < 0) {
    const int fault = errno;
    close(signal_fd_);
    close(stop_fd_);
    throw std::system_error(fault, std::generic_category(), "cannot wait for signals");
  }
  if (on_hangup) hangup_.emplace(std::move(on_hangup));
  watcher_ = std::thread([this, on_first = std::move(on_first), second = std::move(on_second)] {
    watch(
        signal_fd_, stop_fd_, on_first, [this] { hangup_->want(); }, second);
  });
}

bool SignalWatch::settle(std::chrono::milliseconds patience) {
  return !hangup_ || hangup_->end(patience);
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
