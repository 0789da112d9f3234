// A box of samples of a field: what of a step is read where the whole is not needed, and what of
// the file that costs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

// A range of samples along x, y and z.
struct Box {
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> count{1, 1, 1};  // at least 1
  [[nodiscard]] std::size_t samples() const;
  bool operator==(const Box&) const = default;
};

// All samples of a grid.
Box whole_box(const std::array<int, 3>& dims);
// False also for counts below 1.
bool is_within(const Box& box, const std::array<int, 3>& dims);
// The samples of a box of the volume, masked and measured as those of a file.
Volume cut(const Volume& volume, const Box& box);
// Identifies a box among those of a field.
std::string key_of(const Box& box);
// The box of such a text; nullopt: it is another text.
std::optional<Box> box_of(const std::string& key);

// Of fields that are read by boxes (FieldInfo::box_chunk):

// The box that costs as much to read as the sample: the part of its chunk that is at most 64
// samples long along each axis.
Box box_around(const std::array<int, 3>& index, const FieldInfo& field,
               const std::array<int, 3>& dims);
// The distance of the layers that are read of a box of which every `layer_stride`-th is wanted:
// those between are left out if they have `values_min` values, since each piece costs a read.
constexpr double left_out_values_min = 1 << 18;
int layers_apart(const Box& box, int layer_stride, const FieldInfo& field,
                 const std::array<int, 3>& dims, double values_min = left_out_values_min);
// The share of a step that is decoded to read every `layer_stride`-th layer of a box.
double decoded_share(const Box& box, int layer_stride, const FieldInfo& field,
                     const std::array<int, 3>& dims);
// Chunks that have samples of a box.
std::uint64_t chunks_of(const Box& box, const FieldInfo& field);
// Boxes that hold every `layer_stride`-th layer of a box, in ascending order: of whole chunks, so
// that none is decoded twice, and of at most `values_max` values of all components, or a chunk.
std::vector<Box> pieces_of(const Box& box, int layer_stride, const FieldInfo& field,
                           std::size_t values_max);

}  // namespace windsplat::data
