// One queue and a few threads, each of which takes the first job whose dataset is not in use.
#include "server/work/load_service.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "server/work/run_guarded.hpp"

namespace windsplat::work {

struct LoadService::State {
  using Clock = std::chrono::steady_clock;

  State(std::size_t at_a_time, std::size_t most, const char* name, std::function<void()> told)
      : places(at_a_time), jobs_max(most), what(name), refused(std::move(told)) {}

  // Cannot throw: its bookkeeping was allocated before.

  void work() {
    std::unique_lock lock(mutex);
    for (;;) {
      const auto next = next_job(lock);
      if (next == jobs.end()) return;
      std::optional<Job> job(std::move(*next));
      jobs.erase(next);
      // A cancelled job needs no free dataset.
      const std::shared_ptr<const void> dataset =
          job->cancel.cancelled() ? nullptr : std::move(job->dataset);
      if (dataset) busy.push_back(dataset);
      const Clock::time_point begun = Clock::now();
      running.push_back(begun);
      lock.unlock();
      try {
        job->run();
      } catch (const std::exception& fault) {
        log_fault("a load job failed", fault);
      }
      job.reset();  // release what the job holds before locking
      lock.lock();
      if (dataset) busy.erase(std::find(busy.begin(), busy.end(), dataset));
      running.erase(std::find(running.begin(), running.end(), begun));
      wake.notify_all();
    }
  }

  // Waits for a job that may start; none at shutdown.
  std::deque<Job>::iterator next_job(std::unique_lock<std::mutex>& lock) {
    for (;;) {
      const auto next = first_free();
      if (next == jobs.end()) {
        if (ending && jobs.empty()) return next;
        wake.wait(lock);
      } else if (running.size() < places) {
        return next;
      } else {
        // The most recent jobs are limited to the number of places until one has run for
        // `long_run`.
        const Clock::time_point at = running[running.size() - places] + long_run;
        if (at <= Clock::now()) return next;
        wake.wait_until(lock, at);
      }
    }
  }

  // Requires the mutex.
  [[nodiscard]] std::deque<Job>::iterator first_free() {
    return std::find_if(jobs.begin(), jobs.end(), [this](const Job& job) {
      return !job.dataset || job.cancel.cancelled() ||
             std::find(busy.begin(), busy.end(), job.dataset) == busy.end();
    });
  }

  // Requires the mutex.
  [[nodiscard]] bool has_room(const Job& job) const {
    if (job.admitted) return true;
    Count all;
    Count same;
    for (const Job& known : jobs) {
      if (known.admitted || known.cancel.cancelled()) continue;
      const bool own = !job.payer.empty() && known.payer == job.payer;
      all.add(own);
      if (known.dataset == job.dataset) same.add(own);
    }
    return same.has_room(jobs_max) && all.has_room(datasets_full * jobs_max);
  }

  struct Count {
    std::size_t jobs = 0;
    std::size_t own = 0;  // waiting jobs of this payer
    void add(bool is_own) {
      ++jobs;
      own += is_own ? 1U : 0U;
    }
    [[nodiscard]] bool has_room(std::size_t most) const {
      return jobs < most && own < std::max<std::size_t>(most / 2, 1);
    }
  };

  const std::size_t places;
  const std::size_t jobs_max;
  const char* const what;
  const std::function<void()> refused;
  std::mutex mutex;
  std::condition_variable wake;
  std::deque<Job> jobs;
  // Reserved for one entry per thread:
  std::vector<std::shared_ptr<const void>> busy;
  std::vector<Clock::time_point> running;  // start times, oldest first
  bool ending = false;
  std::vector<std::thread> threads;
};

LoadService::LoadService(std::size_t threads, std::size_t jobs_max, const char* what,
                         std::function<void()> refused, std::size_t spare)
    : state_(std::make_unique<State>(threads, jobs_max, what, std::move(refused))) {
  state_->busy.reserve(threads + spare);
  state_->running.reserve(threads + spare);
  for (std::size_t i = 0; i < threads + spare; ++i) {
    state_->threads.emplace_back([state = state_.get()] { state->work(); });
  }
}

LoadService::~LoadService() { end(); }

Result<void> LoadService::submit(Job job) {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->ending) return make_error(ErrorKind::draining, "the server is shutting down");
    if (!state_->has_room(job)) {
      if (state_->refused) state_->refused();
      return make_error(ErrorKind::busy,
                        std::string("too many ") + state_->what +
                            " are waiting, for this address or in total; try again");
    }
    state_->jobs.push_back(std::move(job));
  }
  state_->wake.notify_all();  // every waiting thread checks for a free place
  return {};
}

void LoadService::end() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ending = true;
    for (const Job& job : state_->jobs) job.cancel.cancel();
  }
  state_->wake.notify_all();
  for (std::thread& thread : state_->threads) {
    if (thread.joinable()) thread.join();
  }
}

}  // namespace windsplat::work
