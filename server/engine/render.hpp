// Scene -> Image. Pure: no I/O, no clock, no globals; the same scene gives the same bits for any
// number of threads.
#pragma once

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

struct Rendered {
  Image image;
  WorkReport work;
};

// Errors: cancelled; invalid (the environment forces a target that is not there).
Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::engine
