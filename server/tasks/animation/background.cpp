#include "server/tasks/animation/background.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {
namespace {

using Clock = BackgroundOwner::Clock;

constexpr std::chrono::milliseconds notice_time{20};

// State shared by the job's thread and the renderer; lives until both are done.
struct Part {
  std::mutex mutex;
  std::condition_variable changed;
  bool has_begun = false;
  std::optional<Result<void>> outcome;
  Clock::duration took{};
};

// Why the job need not go on, if so.
Result<void> check(const BackgroundOwner& owner, const CancelToken& unwanted) {
  if (unwanted.cancelled()) return make_error(ErrorKind::cancelled, "job cancelled");
  if (!owner.until || Clock::now() < *owner.until) return {};
  return make_error(ErrorKind::busy, "the time for drawing is over");
}

RenderJob job_of(const BackgroundOwner& owner, bool insists, const std::shared_ptr<Part>& part,
                 const std::function<Result<void>(const CancelToken& stop)>& draw) {
  RenderJob job;
  job.kind = insists ? RenderKind::request : RenderKind::background;
  job.admitted = true;  // as a job
  job.is_background_turn = insists;
  job.owner = owner.owner;
  job.payer = owner.payer;
  job.cost_ms = owner.cost_ms;
  job.run = [part, draw, stop = job.cancel](std::int64_t /*queue_us*/) {
    const auto begun = Clock::now();
    {
      const std::lock_guard lock(part->mutex);
      part->has_begun = true;
    }
    auto outcome = run_guarded<void>("background work", stop, [&] { return draw(stop); });
    const std::lock_guard lock(part->mutex);
    part->outcome = std::move(outcome);
    part->took = Clock::now() - begun;
    part->changed.notify_one();
  };
  return job;
}

// Waits for its outcome. None: the job need not go on, or by `insists_at` it has not begun.
std::optional<Result<void>> outcome_of(Part& part, const BackgroundOwner& owner,
                                       const CancelToken& unwanted,
                                       std::optional<Clock::time_point> insists_at) {
  std::unique_lock lock(part.mutex);
  while (!part.changed.wait_for(lock, notice_time, [&] { return part.outcome.has_value(); })) {
    if (!check(owner, unwanted)) break;
    if (insists_at && !part.has_begun && Clock::now() >= *insists_at) break;
  }
  return part.outcome;
}

}  // namespace

Result<void> in_background(RenderService& renderer, BackgroundOwner& owner,
                           const CancelToken& unwanted,
                           const std::function<Result<void>(const CancelToken& stop)>& draw) {
  const Clock::time_point patient_until = Clock::now() + wait_max;
  for (;;) {
    if (auto wanted = check(owner, unwanted); !wanted) return wanted;
    const bool is_impatient = owner.interruptions >= interruptions_max;
    const Clock::time_point insists_at =
        std::max(owner.insists_from, is_impatient ? Clock::time_point() : patient_until);
    const bool insists = Clock::now() >= insists_at;
    const auto part = std::make_shared<Part>();
    RenderJob job = job_of(owner, insists, part, draw);
    const CancelToken stop = job.cancel;
    if (auto queued = renderer.submit(std::move(job)); !queued) return queued.error();
    const std::optional<Result<void>> outcome =
        outcome_of(*part, owner, unwanted, insists ? std::nullopt : std::optional(insists_at));
    if (!outcome) {
      stop.cancel();
      continue;  // ends above, or is drawn as a request
    }
    const bool is_done = outcome->has_value() || outcome->error().kind != ErrorKind::cancelled;
    if (insists) {
      owner.insists_from = Clock::now() + (insisting_parts - 1) * part->took;
    } else {
      owner.interruptions = is_done ? 0 : owner.interruptions + 1;
    }
    if (is_done) return *outcome;
  }
}

}  // namespace windsplat::tasks
