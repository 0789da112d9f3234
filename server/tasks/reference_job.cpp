// Strips are submitted to the renderer's queue one after the other; the picture and its error are
// then stored.
#include "server/tasks/reference_job.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "protocol/codec.hpp"
#include "server/data/model/digest.hpp"
#include "server/frame/reference.hpp"
#include "server/scene/completed_view.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds strip_time{100};
constexpr std::chrono::milliseconds notice_time{20};

// State shared by the job's thread and the renderer; lives until both are done.
struct Strip {
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<Result<void>> outcome;
};

// Owner of the render jobs and the address charged.
struct DrawingOwner {
  std::uint64_t owner = 0;
  std::string payer;
};

// Runs `draw` on the renderer's thread as a background job, again after each interruption, until
// its result is not `cancelled` or the job is cancelled. Copies `draw`, which may outlive the call
// briefly.
Result<void> in_background(Backend& backend, const DrawingOwner& owner, const CancelToken& unwanted,
                           const std::function<Result<void>(const CancelToken&)>& draw) {
  while (!unwanted.cancelled()) {
    const auto strip = std::make_shared<Strip>();
    RenderJob job;
    job.kind = RenderKind::background;
    job.owner = owner.owner;
    job.payer = owner.payer;
    const CancelToken stop = job.cancel;
    job.run = [strip, draw, stop](std::int64_t /*queue_us*/) {
      auto outcome = run_guarded<void>("a reference", stop, [&] { return draw(stop); });
      const std::lock_guard lock(strip->mutex);
      strip->outcome = std::move(outcome);
      strip->changed.notify_one();
    };
    if (auto queued = backend.renderer.submit(std::move(job)); !queued) return queued.error();
    std::unique_lock lock(strip->mutex);
    while (
        !strip->changed.wait_for(lock, notice_time, [&] { return strip->outcome.has_value(); })) {
      if (!unwanted.cancelled()) continue;
      stop.cancel();
      return make_error(ErrorKind::cancelled, "reference cancelled");
    }
    Result<void> outcome = *strip->outcome;
    if (outcome || outcome.error().kind != ErrorKind::cancelled) return outcome;
  }
  return make_error(ErrorKind::cancelled, "reference cancelled");
}

// All inputs that determine the picture and its error.
std::string id_of(const protocol::View& completed, const data::Dataset& dataset) {
  const std::string text =
      protocol::encode_view(completed) + '\n' + dataset.digest() + '\n' + WINDSPLAT_VERSION;
  const std::string first = data::digest_of(text);
  return first + data::digest_of(first + text);
}

}  // namespace

Result<protocol::JobResult> draw_reference(Backend& backend, const protocol::View& view,
                                           data::Dataset& dataset, const Jobs::Handle& handle,
                                           const std::string& payer, const std::string& base_path) {
  protocol::View asked = view;
  asked.quality = {};  // affects how a stream renders, not the content
  const auto completed = scene::complete(asked, dataset);
  if (!completed) return completed.error();
  protocol::ReferenceDescription description;
  description.id = id_of(completed->view(), dataset);
  if (const auto kept = backend.references.find(description.id)) return kept->description;
  const frame::WorkMemory memory{
      [&](std::uint64_t bytes) { return backend.catalogue.store().reserve(bytes); },
      [&] { return backend.catalogue.store().room(); }};
  auto begun = frame::ReferenceDrawing::begin(*completed, dataset, backend.pool->size(),
                                              handle.cancel, memory);
  if (!begun) return begun.error();
  const std::shared_ptr<frame::ReferenceDrawing> drawing = std::move(*begun);
  const DrawingOwner owner{backend.references.next_owner(), payer};
  while (drawing->done() < 1) {
    const auto drawn = in_background(backend, owner, handle.cancel,
                                     [&backend, drawing](const CancelToken& stop) -> Result<void> {
                                       const auto until = Clock::now() + strip_time;
                                       drawing->draw(*backend.pool, stop,
                                                     [until] { return Clock::now() >= until; });
                                       return {};
                                     });
    if (!drawn) return drawn.error();
    handle.report_progress(drawing->done());
  }
  const auto difference = std::make_shared<frame::Difference>();
  const auto compared =
      in_background(backend, owner, handle.cancel,
                    [&backend, drawing, difference](const CancelToken& stop) -> Result<void> {
                      const auto found = drawing->compare(*backend.pool, stop, backend.frames);
                      if (!found) return found.error();
                      *difference = *found;
                      return {};
                    });
  if (!compared) return compared.error();
  auto png = drawing->encode_png();
  if (!png) return png.error();
  description.picture = base_path + "v1/references/" + description.id + ".png";
  description.width = drawing->width();
  description.height = drawing->height();
  description.rmse = difference->rmse;
  description.max = difference->max;
  description.psnr = difference->psnr;
  backend.references.keep({description, std::make_shared<const image::Bytes>(std::move(*png))});
  return protocol::JobResult(std::move(description));
}

}  // namespace windsplat::tasks
