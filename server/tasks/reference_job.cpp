// Strips are submitted to the renderer's queue one after the other; the picture and its error are
// then stored.
#include "server/tasks/reference_job.hpp"

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>

#include "protocol/codec.hpp"
#include "server/data/model/digest.hpp"
#include "server/frame/reference.hpp"
#include "server/scene/completed_view.hpp"
#include "server/tasks/animation/background.hpp"

namespace windsplat::tasks {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds strip_time{100};

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
  BackgroundOwner owner{backend.references.next_owner(), payer};
  while (drawing->done() < 1) {
    const auto drawn = in_background(backend.renderer, owner, handle.cancel,
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
      in_background(backend.renderer, owner, handle.cancel,
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
