// Scene -> plan -> bins -> tiles -> sink, or Image.
#include "server/engine/render.hpp"

#include <algorithm>
#include <utility>

#include "server/base/trim_storage.hpp"
#include "server/engine/bins.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/layers/kept_ground.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/tiles.hpp"

namespace windsplat::engine {

struct RenderSpace::Parts {
  Image image;
  RenderPlan plan;  // plan of the last frame; its scene may have been destroyed
  BinSpace bins;
  TileSpace tiles;
  surface::Pixels surfaces;
  KeptGrounds grounds;
};

RenderSpace::RenderSpace() : parts_(std::make_unique<Parts>()) {}
RenderSpace::~RenderSpace() = default;
RenderSpace::RenderSpace(RenderSpace&&) noexcept = default;
RenderSpace& RenderSpace::operator=(RenderSpace&&) noexcept = default;

Image& RenderSpace::image() { return parts_->image; }

void RenderSpace::limit_grounds(std::size_t bytes) { parts_->grounds.set_limit(bytes); }

std::size_t RenderSpace::ground_bytes() const { return parts_->grounds.bytes(); }

void TileCopier::operator()(const TilePixels& tile) const {
  const auto columns = static_cast<std::size_t>(image_->width);
  for (int row = 0; row < tile.height; ++row) {
    const std::size_t to = static_cast<std::size_t>(tile.y + row) * columns + tile.x;
    std::copy_n(tile.rgba + static_cast<std::size_t>(row) * tile.stride, 4 * tile.width,
                image_->rgba.data() + 4 * to);
  }
}

namespace {

// Clears the image in parts with checks for cancellation: the pages of a large image are first
// mapped here, which may take longer than rendering a small one.
void clear_image(const scene::Camera& camera, const CancelToken& cancel, Image& image) {
  constexpr std::size_t floats_between_checks = std::size_t{1} << 21;

  const std::size_t floats = 4 * static_cast<std::size_t>(camera.width) * camera.height;
  trim_storage(image.rgba, floats, 4 * retained_pixels);
  image.width = camera.width;
  image.height = camera.height;
  image.rgba.clear();
  image.rgba.reserve(floats);
  while (image.rgba.size() < floats && !cancel.cancelled()) {
    image.rgba.resize(std::min(floats, image.rgba.size() + floats_between_checks));
  }
}

}  // namespace

std::uint64_t surface_bytes(const scene::Scene& scene) {
  return surface::Pixels::bytes_for(scene.surfaces);
}

Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space, TileSink sink) {
  const auto table = kernels::chosen_table();
  if (!table) return table.error();
  RenderSpace::Parts& parts = *space.parts_;
  const RenderPlan& plan = parts.plan;
  make_plan(scene, parts.plan);
  parts.plan.body.kept = parts.grounds.of(scene, plan.tile_pixels, *table);
  WorkReport work;
  work.variant = plan.variant;
  work.variant.target = (*table)->name;
  const bool surfaces = !scene.surfaces.empty();
  if (surfaces) {
    parts.surfaces.list(scene.surfaces, surface_view(scene.camera), scene.camera.width,
                        scene.camera.height, pool, cancel);
  }
  if ((!plan.passes.empty() || scene.body || surfaces) && !cancel.cancelled()) {
    const Bins& bins = make_bins(plan, **table, pool, cancel, parts.bins, work);
    if (!cancel.cancelled()) {
      draw_tiles(plan, bins, surfaces ? &parts.surfaces : nullptr, **table, pool, cancel,
                 parts.tiles, sink, work);
    }
  }
  // What the memory of a picture counts is not kept beyond it.
  constexpr std::size_t surface_bytes_kept = std::size_t{8} << 20U;
  parts.surfaces.release_beyond(surface_bytes_kept);
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "frame cancelled");
  return work;
}

Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space) {
  clear_image(scene.camera, cancel, space.image());
  return render(scene, pool, cancel, space, sink_into(space.image()));
}

Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel) {
  RenderSpace space;
  auto work = render(scene, pool, cancel, space);
  if (!work) return work.error();
  return Rendered{std::move(space.image()), std::move(*work)};
}

}  // namespace windsplat::engine
