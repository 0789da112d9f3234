// Bins -> Image: tiles are drawn on the pool, each by one thread, its bricks always in the same
// order, so that the number of threads cannot change a bit of the picture.
#pragma once

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/bins.hpp"
#include "server/engine/render.hpp"

namespace windsplat::engine {

// `image` has the camera's size and is zero. Counts go to `work`. Cancelled, it returns early and
// the image is worthless.
void draw_tiles(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                ThreadPool& pool, const CancelToken& cancel, Image& image, WorkReport& work);

}  // namespace windsplat::engine
