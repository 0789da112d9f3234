// Passes a picture from the renderer to the loader and back.
#include "server/work/drawing.hpp"

#include <string>
#include <utility>

namespace windsplat::net {

namespace {

using DrawingPtr = std::shared_ptr<const Drawing>;
using Held = std::shared_ptr<const void>;

Result<void> enqueue(Backend& backend, const DrawingPtr& drawing, Held loaded);

void load(Backend& backend, const DrawingPtr& drawing) {
  const auto run = [&backend, drawing] {
    if (drawing->cancel.cancelled()) {
      drawing->fail(make_error(ErrorKind::cancelled, "request cancelled"));
      return;
    }
    auto loaded = backend.catalogue.load(*drawing->dataset, drawing->load, drawing->cancel);
    if (!loaded) return drawing->fail(loaded.error());
    if (const auto queued = enqueue(backend, drawing, std::move(*loaded)); !queued) {
      drawing->fail(queued.error());
    }
  };
  if (const auto queued =
          backend.loads.submit({drawing->cancel, run, drawing->kind == RenderService::Kind::stream,
                                drawing->dataset->shared_info(), drawing->payer});
      !queued) {
    drawing->fail(queued.error());
  }
}

Result<void> enqueue(Backend& backend, const DrawingPtr& drawing, Held loaded) {
  const bool after_load = loaded != nullptr;  // and was admitted before
  return backend.renderer.submit(
      {drawing->kind, drawing->owner, drawing->cancel,
       [&backend, drawing, after_load, loaded = std::move(loaded)](std::int64_t queue_us) {
         data::Dataset dataset =
             after_load ? drawing->dataset->held() : drawing->dataset->resident_only();
         if (!drawing->draw(dataset, queue_us, after_load)) load(backend, drawing);
       },
       after_load, drawing->cost_ms, drawing->payer});
}

Result<Held> room_for(const data::Dataset& dataset, const protocol::ImageView& image,
                      const frame::Encoding& encoding) {
  const int width = quality::edge_at(image.width, encoding.half_level);
  const int height = quality::edge_at(image.height, encoding.half_level);
  const std::uint64_t bytes = frame::bytes_beyond_kept(width, height, encoding.format);
  if (bytes == 0) return Held();
  auto reserved = dataset.reserve(bytes);
  if (reserved || reserved.error().kind != ErrorKind::out_of_memory) return reserved;
  return make_error(ErrorKind::out_of_memory,
                    "a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                        " pixels is too large: " + reserved.error().message);
}

}  // namespace

Result<Held> reserve_picture(const data::Dataset& dataset, const protocol::ImageView& image,
                             const frame::Encoding& encoding, bool after_load) {
  if (after_load) return Held();
  auto room = room_for(dataset, image, encoding);
  if (room) return room;
  return make_error(ErrorKind::not_resident, room.error().message);
}

Result<Held> load_picture(const protocol::View& view, data::Dataset& loading,
                          const frame::Encoding& encoding) {
  auto fields = frame::load(view, loading, encoding);
  if (!fields) return with_dataset_name(fields.error(), loading.info().id);
  // Reserve last, so that a conflict of the two is found at once.
  auto room = room_for(loading, view.image, encoding);
  if (!room) return room.error();
  return Held(std::make_shared<const std::pair<Held, Held>>(std::move(*fields), std::move(*room)));
}

Result<void> submit(Backend& backend, Drawing drawing) {
  return enqueue(backend, std::make_shared<const Drawing>(std::move(drawing)), nullptr);
}

}  // namespace windsplat::net
