// The contents of a file whose variables on a mesh are to be resampled, and where each comes from.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/edges/edges.hpp"
#include "server/data/cf/mesh/lattice.hpp"
#include "server/data/cf/mesh/mesh.hpp"
#include "server/data/cf/mesh/models.hpp"
#include "server/data/cf/mesh/topology.hpp"
#include "server/data/cf/mesh/weights.hpp"

namespace windsplat::data::cf {

// Where the values of a variable come from.
struct MeshPart {
  int base = -1;                                   // variable of the file; -1: `values`, or heights
  std::optional<MeshLocation> location;            // set: resampled
  std::optional<EdgePart> edges;                   // set: from values on edges, by way of the cells
  MissingNormal missing = MissingNormal::unknown;  // of those values
  std::size_t list = 0;        // position of the list among the base's dimensions
  std::vector<double> values;  // of a coordinate that is not in the file
};

struct MeshContents {
  FileContents contents;
  std::vector<MeshPart> parts;  // parallel to contents.variables
  EdgeTables edges;
  SigmaHeights heights;              // of the part at nodes without a base
  std::vector<int> cell_dimensions;  // dimensions of the file that list the cells

  // Where most variables lie.
  [[nodiscard]] MeshLocation most() const;
};

// Replaces the list of cells or nodes by y and x of the lattice, the last dimensions, leaves out
// what describes the mesh and adds coordinates. Errors: bad_data.
Result<MeshContents> contents_on_lattice(const ArrayFile& file, const Topology& topology,
                                         const Mesh& mesh, const MeshLattice& lattice);

}  // namespace windsplat::data::cf
