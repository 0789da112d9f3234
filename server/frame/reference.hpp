// View -> its reference, drawn in parts so that the renderer can do other work in between, and the
// error of the picture of the view.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/engine/render.hpp"
#include "server/frame/difference.hpp"
#include "server/frame/frame.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// Counts the memory of the work in a limit.
struct WorkMemory {
  engine::reference::Reserve reserve;   // errors: out_of_memory
  std::function<std::uint64_t()> room;  // bytes available now
};

// The drawing of one view, whose data stay resident during its lifetime. Not thread-safe.
class ReferenceDrawing {
 public:
  // Loads the data of the view and lists its kernels, which takes up to seconds: do not call it on
  // the renderer's thread. The picture drawn with the method of the view is compared with the
  // reference. Errors: those of the scene; cancelled; out_of_memory at /image.
  static Result<std::unique_ptr<ReferenceDrawing>> begin(const scene::CompletedView& completed,
                                                         data::Dataset& dataset, unsigned workers,
                                                         const CancelToken& cancel,
                                                         const WorkMemory& memory);

  // Continues where the last call ended, until `enough` (called by any worker) returns true or
  // everything is drawn. Cancelling a call loses only the few pixels being drawn.
  void draw(ThreadPool& pool, const CancelToken& cancel, const std::function<bool()>& enough);
  [[nodiscard]] double done() const;  // fraction drawn, 0 to 1

  // Compares the view's picture at full size with the finished reference. Errors: those of the
  // engine.
  Result<Difference> compare(ThreadPool& pool, const CancelToken& cancel, Workspace& workspace);
  // Errors: those of encoding.
  [[nodiscard]] Result<image::Bytes> encode_png() const;

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  ReferenceDrawing(scene::Scene own, std::array<float, 3> background, int width, int height);
  void draw_piece(std::size_t piece, unsigned worker, const CancelToken& cancel);

  scene::Scene own_;
  std::array<float, 3> background_{};  // linear
  int width_ = 0;
  int height_ = 0;
  std::size_t pieces_a_row_ = 0;
  std::shared_ptr<const void> reserved_;
  std::unique_ptr<engine::reference::Painting> painting_;
  std::vector<float> rgba_;
  std::vector<std::uint8_t> drawn_;  // number of kernels, by piece, row by row
  std::size_t first_open_ = 0;       // all earlier pieces are drawn
};

}  // namespace windsplat::frame
