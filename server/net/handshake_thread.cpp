// A thread with a queue for each address.
#include "server/net/handshake_thread.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <system_error>

#include "server/base/log.hpp"
#include "server/net/attempt.hpp"

namespace windsplat::net {
namespace {

// Of setpriority(2): rendering and streams get ten times this thread's share where all want the
// same core.
constexpr int handshake_nice = 10;

}  // namespace

std::int64_t thread_cpu_us() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000 + time.tv_nsec / 1000;
}

HandshakeThread::HandshakeThread() : thread_([this] { run(); }) {}

HandshakeThread::~HandshakeThread() { stop(); }

void HandshakeThread::stop() {
  Lanes dropped;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    dropped.swap(lanes_);
  }
  dropped.clear();  // not under the lock: a step takes its connection with it
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void HandshakeThread::add(const std::string& address, std::unique_ptr<Step> step) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    const auto [lane, is_new] = lanes_.try_emplace(address);
    try {
      lane->second.push_back(std::move(step));
    } catch (const std::bad_alloc&) {
      if (is_new) lanes_.erase(lane);
      throw;
    }
  }
  changed_.notify_one();
}

std::unique_ptr<HandshakeThread::Step> HandshakeThread::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !lanes_.empty(); });
  if (ended_) return nullptr;
  auto lane = lanes_.upper_bound(last_);
  if (lane == lanes_.end()) lane = lanes_.begin();
  std::unique_ptr<Step> step = std::move(lane->second.front());
  lane->second.pop_front();
  if (!lane->second.empty()) {
    last_ = lane->first;
  } else {
    last_.swap(lanes_.extract(lane).key());
  }
  return step;
}

void HandshakeThread::run() {
  ::pthread_setname_np(::pthread_self(), "handshakes");
  if (::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), handshake_nice) != 0) {
    log::warn("TLS handshakes run at the priority of everything else",
              {{"fault", std::generic_category().message(errno)}});
  }
  while (true) {
    try {
      const std::unique_ptr<Step> step = next();
      if (step == nullptr) return;
      step->run();
    } catch (const std::exception& fault) {
      tell_fault("a TLS handshake was lost", fault);  // its deadline closes the connection
    }
  }
}

}  // namespace windsplat::net
