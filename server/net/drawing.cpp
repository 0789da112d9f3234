// Renderer -> loader -> renderer.
#include "server/net/drawing.hpp"

#include <string>
#include <utility>

#include "server/net/problem.hpp"

namespace windsplat::net {

namespace {

using DrawingPtr = std::shared_ptr<const Drawing>;

Result<void> enqueue(Services& services, const DrawingPtr& drawing,
                     std::shared_ptr<const void> loaded);

void load(Services& services, const DrawingPtr& drawing) {
  const auto run = [&services, drawing] {
    if (drawing->cancel.cancelled()) {
      drawing->fail(make_error(ErrorKind::cancelled, "nobody waits for the answer"));
      return;
    }
    auto loaded = services.catalogue.load(*drawing->dataset, drawing->load, drawing->cancel);
    if (!loaded) return drawing->fail(naming(loaded.error(), drawing->dataset->info().id));
    if (const auto queued = enqueue(services, drawing, std::move(*loaded)); !queued) {
      drawing->fail(queued.error());
    }
  };
  if (const auto queued =
          services.loads.submit({drawing->cancel, run, drawing->kind == RenderService::Kind::stream,
                                 drawing->dataset->shared_info(), drawing->payer});
      !queued) {
    drawing->fail(queued.error());
  }
}

Result<void> enqueue(Services& services, const DrawingPtr& drawing,
                     std::shared_ptr<const void> loaded) {
  const bool after_load = loaded != nullptr;  // and was let in before
  return services.renderer.submit(
      {drawing->kind, drawing->owner, drawing->cancel,
       [&services, drawing, after_load, loaded = std::move(loaded)](std::int64_t queue_us) {
         data::Dataset dataset =
             after_load ? drawing->dataset->held() : drawing->dataset->resident_only();
         if (!drawing->draw(dataset, queue_us, after_load)) load(services, drawing);
       },
       after_load, drawing->cost_ms, drawing->payer});
}

}  // namespace

Result<std::shared_ptr<const void>> reserve_picture(Services& services, int width, int height,
                                                    frame::Format format) {
  const std::uint64_t bytes = frame::bytes_beyond_kept(width, height, format);
  if (bytes == 0) return std::shared_ptr<const void>();
  auto reserved = services.catalogue.reserve(bytes);
  if (reserved) return reserved;
  return make_error(reserved.error().kind, "a picture of " + std::to_string(width) + " x " +
                                               std::to_string(height) +
                                               " pixels is too large: " + reserved.error().message);
}

Result<void> submit(Services& services, Drawing drawing) {
  return enqueue(services, std::make_shared<const Drawing>(std::move(drawing)), nullptr);
}

}  // namespace windsplat::net
