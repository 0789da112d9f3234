// Two rings of owners, one a kind; the renderer's thread takes from them in turn.
#include "server/net/render_service.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::net {
namespace {

using Clock = std::chrono::steady_clock;

struct Waiting {
  RenderService::Job job;
  Clock::time_point since;
};

struct Owner {
  std::uint64_t id = 0;
  std::deque<Waiting> jobs;
};

// Owners with something to do, the next one in front.
struct Ring {
  std::deque<Owner> owners;
  std::size_t waiting = 0;

  void push(Waiting waiting_job) {
    const std::uint64_t id = waiting_job.job.owner;
    auto owner = std::find_if(owners.begin(), owners.end(),
                              [&](const Owner& known) { return known.id == id; });
    if (owner == owners.end()) owner = owners.insert(owners.end(), Owner{id, {}});
    owner->jobs.push_back(std::move(waiting_job));
    ++waiting;
  }

  // Jobs whose answer somebody still waits for; the others cost next to nothing.
  [[nodiscard]] std::size_t wanted() const {
    std::size_t count = 0;
    for (const Owner& owner : owners) {
      for (const Waiting& kept : owner.jobs) count += kept.job.cancel.cancelled() ? 0U : 1U;
    }
    return count;
  }

  std::optional<Waiting> pop() {
    if (owners.empty()) return std::nullopt;
    Owner owner = std::move(owners.front());
    owners.pop_front();
    Waiting next = std::move(owner.jobs.front());
    owner.jobs.pop_front();
    if (!owner.jobs.empty()) owners.push_back(std::move(owner));
    --waiting;
    return next;
  }
};

}  // namespace

struct RenderService::State {
  explicit State(std::size_t requests) : requests_max(requests), thread([this] { work(); }) {}

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      wake.wait(lock, [this] { return stopping || rings[0].waiting + rings[1].waiting > 0; });
      std::optional<Waiting> next = take();
      if (!next) return;
      running = next->job.cancel;
      lock.unlock();
      run(*next);
      next.reset();  // what the job holds goes before the lock is taken
      lock.lock();
      running.reset();
    }
  }

  std::optional<Waiting> take() {
    turn = 1 - turn;
    auto next = rings[turn].pop();
    return next ? std::move(next) : rings[1 - turn].pop();
  }

  static void run(const Waiting& next) {
    const auto queued = Clock::now() - next.since;
    try {
      next.job.run(std::chrono::duration_cast<std::chrono::microseconds>(queued).count());
    } catch (const std::exception& fault) {
      log::error("a render job failed", {{"fault", fault.what()}});
    }
  }

  void cancel_all() {
    const std::lock_guard lock(mutex);
    for (const Ring& ring : rings) {
      for (const Owner& owner : ring.owners) {
        for (const Waiting& waiting : owner.jobs) waiting.job.cancel.cancel();
      }
    }
    if (running) running->cancel();
  }

  const std::size_t requests_max;
  std::mutex mutex;
  std::condition_variable wake;
  std::array<Ring, 2> rings;  // by Kind
  std::size_t turn = 0;
  std::optional<CancelToken> running;
  bool stopping = false;
  std::thread thread;  // last: it uses all of the above
};

RenderService::RenderService(std::size_t requests_max)
    : state_(std::make_unique<State>(requests_max)) {}

RenderService::~RenderService() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
  }
  state_->cancel_all();
  state_->wake.notify_one();
  state_->thread.join();
}

Result<void> RenderService::submit(Job job) {
  {
    const std::lock_guard lock(state_->mutex);
    Ring& ring = state_->rings[static_cast<std::size_t>(job.kind)];
    if (job.kind == Kind::request && ring.wanted() >= state_->requests_max) {
      return make_error(ErrorKind::busy, "more pictures are asked for than can be drawn; try " +
                                             std::string("again in a moment"));
    }
    ring.push({std::move(job), Clock::now()});
  }
  state_->wake.notify_one();
  return {};
}

void RenderService::cancel_all() { state_->cancel_all(); }

}  // namespace windsplat::net
