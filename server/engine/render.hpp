// Scene -> Image, or its tiles. Pure: no I/O, no clock, no globals; the same scene gives the same
// bits for any number of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/work.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

// Linear premultiplied RGBA of the volume alone, row 0 on top, 4 floats a pixel.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<float> rgba;
};

// Finished pixels of an image: as Image has them, but `stride` floats from row to row.
struct TilePixels {
  int x = 0;  // of the left upper pixel in the image; even
  int y = 0;
  int width = 0;
  int height = 0;
  const float* rgba = nullptr;  // gone when the sink returns
  std::size_t stride = 0;
};

// Called from the pool's threads, several at once, once for every tile that has anything in it:
// what is never delivered is clear.
using TileSink = std::function<void(const TilePixels&)>;

// Copies tiles to their places in `image`, which has its size and outlives the sink.
TileSink sink_into(Image& image);

struct Rendered {
  Image image;
  WorkReport work;
};

// Errors: cancelled; invalid (the environment forces a target that is not there).
Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel);

// The same pixels, tile by tile as they are finished: no image is made. Errors: likewise; what was
// delivered by then is worthless.
Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          const TileSink& sink);

}  // namespace windsplat::engine
