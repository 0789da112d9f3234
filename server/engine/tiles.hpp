// Bins -> finished tiles: they are drawn on the pool, each by one thread, its bricks always in the
// same order, so that the number of threads cannot change a bit of the picture.
#pragma once

#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/bins.hpp"
#include "server/engine/render.hpp"

namespace windsplat::engine {

// Every tile with a brick goes to `sink` once. Counts go to `work`. Cancelled, it returns early and
// what was delivered is worthless.
void draw_tiles(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                ThreadPool& pool, const CancelToken& cancel, const TileSink& sink,
                WorkReport& work);

}  // namespace windsplat::engine
