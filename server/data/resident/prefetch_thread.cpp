// Owners in turn, the earliest request of each first; failed requests wait for new ones.
#include "server/data/resident/prefetch_thread.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::data {

struct PrefetchThread::State {
  explicit State(std::shared_ptr<Budget> shared)
      : budget(std::move(shared)), thread([this] { work(); }) {}

  void work() {
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [this] { return stopping || !queues.empty(); });
      if (stopping) return;
      const std::uint64_t owner = next_owner();
      Queue& queue = queues[owner];
      const std::uint64_t version = queue.version;
      std::optional<PrefetchRequest> request = std::move(queue.requests.front());
      queue.requests.pop_front();
      if (queue.requests.empty()) queues.erase(owner);
      lock.unlock();
      const Outcome outcome = load(*request, owner);
      request.reset();
      lock.lock();
      // If there is no room for this request, there is none for the later ones, until they are
      // replaced.
      const auto rest = queues.find(owner);
      const bool full = outcome == Outcome::no_room;
      if (full && rest != queues.end() && rest->second.version == version) queues.erase(rest);
    }
  }

  // The owner after the last one served, in cyclic order.
  std::uint64_t next_owner() {
    auto next = queues.upper_bound(last);
    if (next == queues.end()) next = queues.begin();
    last = next->first;
    return last;
  }

  enum class Outcome : std::uint8_t { done, no_room, failed };

  Outcome load(const PrefetchRequest& request, std::uint64_t owner) noexcept {
    try {
      const Outcome outcome = try_to_load(request);
      if (outcome == Outcome::failed) note_failed(request, owner);
      return outcome;
    } catch (const std::exception&) {
      log::error("prefetch failed");  // no details: there may be no memory for them
      return Outcome::no_room;
    }
  }
  // Unless the owner has withdrawn its requests.
  void note_failed(const PrefetchRequest& request, std::uint64_t owner) {
    const auto key = request.dataset.key_of(request.field, request.step, request.how);
    const std::lock_guard lock(mutex);
    if (key && owners.contains(owner)) failed[owner].insert_or_assign(*key, Clock::now());
  }
  // Whether it failed a short while ago.
  bool has_failed(std::uint64_t owner, const ResidentKey& key) {
    const std::lock_guard lock(mutex);
    const auto of = failed.find(owner);
    if (of == failed.end()) return false;
    const auto one = of->second.find(key);
    if (one == of->second.end()) return false;
    if (Clock::now() < one->second + retry_after) return true;
    of->second.erase(one);
    return false;
  }
  static Outcome try_to_load(const PrefetchRequest& request) {
    const auto loaded =
        request.dataset.prefetching().derived(request.field, request.step, request.how);
    if (loaded) return Outcome::done;
    const Error& error = loaded.error();
    if (error.kind == ErrorKind::out_of_memory) return Outcome::no_room;
    const bool given_up = error.kind == ErrorKind::not_resident ||
                          error.kind == ErrorKind::not_found || error.kind == ErrorKind::draining;
    if (given_up) return Outcome::done;
    log::debug("prefetch failed", {{"dataset", request.dataset.info().id},
                                   {"field", request.field},
                                   {"step", request.step},
                                   {"error", error.message}});
    return Outcome::failed;
  }

  const std::shared_ptr<Budget> budget;
  std::mutex mutex;
  std::condition_variable wake;
  struct Queue {
    std::deque<PrefetchRequest> requests;  // requests that are not yet loaded; never empty
    std::uint64_t version = 0;             // distinguishes them from later requests of the owner
  };
  std::map<std::uint64_t, Queue> queues;  // keyed by owner
  std::set<std::uint64_t> owners;         // that have requests
  // What could not be read of them, and when. It is not tried again for a while: a moving view
  // repeats its requests at each frame.
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds retry_after{10};
  std::map<std::uint64_t, std::map<ResidentKey, Clock::time_point>> failed;
  std::uint64_t version = 0;
  std::uint64_t last = 0;
  bool stopping = false;
  std::thread thread;  // last member: the thread uses all of the above
};

PrefetchThread::PrefetchThread(std::shared_ptr<Budget> budget)
    : state_(std::make_unique<State>(std::move(budget))) {}

PrefetchThread::~PrefetchThread() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
  }
  state_->wake.notify_one();
  state_->thread.join();
}

void PrefetchThread::request_prefetch(std::uint64_t owner, std::vector<PrefetchRequest> requests) {
  if (requests.empty()) {  // without allocation, as destructors require
    state_->budget->request_prefetch(owner, {});
    const std::lock_guard lock(state_->mutex);
    state_->queues.erase(owner);
    state_->owners.erase(owner);
    state_->failed.erase(owner);
    return;
  }
  std::vector<ResidentKey> keys;
  std::deque<PrefetchRequest> absent;
  for (PrefetchRequest& request : requests) {
    if (request.with) keys.push_back(*request.with);
    const auto own = request.dataset.key_of(request.field, request.step, request.how);
    if (!own) continue;
    keys.push_back(*own);
    if (state_->budget->has(*own) || state_->has_failed(owner, *own)) continue;
    absent.push_back(std::move(request));
  }
  state_->budget->request_prefetch(owner, keys);
  {
    const std::lock_guard lock(state_->mutex);
    state_->owners.insert(owner);
    if (absent.empty()) {
      state_->queues.erase(owner);
    } else {
      state_->queues[owner] = {std::move(absent), ++state_->version};
    }
  }
  state_->wake.notify_one();
}

void PrefetchThread::forget(const DatasetInfo& info) {
  const std::lock_guard lock(state_->mutex);
  for (auto at = state_->queues.begin(); at != state_->queues.end();) {
    auto& queue = at->second.requests;
    std::erase_if(queue,
                  [&](const PrefetchRequest& request) { return &request.dataset.info() == &info; });
    at = queue.empty() ? state_->queues.erase(at) : std::next(at);
  }
}

}  // namespace windsplat::data
