#include "server/tasks/animation/background.hpp"

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
  job.owner = owner.owner;
  job.payer = owner.payer;
  job.cost_ms = owner.cost_ms;
  job.run = [part, draw, stop = job.cancel](std::int64_t /*queue_us*/) {
    const auto begun = Clock::now();
    auto outcome = run_guarded<void>("background work", stop, [&] { return draw(stop); });
    const std::lock_guard lock(part->mutex);
    part->outcome = std::move(outcome);
    part->took = Clock::now() - begun;
    part->changed.notify_one();
  };
  return job;
}

}  // namespace

Result<void> in_background(RenderService& renderer, BackgroundOwner& owner,
                           const CancelToken& unwanted,
                           const std::function<Result<void>(const CancelToken& stop)>& draw) {
  for (int interruptions = 0;; ++interruptions) {
    if (auto wanted = check(owner, unwanted); !wanted) return wanted;
    const bool insists = interruptions >= interruptions_max && Clock::now() >= owner.insists_from;
    const auto part = std::make_shared<Part>();
    RenderJob job = job_of(owner, insists, part, draw);
    const CancelToken stop = job.cancel;
    if (auto queued = renderer.submit(std::move(job)); !queued) return queued.error();
    std::unique_lock lock(part->mutex);
    while (!part->changed.wait_for(lock, notice_time, [&] { return part->outcome.has_value(); })) {
      if (auto wanted = check(owner, unwanted); !wanted) {
        stop.cancel();
        return wanted;
      }
    }
    if (insists) owner.insists_from = Clock::now() + (insisting_parts - 1) * part->took;
    Result<void> outcome = *part->outcome;
    if (outcome || outcome.error().kind != ErrorKind::cancelled) return outcome;
  }
}

}  // namespace windsplat::tasks
