// Scene -> Image, or its tiles. Pure: no I/O, no clock, no globals; the same scene gives the same
// bits for any number of threads.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
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

// Where finished tiles go: anything that takes a TilePixels. Called from the pool's threads,
// several at once, a few rows of a tile at a time; every pixel of a tile that has anything in it
// comes once, and what never comes is clear. It only points at what it calls, which outlives it.
class TileSink {
 public:
  template <class Call,
            class = std::enable_if_t<std::is_invocable_v<const Call&, const TilePixels&>>>
  TileSink(const Call& call)  // NOLINT(google-explicit-constructor): a lambda is one
      : called_(&call), call_([](const void* called, const TilePixels& tile) {
          (*static_cast<const Call*>(called))(tile);
        }) {}

  void operator()(const TilePixels& tile) const { call_(called_, tile); }

 private:
  const void* called_;
  void (*call_)(const void* called, const TilePixels& tile);
};

// Copies tiles to their places in `image`, which has its size and outlives the copier.
class TileCopier {
 public:
  explicit TileCopier(Image& image) : image_(&image) {}
  void operator()(const TilePixels& tile) const;

 private:
  Image* image_;
};
inline TileCopier sink_into(Image& image) { return TileCopier(image); }

struct Rendered {
  Image image;
  WorkReport work;
};

// What frames need beside their scene, for a caller that draws one after another: frames of the
// same kind then allocate nothing. One frame at a time. It holds the last plan, what bricks of the
// last few scenes hold (summaries.hpp), each worker's tile, and the newest picture that was not
// delivered to a sink; pixels that one frame needed beyond retained_pixels are given back by the
// next smaller one.
class RenderSpace {
 public:
  RenderSpace();
  ~RenderSpace();
  RenderSpace(RenderSpace&&) noexcept;
  RenderSpace& operator=(RenderSpace&&) noexcept;
  RenderSpace(const RenderSpace&) = delete;
  RenderSpace& operator=(const RenderSpace&) = delete;

  // Of the frame drawn last without a sink; the caller may take it away.
  [[nodiscard]] Image& image();

 private:
  friend Result<WorkReport> render(const scene::Scene&, ThreadPool&, const CancelToken&,
                                   RenderSpace&, TileSink);
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// Tiles go to `sink` as they are finished; no image is made. Errors: cancelled (what was delivered
// is worthless); invalid (the environment forces a target that is not there).
Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space, TileSink sink);

// The picture is space.image().
Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space);

// One frame by itself.
Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::engine
