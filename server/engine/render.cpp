// Scene -> plan -> bins -> tiles -> sink, or Image.
#include "server/engine/render.hpp"

#include <algorithm>
#include <utility>

#include "server/engine/bins.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/tiles.hpp"

namespace windsplat::engine {

TileSink sink_into(Image& image) {
  return [&image](const TilePixels& tile) {
    for (int row = 0; row < tile.height; ++row) {
      const std::size_t to = static_cast<std::size_t>(tile.y + row) * image.width + tile.x;
      std::copy_n(tile.rgba + static_cast<std::size_t>(row) * tile.stride, 4 * tile.width,
                  image.rgba.data() + 4 * to);
    }
  };
}

Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel) {
  Rendered out;
  out.image.width = scene.camera.width;
  out.image.height = scene.camera.height;
  out.image.rgba.assign(4 * static_cast<std::size_t>(scene.camera.width) * scene.camera.height,
                        0.0F);
  auto work = render(scene, pool, cancel, sink_into(out.image));
  if (!work) return work.error();
  out.work = std::move(*work);
  return out;
}

Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          const TileSink& sink) {
  auto table = kernels::chosen_table();
  if (!table) return table.error();
  const RenderPlan plan = make_plan(scene);
  WorkReport work;
  work.variant = plan.variant + " " + (*table)->name;
  const Bins bins = make_bins(plan, **table, pool, cancel, work);
  if (!cancel.cancelled()) draw_tiles(plan, bins, **table, pool, cancel, sink, work);
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "the frame was cancelled");
  return work;
}

}  // namespace windsplat::engine
