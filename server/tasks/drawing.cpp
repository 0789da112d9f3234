// Passes a picture from the renderer to the loader and back.
#include "server/tasks/drawing.hpp"

#include <chrono>
#include <string>
#include <utility>

namespace windsplat::tasks {

namespace {

using DrawingPtr = std::shared_ptr<const Drawing>;
using Held = std::shared_ptr<const void>;
using Clock = std::chrono::steady_clock;

std::int64_t us_since(Clock::time_point start) {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start).count();
}

void draw(const Drawing& drawing, const PreparedPtr& picture, std::int64_t queue_us,
          Loading loading) {
  if (picture == nullptr) return;
  data::Dataset resident = drawing.dataset->resident_only();
  drawing.draw(*picture, resident, queue_us, loading);
}

Result<void> draw_after_load(Backend& backend, const DrawingPtr& drawing, PreparedPtr picture) {
  const std::int64_t sampling_us = picture->frame.scene.sampling_us;
  return backend.renderer.submit({drawing->kind, drawing->owner, drawing->cancel,
                                  [drawing, picture = std::move(picture)](std::int64_t queue_us) {
                                    draw(*drawing, picture, queue_us, Loading::allowed);
                                  },
                                  true,  // the request was admitted before
                                  drawing->cost_ms, drawing->payer, sampling_us});
}

void load(Backend& backend, const DrawingPtr& drawing) {
  const auto run = [&backend, drawing] {
    if (drawing->cancel.cancelled()) {
      drawing->fail(make_error(ErrorKind::cancelled, "request cancelled"));
      return;
    }
    const auto prepare = [&](data::Dataset& loading) {
      return drawing->prepare(loading, Loading::allowed);
    };
    auto picture = backend.catalogue.load(*drawing->dataset, prepare, drawing->cancel);
    if (!picture) return drawing->fail(picture.error());
    if (*picture == nullptr) return;
    (*picture)->frame.prepare_us = 0;  // preparation did not take place on the renderer's thread
    if (const auto queued = draw_after_load(backend, drawing, std::move(*picture)); !queued) {
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

}  // namespace

// After loading, so that a conflict between loading and drawing is detected at once.
Result<PreparedPtr> with_memory(frame::Prepared prepared, const data::Dataset& dataset,
                                Loading loading) {
  const int width = prepared.scene.camera.width;
  const int height = prepared.scene.camera.height;
  const std::uint64_t bytes = frame::bytes_beyond_kept(width, height, prepared.encoding.format,
                                                       prepared.figure.has_value()) +
                              frame::surface_bytes(prepared.scene);
  Result<Held> reserved = bytes == 0 ? Held() : dataset.reserve(bytes);
  if (!reserved) {
    const Error& error = reserved.error();
    if (loading == Loading::none) return make_error(ErrorKind::not_resident, error.message);
    if (error.kind != ErrorKind::out_of_memory) return error;
    const bool surfaces = !prepared.scene.surfaces.empty();
    return make_error(ErrorKind::out_of_memory,
                      "a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                          (surfaces ? " pixels with surfaces" : " pixels") +
                          " is too large: " + error.message);
  }
  return std::make_shared<PreparedPicture>(
      PreparedPicture{std::move(prepared), std::move(*reserved)});
}

Result<PreparedPtr> prepare_picture(const scene::CompletedView& completed,
                                    const quality::Setting& setting,
                                    const frame::Encoding& encoding, data::Dataset& dataset,
                                    Loading loading, scene::StandIn stand_in) {
  auto prepared = frame::prepare(completed, setting, dataset, encoding, stand_in);
  if (!prepared) {
    // The loader waits for memory.
    if (loading == Loading::none) {
      if (prepared.error().kind != ErrorKind::out_of_memory) return prepared.error();
      return make_error(ErrorKind::not_resident, prepared.error().message);
    }
    return with_dataset_name(prepared.error(), dataset.info().id);
  }
  return with_memory(std::move(*prepared), dataset, loading);
}

Result<void> submit(Backend& backend, Drawing asked) {
  const auto drawing = std::make_shared<const Drawing>(std::move(asked));
  return backend.renderer.submit(
      {drawing->kind, drawing->owner, drawing->cancel,
       [&backend, drawing](std::int64_t queue_us) {
         data::Dataset resident = drawing->dataset->resident_only().cancelled_by(drawing->cancel);
         const Clock::time_point start = Clock::now();
         auto picture = drawing->prepare(resident, Loading::none);
         if (picture) {
           if (*picture) (*picture)->frame.prepare_us = us_since(start);
           draw(*drawing, *picture, queue_us, Loading::none);
         } else if (picture.error().kind == ErrorKind::not_resident) {
           load(backend, drawing);
         } else {
           drawing->fail(picture.error());
         }
       },
       false, drawing->cost_ms, drawing->payer});
}

}  // namespace windsplat::tasks
