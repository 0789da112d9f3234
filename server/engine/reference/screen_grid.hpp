// Screen-space boxes -> lists by tile of the boxes that may cover a pixel, in one array whose size
// is computed before allocation.
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

  // Both functions return false if cancelled. The first step computes the lengths of the lists for
  // the ids below `boxes`.
  bool count(std::size_t boxes, const BoxOf& box_of, const CancelToken& cancel);
  // Second step: fills the lists with the same boxes.
  bool fill(std::size_t boxes, const BoxOf& box_of, const CancelToken& cancel);

  // Size of the lists; valid after count.
  [[nodiscard]] std::uint64_t bytes() const { return total_ * sizeof(std::uint32_t); }
  [[nodiscard]] std::size_t longest() const { return longest_; }
  // Ids of the boxes that may cover a pixel, ascending; valid after fill.
  [[nodiscard]] std::span<const std::uint32_t> at(int x, int y) const;

 private:
  struct Tiles;  // range of tiles of a box
  [[nodiscard]] Tiles tiles_of(const ScreenBox& box) const;

  int width_, height_;
  std::size_t columns_, rows_;
  std::vector<std::uint64_t> starts_;  // start of the list of each tile in ids_, then the end
  std::unique_ptr<std::uint32_t[]> ids_;
  std::uint64_t total_ = 0;
  std::size_t longest_ = 0;
};

}  // namespace windsplat::engine::reference
