// Scene -> Image. Pure: no I/O, no clock, no globals; the same scene gives the same bits for any
// number of threads.
#pragma once

#include <cstddef>
#include <memory>
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

// What frames need beside their scene, for a caller that draws one after another: frames of the
// same kind then allocate nothing but their plan. One frame at a time. It holds the newest picture,
// what bricks of the last few scenes hold (summaries.hpp), and each worker's tile; pixels that one
// frame needed beyond kept_pixels are given back by the next smaller one.
class RenderSpace {
 public:
  static constexpr std::size_t kept_pixels = std::size_t{1920} * 1080;

  RenderSpace();
  ~RenderSpace();
  RenderSpace(RenderSpace&&) noexcept;
  RenderSpace& operator=(RenderSpace&&) noexcept;
  RenderSpace(const RenderSpace&) = delete;
  RenderSpace& operator=(const RenderSpace&) = delete;

  // Of the frame drawn last; the caller may take it away.
  [[nodiscard]] Image& image();

 private:
  friend Result<WorkReport> render(const scene::Scene&, ThreadPool&, const CancelToken&,
                                   RenderSpace&);
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// The picture is space.image(). Errors: cancelled; invalid (the environment forces a target that is
// not there).
Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space);

// One frame by itself.
Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::engine
