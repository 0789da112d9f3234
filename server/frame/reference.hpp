// View -> its truth, drawn in parts between which the renderer does other work, and the error of
// the view's own picture.
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

// Counts the memory of the work within a limit.
struct WorkMemory {
  engine::reference::Reserve reserve;   // errors: out_of_memory
  std::function<std::uint64_t()> room;  // that could be had now
};

// Of one view: what is loaded for it stays resident as long as this lives. One call at a time.
class ReferenceDrawing {
 public:
  // Loads what the view shows and lists its kernels, which takes up to seconds: not for the
  // renderer's thread. The view's method is what the truth is compared with.
  // Errors: those of the scene; cancelled; out_of_memory at /image.
  static Result<std::unique_ptr<ReferenceDrawing>> begin(const scene::CompletedView& completed,
                                                         data::Dataset& dataset, unsigned workers,
                                                         const CancelToken& cancel,
                                                         const WorkMemory& memory);

  // Continues where the last call ended, until `enough` (called by any worker) or all is drawn. A
  // cancelled call loses only the few pixels in work.
  void draw(ThreadPool& pool, const CancelToken& cancel, const std::function<bool()>& enough);
  [[nodiscard]] double done() const;  // 1: all

  // The view's own picture at full size against the truth, when that is drawn. Errors: those of the
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
  std::vector<std::uint8_t> drawn_;  // by piece, row by row
  std::size_t first_open_ = 0;       // pieces before it are drawn
};

}  // namespace windsplat::frame
