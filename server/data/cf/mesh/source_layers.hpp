// Reads the values of a variable at all cells or nodes, one layer after another.
#pragma once

#include <cstddef>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// Where a variable's layers are in the file. Layers are numbered by the other dimensions.
struct LayerPlan {
  int variable = -1;
  std::size_t list = 0;  // position of the dimension of cells or nodes
};

class SourceLayers {
 public:
  explicit SourceLayers(const ArrayFile& file) : file_(file) {}

  // index: one per dimension but that of the list, in the order of the file. Values are unpacked,
  // NaN where missing, and valid until the next call. If the list is not the last dimension, layers
  // along the last one are read together, up to slab_values. Errors: bad_data.
  Result<const float*> read(const LayerPlan& plan, const std::vector<std::size_t>& index);
  void forget();

  static constexpr std::size_t slab_values = std::size_t{8} << 20;

 private:
  Result<void> load(const LayerPlan& plan, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count);

  const ArrayFile& file_;
  int variable_ = -1;
  std::vector<std::size_t> start_;  // of the slab held
  std::vector<std::size_t> count_;
  std::vector<float> slab_;
  std::vector<float> layer_;
};

}  // namespace windsplat::data::cf
