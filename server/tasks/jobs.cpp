// The list of jobs; a task executor has their threads and their order.
#include "server/tasks/jobs.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double progress_for_eta = 0.01;  // progress below which the remaining time cannot be
                                           // estimated

enum class Stage { queued, running, done, failed, cancelled };

const char* name_of(Stage stage) {
  switch (stage) {
    case Stage::queued:
      return "queued";
    case Stage::running:
      return "running";
    case Stage::done:
      return "done";
    case Stage::failed:
      return "failed";
    case Stage::cancelled:
      return "cancelled";
  }
  return "failed";
}

struct Job {
  std::string id;
  std::string kind;
  Jobs::Work work;  // empty once started or cancelled
  CancelToken cancel;
  Stage stage = Stage::queued;
  bool in_queue = true;  // of the executor, also after it was cancelled
  Clock::time_point since;
  std::atomic<double> progress{0};
  std::optional<protocol::JobResult> result;
  std::optional<Error> error;

  [[nodiscard]] bool finished() const { return stage != Stage::queued && stage != Stage::running; }
};

protocol::JobDescription describe(const Job& job) {
  protocol::JobDescription out;
  out.id = job.id;
  out.kind = job.kind;
  out.state = name_of(job.stage);
  out.progress = job.progress;
  if (job.stage == Stage::running && out.progress >= progress_for_eta) {
    const std::chrono::duration<double, std::milli> taken = Clock::now() - job.since;
    out.eta_ms = std::ceil(taken.count() * (1 - out.progress) / out.progress);
  }
  out.result = job.result;
  if (job.error) out.problem = protocol::problem_from(*job.error);
  return out;
}

// Does not throw.
Result<protocol::JobResult> run_work(const Jobs::Work& work, const std::shared_ptr<Job>& job) {
  return run_guarded<protocol::JobResult>("client job", job->cancel, [&] {
    return work({job->cancel, [job](double done) { job->progress = std::clamp(done, 0.0, 1.0); }});
  });
}

}  // namespace

struct Jobs::State {
  using Shared = std::shared_ptr<Job>;

  explicit State(const TaskExecutor::Settings& settings)
      : known_max(settings.tasks_max), threads(settings) {}

  void run(const Shared& job) {
    Work task;
    {
      const std::lock_guard lock(mutex);
      job->in_queue = false;
      if (job->stage != Stage::queued) return;  // cancelled
      job->stage = Stage::running;
      job->since = Clock::now();
      task = std::exchange(job->work, nullptr);
    }
    auto outcome = run_work(task, job);
    task = nullptr;  // release what the job holds before locking
    const std::lock_guard lock(mutex);
    finish(*job, std::move(outcome));
  }

  // Only moves values: no exception may leave the thread.
  static void finish(Job& job, Result<protocol::JobResult> outcome) noexcept {
    if (outcome) {
      job.stage = Stage::done;
      job.progress = 1;
      job.result = std::move(*outcome);
      return;
    }
    Error error = std::move(outcome).error();
    const bool cancelled = error.kind == ErrorKind::cancelled;
    job.stage = cancelled ? Stage::cancelled : Stage::failed;
    if (!cancelled) job.error = std::move(error);
  }

  // The functions below require the mutex.
  [[nodiscard]] Result<Shared> find(const std::string& id) const {
    const auto at =
        std::find_if(jobs.begin(), jobs.end(), [&](const Shared& job) { return job->id == id; });
    if (at == jobs.end()) {
      return make_error(ErrorKind::not_found, "unknown job '" + printable(id, 40) + "'");
    }
    return *at;
  }

  // A cancelled job is listed until it has left the queue, so that the list bounds the queue.
  [[nodiscard]] bool make_room() {
    if (jobs.size() < known_max) return true;
    const auto oldest = std::find_if(jobs.begin(), jobs.end(), [](const Shared& job) {
      return job->finished() && !job->in_queue;
    });
    if (oldest == jobs.end()) return false;
    jobs.erase(oldest);
    return true;
  }

  static void cancel(Job& job) {
    job.cancel.cancel();
    if (job.stage != Stage::queued) return;
    job.stage = Stage::cancelled;
    job.work = nullptr;
  }

  const std::size_t known_max;
  mutable std::mutex mutex;
  std::list<Shared> jobs;
  std::uint64_t next_id = 1;
  std::map<std::string, std::shared_ptr<const void>> one_slow;  // their keys, by kind
  TaskExecutor threads;  // last: its threads use the members above
};

Jobs::Jobs(const TaskExecutor::Settings& settings) : state_(std::make_unique<State>(settings)) {}

Jobs::~Jobs() { end(); }

void Jobs::end() {
  cancel_all();
  state_->threads.end();
}

Result<protocol::JobDescription> Jobs::submit(std::string kind, Work work, const Terms& terms) {
  const auto job = std::make_shared<Job>();
  job->kind = std::move(kind);
  job->work = std::move(work);
  job->cancel = terms.cancel;
  const std::lock_guard lock(state_->mutex);
  if (!state_->make_room()) {
    return make_error(ErrorKind::busy, std::to_string(state_->known_max) +
                                           " jobs are waiting or running, which is the limit; try "
                                           "again after one has finished");
  }
  job->id = std::to_string(state_->next_id);
  auto described = describe(*job);
  std::list<State::Shared> entry{job};  // allocated before the task is queued
  std::shared_ptr<const void> key;
  if (terms.slow) {
    auto& known = state_->one_slow[job->kind];
    if (!known) known = std::make_shared<int>(0);
    key = known;
  }
  const auto queued = state_->threads.submit(
      {job->cancel, [state = state_.get(), job] { state->run(job); }, true, std::move(key)});
  if (!queued) return queued.error();
  ++state_->next_id;
  state_->jobs.splice(state_->jobs.end(), entry);
  return described;
}

std::vector<protocol::JobDescription> Jobs::list() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<protocol::JobDescription> out;
  for (const auto& job : state_->jobs) out.push_back(describe(*job));
  return out;
}

Result<protocol::JobDescription> Jobs::find(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  const auto job = state_->find(id);
  if (!job) return job.error();
  return describe(**job);
}

Result<void> Jobs::cancel(const std::string& id) {
  const std::lock_guard lock(state_->mutex);
  const auto job = state_->find(id);
  if (!job) return job.error();
  State::cancel(**job);
  return {};
}

void Jobs::cancel_all() {
  const std::lock_guard lock(state_->mutex);
  for (const auto& job : state_->jobs) State::cancel(*job);
}

}  // namespace windsplat::tasks
