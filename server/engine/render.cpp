// Scene -> plan -> bins -> tiles -> Image.
#include "server/engine/render.hpp"

#include "server/engine/bins.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/plan.hpp"
#include "server/engine/tiles.hpp"

namespace windsplat::engine {

Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel) {
  auto table = kernels::chosen_table();
  if (!table) return table.error();
  const RenderPlan plan = make_plan(scene);
  Rendered out;
  out.work.variant = plan.variant + " " + (*table)->name;
  out.image.width = scene.camera.width;
  out.image.height = scene.camera.height;
  out.image.rgba.assign(4 * static_cast<std::size_t>(scene.camera.width) * scene.camera.height,
                        0.0F);
  const Bins bins = make_bins(plan, **table, pool, cancel, out.work);
  if (!cancel.cancelled()) draw_tiles(plan, bins, **table, pool, cancel, out.image, out.work);
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "the frame was cancelled");
  return out;
}

}  // namespace windsplat::engine
