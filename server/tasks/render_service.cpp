// Render thread and admission of jobs.
#include "server/tasks/render_service.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {
namespace {

constexpr int retry_after_s_max = 60;

std::int64_t steady_us() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

// Fraction of a request's own time that earlier requests may take.
constexpr double patient_share = 0.75;
// Above this rate of refusals per second, new jobs arrive soon: admit a job only when the running
// one is nearly done.
constexpr double refusals_of_overload = 8;
constexpr double hurried_share = 0.5;

Error too_busy(const RenderQueue::Load& waiting) {
  const double seconds = std::ceil(waiting.cost_ms / 1000);
  const int after_s = static_cast<int>(std::clamp(seconds, 1.0, double{retry_after_s_max}));
  std::string detail = std::to_string(waiting.count);
  detail += " pictures are waiting to be drawn, which is the limit; try again in ";
  detail += std::to_string(after_s);
  detail += " s";
  Error error = make_error(ErrorKind::busy, std::move(detail));
  error.retry_after_s = after_s;
  return error;
}

}  // namespace

struct RenderService::State {
  explicit State(Options wanted) : options(std::move(wanted)) {
    if (!options.now_us) options.now_us = steady_us;
    thread = std::thread([this] { work(); });
  }

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      wake.wait(lock, [this] { return stopping || !queue.empty(); });
      std::optional<RenderQueue::Next> next = queue.pop(options.now_us());
      if (!next) return;
      const bool streams = next->job.kind == Kind::stream;
      if (streams && !next->job.cancel.cancelled()) note_wait(next->since_us);
      lock.unlock();
      const std::int64_t took_us = run(*next);
      const bool whole = !next->job.cancel.cancelled();
      next.reset();  // release what the job holds before locking
      lock.lock();
      queue.done(took_us);
      if (streams && whole) note_run(took_us);
    }
  }

  // Requires the mutex.
  void note_wait(std::int64_t since_us) {
    constexpr std::int64_t weight = 8;  // of the earlier ones, to 1
    const std::int64_t now_us = options.now_us();
    stream_wait_us = (wait_now_us() * (weight - 1) + now_us - since_us) / weight;
    waited_at_us = now_us;
  }
  [[nodiscard]] std::int64_t wait_now_us() const {
    constexpr std::int64_t life_us = 1'000'000;
    return options.now_us() - waited_at_us < life_us ? stream_wait_us : 0;
  }
  [[nodiscard]] std::int64_t expected_wait_us() const {
    return std::max(wait_now_us(),
                    static_cast<std::int64_t>(queue.streams_waiting()) * stream_took_us);
  }
  // Requires the mutex.
  void note_run(std::int64_t took_us) {
    constexpr std::int64_t weight = 8;  // of the earlier ones, to 1
    stream_took_us = (stream_took_us * (weight - 1) + took_us) / weight;
  }

  // Returns the run time. Catches all exceptions.
  std::int64_t run(const RenderQueue::Next& next) noexcept {
    const std::int64_t began_us = options.now_us();
    try {
      next.job.run(began_us - next.since_us);
    } catch (const std::exception& fault) {
      log_fault("a render job failed", fault);
    }
    const std::int64_t took_us = options.now_us() - began_us;
    try {
      if (options.charge && !next.job.payer.empty()) {
        options.charge(next.job.payer, took_us + next.job.spent_us);
      }
    } catch (const std::exception& fault) {
      log_fault("a render job could not be charged", fault);
    }
    return took_us;
  }

  // Requires the mutex.
  [[nodiscard]] bool has_room(const Job& job, const RenderQueue::Load& waiting) const {
    if (job.kind != Kind::request || job.admitted) return true;
    const double rest_ms = queue.rest_ms(options.now_us());
    if (options.others_ms_max > 0 && overloaded() &&
        rest_ms > hurried_share * std::max(options.others_ms_max, job.cost_ms)) {
      return false;
    }
    if (waiting.count == 0) return true;
    if (waiting.count >= options.requests_max ||
        waiting.cost_ms + job.cost_ms > options.requests_ms_max) {
      return false;
    }
    // One payer cannot occupy all slots.
    const std::size_t own_max = std::max<std::size_t>(options.requests_max / 2, 1);
    if (!job.payer.empty() && queue.requests_of(job.payer).count >= own_max) return false;
    if (options.others_ms_max <= 0) return true;
    const auto others = queue.requests_before(job.payer, options.others_ms_max);
    return others.count == 0 ||
           rest_ms + others.cost_ms <= std::max(options.others_ms_max, patient_share * job.cost_ms);
  }

  // Recent refusals, with exponentially decaying weight.
  [[nodiscard]] double pressure_now() const {
    const double since_s = static_cast<double>(options.now_us() - pressure_at_us) / 1e6;
    return pressure * std::exp(-std::max(since_s, 0.0));
  }
  [[nodiscard]] bool overloaded() const { return pressure_now() > refusals_of_overload; }
  void refuse() {
    pressure = pressure_now() + 1;
    pressure_at_us = options.now_us();
    if (options.refused) options.refused();
  }

  Options options;
  std::mutex mutex;
  std::condition_variable wake;
  RenderQueue queue;
  double pressure = 0;
  std::int64_t pressure_at_us = 0;
  std::int64_t stream_wait_us = 0;
  std::int64_t stream_took_us =
      33'000;  // recent mean; until one was run, that of the default budget
  std::int64_t waited_at_us = 0;
  bool stopping = false;
  std::thread thread;
};

RenderService::RenderService(Options options)
    : state_(std::make_unique<State>(std::move(options))) {}

RenderService::~RenderService() { end(); }

void RenderService::end() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
    state_->queue.cancel_all();
  }
  state_->wake.notify_one();
  if (state_->thread.joinable()) state_->thread.join();
}

Result<void> RenderService::submit(Job job) {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->stopping) return make_error(ErrorKind::draining, "the server is shutting down");
    const RenderQueue::Load waiting = state_->queue.requests_waiting();
    if (!state_->has_room(job, waiting)) {
      state_->refuse();
      return too_busy(waiting);
    }
    state_->queue.push(std::move(job), state_->options.now_us());
  }
  state_->wake.notify_one();
  return {};
}

std::int64_t RenderService::stream_wait_us() const {
  const std::lock_guard lock(state_->mutex);
  return state_->expected_wait_us();
}

void RenderService::cancel_all() {
  const std::lock_guard lock(state_->mutex);
  state_->queue.cancel_all();
}

}  // namespace windsplat::tasks
