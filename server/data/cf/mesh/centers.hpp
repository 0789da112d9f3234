// Whether the cells of a mesh lie where a file says their centers are.
#pragma once

#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/mesh/mesh.hpp"

namespace windsplat::data::cf {

// Compares up to 10,000 cells with the longitudes and latitudes that a file gives for them, which
// shows numbers of nodes that are off by one and grid files of another mesh. dimensions: those that
// list the cells. Missing centers are not compared. Errors: bad_data if more than a hundredth of
// the centers lie outside of the box around their cell by more than a quarter of its size, and are
// no circumcentres either.
Result<void> check_centers(const ArrayFile& file, const std::vector<int>& dimensions,
                           const Mesh& mesh);

}  // namespace windsplat::data::cf
