// Boxes on the screen -> which of them may cover a pixel: lists by tile, in one block whose size is
// known before there is any of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/engine/reference/kernels.hpp"

namespace windsplat::engine::reference {

class ScreenGrid {
 public:
  using BoxOf = std::function<ScreenBox(std::size_t id)>;

  ScreenGrid(int width, int height);

  // Both false where they were cancelled. First this, with the ids below `boxes`: how long the
  // lists will be.
  bool count(std::size_t boxes, const BoxOf& box_of, const CancelToken& cancel);
  // Then this, of the same boxes.
  bool fill(std::size_t boxes, const BoxOf& box_of, const CancelToken& cancel);

  // Counted: what the lists take.
  [[nodiscard]] std::uint64_t bytes() const { return total_ * sizeof(std::uint32_t); }
  [[nodiscard]] std::size_t longest() const { return longest_; }
  // Filled: the boxes that may cover a pixel, ascending.
  [[nodiscard]] std::span<const std::uint32_t> at(int x, int y) const;

 private:
  struct Tiles;  // of a box
  [[nodiscard]] Tiles tiles_of(const ScreenBox& box) const;

  int width_, height_;
  std::size_t columns_, rows_;
  std::vector<std::uint64_t> starts_;  // of a tile's list in ids_, and the last one's end
  std::unique_ptr<std::uint32_t[]> ids_;
  std::uint64_t total_ = 0;
  std::size_t longest_ = 0;
};

}  // namespace windsplat::engine::reference
