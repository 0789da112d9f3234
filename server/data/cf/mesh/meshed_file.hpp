// Files of models on unstructured meshes: every variable on a lattice. ArrayFile -> ArrayFile.
#pragma once

#include <memory>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// The file itself if it describes no mesh on which variables lie. Otherwise a file whose variables
// at cells or nodes have two dimensions of a lattice in place of that of the list, the last ones;
// they are resampled when they are read. Scalars on edges are averaged to the cells, and components
// normal to the edges become vectors there (edges.hpp); what describes the mesh is left out. Notes
// give the sizes of mesh and lattice and the error of resampling. FVCOM's
// heights of levels are added. Errors: bad_data, for a mesh that is malformed or lies
// elsewhere than the file says (check_centers).
Result<std::unique_ptr<ArrayFile>> meshed(std::unique_ptr<ArrayFile> file);

}  // namespace windsplat::data::cf
