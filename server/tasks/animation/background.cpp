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

constexpr std::chrono::milliseconds notice_time{20};

// State shared by the job's thread and the renderer; lives until both are done.
struct Part {
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<Result<void>> outcome;
};

}  // namespace

Result<void> in_background(Backend& backend, const BackgroundOwner& owner,
                           const CancelToken& unwanted,
                           const std::function<Result<void>(const CancelToken& stop)>& draw) {
  while (!unwanted.cancelled()) {
    const auto part = std::make_shared<Part>();
    RenderJob job;
    job.kind = RenderKind::background;
    job.owner = owner.owner;
    job.payer = owner.payer;
    const CancelToken stop = job.cancel;
    job.run = [part, draw, stop](std::int64_t /*queue_us*/) {
      auto outcome = run_guarded<void>("background work", stop, [&] { return draw(stop); });
      const std::lock_guard lock(part->mutex);
      part->outcome = std::move(outcome);
      part->changed.notify_one();
    };
    if (auto queued = backend.renderer.submit(std::move(job)); !queued) return queued.error();
    std::unique_lock lock(part->mutex);
    while (!part->changed.wait_for(lock, notice_time, [&] { return part->outcome.has_value(); })) {
      if (!unwanted.cancelled()) continue;
      stop.cancel();
      return make_error(ErrorKind::cancelled, "job cancelled");
    }
    Result<void> outcome = *part->outcome;
    if (outcome || outcome.error().kind != ErrorKind::cancelled) return outcome;
  }
  return make_error(ErrorKind::cancelled, "job cancelled");
}

}  // namespace windsplat::tasks
