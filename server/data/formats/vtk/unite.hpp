// Blocks of one step -> one grid: images of one lattice stay an image, all others become one mesh.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

struct Block {
  std::string name;
  std::string other_type;  // of a block that is no grid ("PolyData"); it has no snapshot
  std::optional<Snapshot> snapshot;
};

// Unites the blocks of the highest rank (volumes, otherwise surfaces); notes name the others.
// Images with the same Spacing and Direction, whose points lie on one lattice that they fill to at
// least an eighth, become one image. Errors: bad_data if no block can be shown.
Result<Snapshot> unite(Files& files, const std::shared_ptr<const InputFile>& file,
                       std::vector<Block> blocks);

// Checks that the pieces of a parallel file overlap by no more cells than its ghost level explains,
// and marks those that overlap. Errors: bad_data, with the names of two pieces.
Result<void> check_overlap(const InputFile& file, Snapshot& snapshot, std::int64_t ghost_level);

}  // namespace windsplat::data::vtk
