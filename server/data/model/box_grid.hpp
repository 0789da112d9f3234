// Boxes of equal size in a grid, of which a volume holds some, where what is needed of a field is
// not one box (docs/design/bricks.md, "Step 5b").
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/data/model/box.hpp"

namespace windsplat::data {

// Its volumes have the dims of dims_of(): the boxes lie one after the other along z. The first is
// masked, and stands for those that are left out; samples beyond the end of the data are masked
// too. Both count in Volume::masked.
struct BoxGrid {
  Box bounds;  // of all boxes, without what lies beyond the data; begins with a box
  std::array<int, 3> size{1, 1, 1};   // samples of a box along each axis
  std::array<int, 3> count{1, 1, 1};  // boxes within the bounds along each axis
  std::vector<int> places;  // of each of these in the volume, 1 to `held`, x fastest; 0: left out
  int held = 0;             // boxes that are not left out

  // Index in `places` of the box of a sample within the bounds.
  [[nodiscard]] std::size_t index_of(const std::array<int, 3>& sample) const;
  // The box of such an index, without what lies beyond the data.
  [[nodiscard]] Box box_at(std::size_t index) const;
  // The boxes that are not left out, in the order of their places.
  [[nodiscard]] std::vector<Box> boxes() const;
  // Number of a sample in a volume; that of a masked one if it is left out or beyond the bounds.
  // stride: in one of the middles of kernels (strided_grid()), that of the sample's kernel.
  [[nodiscard]] std::size_t number_of(const std::array<int, 3>& sample, int stride = 1) const;
  bool operator==(const BoxGrid&) const = default;
};

// The grid of boxes of `size` samples that holds these, each of which begins with one of them; the
// data have `dims` samples. At least one box.
BoxGrid grid_of(const std::vector<Box>& boxes, const std::array<int, 3>& size,
                const std::array<int, 3>& dims);
// Of its volumes.
std::array<int, 3> dims_of(const BoxGrid& grid);
std::size_t samples_of(const BoxGrid& grid);
std::size_t samples_of_box(const BoxGrid& grid);
// The boxes of kernels of a stride (strided_box() in middles.hpp) in the same places: sizes are
// multiples of it along every axis along which there are several boxes.
BoxGrid strided_grid(const BoxGrid& grid, int stride);
// Whether every box that `grid` holds is held by `by` too.
bool is_held_by(const BoxGrid& grid, const BoxGrid& by);

// Identifies a grid among those of a field.
std::string key_of(const BoxGrid& grid);
// The grid of such a text; nullopt: it is another text.
std::optional<BoxGrid> grid_of_key(const std::string& key);

// What of a lattice a volume holds.
struct HeldPart {
  Box box;                              // of a grid its bounds
  std::shared_ptr<const BoxGrid> grid;  // null: all samples of the box

  [[nodiscard]] std::size_t samples() const;  // of its volumes
  // The dims of its volumes. stride: of those of the middles of kernels.
  [[nodiscard]] std::array<int, 3> dims(int stride = 1) const;
  // Number of a sample in a volume, or of its kernel in one of middles.
  [[nodiscard]] std::size_t number_of(const std::array<int, 3>& sample, int stride = 1) const;
  bool operator==(const HeldPart& other) const;
};

}  // namespace windsplat::data
