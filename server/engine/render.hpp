// Scene -> Image, or its tiles. Pure: no I/O, no clock, no globals; the same scene gives the same
// bits for any number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/engine/work.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

// Linear premultiplied RGBA of the volume alone, row 0 on top, 4 floats per pixel.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<float> rgba;
};

// Finished pixels of an image in the format of Image, with `stride` floats from row to row.
struct TilePixels {
  int x = 0;  // position of the upper left pixel in the image; even
  int y = 0;
  int width = 0;
  int height = 0;
  const float* rgba = nullptr;  // valid until the sink returns
  std::size_t stride = 0;
};

// Receiver of finished tiles: any callable that takes a TilePixels. It is called concurrently from
// the threads of the pool, with a few rows of a tile at a time. Every pixel of a tile that is not
// empty is delivered once; pixels never delivered are transparent. A TileSink refers to its
// callable, which must outlive it.
class TileSink {
 public:
  template <class Call,
            class = std::enable_if_t<std::is_invocable_v<const Call&, const TilePixels&>>>
  TileSink(const Call& call)  // NOLINT(google-explicit-constructor): accepts lambdas
      : called_(&call), call_([](const void* called, const TilePixels& tile) {
          (*static_cast<const Call*>(called))(tile);
        }) {}

  void operator()(const TilePixels& tile) const { call_(called_, tile); }

 private:
  const void* called_;
  void (*call_)(const void* called, const TilePixels& tile);
};

// Copies tiles into `image`, which must have its final size and outlive the copier.
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

// Storage kept between frames, so that consecutive frames of the same kind allocate nothing. Used
// by one frame at a time. Holds the last plan, the brick summaries of the last few scenes
// (summaries.hpp), what the last few pictures show of a ground (layers/kept_ground.hpp), the tile
// of each worker and the last picture that was not delivered to a sink.
// Memory for more than retained_pixels is released by the next smaller frame.
class RenderSpace {
 public:
  RenderSpace();
  ~RenderSpace();
  RenderSpace(RenderSpace&&) noexcept;
  RenderSpace& operator=(RenderSpace&&) noexcept;
  RenderSpace(const RenderSpace&) = delete;
  RenderSpace& operator=(const RenderSpace&) = delete;

  // Picture of the last frame drawn without a sink; the caller may move from it.
  [[nodiscard]] Image& image();
  // Limit on the bytes of grounds that are kept; 64 MiB if it is not set.
  void limit_grounds(std::size_t bytes);
  // Of the grounds that are kept.
  [[nodiscard]] std::size_t ground_bytes() const;

 private:
  friend Result<WorkReport> render(const scene::Scene&, ThreadPool&, const CancelToken&,
                                   RenderSpace&, TileSink);
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// Memory for the lists of the triangles of its surfaces while a frame is drawn.
std::uint64_t surface_bytes(const scene::Scene& scene);

// Delivers tiles to `sink` as they are finished. Errors: cancelled (the delivered tiles are
// invalid); invalid (the environment selects an instruction set that is not available).
Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space, TileSink sink);

// Renders into space.image().
Result<WorkReport> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                          RenderSpace& space);

// Renders a single frame.
Result<Rendered> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::engine
