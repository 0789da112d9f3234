// A thread with a queue for each address.
#include "server/transport/handshake_thread.hpp"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <system_error>

#include "server/base/log.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::transport {
namespace {

// For setpriority(2): rendering and streams get ten times this thread's share of a contended core.
constexpr int handshake_nice = 10;
constexpr std::size_t address_chars_max = 64;  // limit of an address key

}  // namespace

std::int64_t thread_cpu_us() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000 + time.tv_nsec / 1000;
}

HandshakeThread::HandshakeThread() {
  last_.reserve(address_chars_max);
  thread_ = std::thread([this] { run(); });
}

HandshakeThread::~HandshakeThread() { stop(); }

void HandshakeThread::stop() {
  Lanes dropped;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    dropped.swap(lanes_);
  }
  dropped.clear();
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void HandshakeThread::add(const std::string& address, const void* owner,
                          std::unique_ptr<Step> step) {
  Lane added;
  added.push_back({owner, std::move(step)});
  Lanes fresh;
  fresh.try_emplace(address);
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    lanes_.merge(fresh);  // no effect if the lane exists
    Lane& lane = lanes_.find(address)->second;
    lane.splice(lane.end(), added);
  }
  changed_.notify_one();
}

void HandshakeThread::drop(const std::string& address, const void* owner) {
  Lane dropped;
  Lanes::node_type spent;
  const std::lock_guard lock(mutex_);
  const auto lane = lanes_.find(address);
  if (lane == lanes_.end()) return;
  for (auto at = lane->second.begin(); at != lane->second.end();) {
    const auto here = at++;
    if (here->owner == owner) dropped.splice(dropped.end(), lane->second, here);
  }
  if (lane->second.empty()) spent = lanes_.extract(lane);
}

std::unique_ptr<HandshakeThread::Step> HandshakeThread::next() {
  Lane taken;
  Lanes::node_type spent;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !lanes_.empty(); });
  if (ended_) return nullptr;
  auto lane = lanes_.upper_bound(last_);
  if (lane == lanes_.end()) lane = lanes_.begin();
  last_ = lane->first;
  taken.splice(taken.end(), lane->second, lane->second.begin());
  if (lane->second.empty()) spent = lanes_.extract(lane);
  return std::move(taken.front().step);
}

void HandshakeThread::run() {
  ::pthread_setname_np(::pthread_self(), "handshakes");
  if (::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), handshake_nice) != 0) {
    log::warn("cannot lower the priority of the TLS handshake thread",
              {{"fault", std::generic_category().message(errno)}});
  }
  while (true) {
    try {
      const std::unique_ptr<Step> step = next();
      if (step == nullptr) return;
      step->run();
    } catch (const std::exception& fault) {
      // The deadline of the handshake closes the connection.
      tasks::log_fault("TLS handshake step failed", fault);
    }
  }
}

}  // namespace windsplat::transport
