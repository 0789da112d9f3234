// Values at cells or nodes of a mesh -> values at the samples of a lattice, with weights that are
// computed once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/data/cf/mesh/lattice.hpp"
#include "server/data/cf/mesh/mesh.hpp"

namespace windsplat::data::cf {

enum class MeshLocation { face, node };

// A sample in the triangle of a point within its cell (the apex) and two neighbouring corners.
struct SamplePlace {
  std::uint32_t cell = no_mesh_cell;
  std::uint32_t first = 0;  // nodes
  std::uint32_t second = 0;
  float first_weight = 0;
  float second_weight = 0;  // the apex has the rest of 1
};

// Linear interpolation in the triangles between an apex in each cell and its edges: continuous and
// within the range of the values around.
//  - Values at nodes: the apex is the mean of the corners, so that linear functions are exact.
//  - Values at cells: the apex is the centroid with the cell's value. A node has the mean of the
//    cells around it, weighted such that linear functions are exact (Holmes, Connell, AIAA
//    89-1932). Weights that would be negative, because the node does not lie amid the centroids
//    (at the rim of the mesh), are 0; if the others' mean is below a quarter, all are equal.
// Errors are of second order in the cell size, at the rim for values at cells of first order.
// Missing values: a node without a value has that of its twin (Mesh::twins); a cell without a value
// is masked, as is one with a node without a value; missing cells do not count for the nodes beside
// them.
class MeshWeights {
 public:
  // cells: of each sample, from find_cells().
  MeshWeights(const Mesh& mesh, const MeshLattice& lattice, const std::vector<std::uint32_t>& cells,
              MeshLocation location);

  // values: one per cell or node, NaN where missing; out: one per sample, x fastest.
  void gather(const float* values, float* out);

  [[nodiscard]] std::uint32_t cell_of(std::size_t sample) const { return places_[sample].cell; }

 private:
  void place_samples(const MeshLattice& lattice, const std::vector<std::uint32_t>& cells);
  void weigh_cells();
  const float* with_twins(const float* values);
  void complete_nodes(const float* values);
  void complete_cells(const float* values);

  const Mesh& mesh_;
  MeshLocation location_;
  std::vector<SamplePlace> places_;
  // The cells around each node, and their weights. Empty for values at nodes.
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> around_;
  std::vector<float> weights_;
  std::vector<float> completed_;  // values at nodes of values at cells, and the reverse
  std::vector<float> filled_;     // values at nodes, with those of twins
};

}  // namespace windsplat::data::cf
