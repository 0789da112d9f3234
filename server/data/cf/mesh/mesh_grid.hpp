// A mesh with its lattice and weights: values at all cells or nodes -> samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/mesh/lattice.hpp"
#include "server/data/cf/mesh/mesh.hpp"
#include "server/data/cf/mesh/weights.hpp"

namespace windsplat::data::cf {

class MeshGrid {
 public:
  // Memory for a sample: its cell, its place and weights, and values of two layers.
  static constexpr std::size_t bytes_of_sample = sizeof(std::uint32_t) + sizeof(SamplePlace) + 8;

  // samples_max: of the lattice. Errors: bad_data, from lattice_of() and find_cells().
  static Result<MeshGrid> of(Mesh mesh, std::size_t samples_max);

  [[nodiscard]] const Mesh& mesh() const { return *mesh_; }
  [[nodiscard]] const MeshLattice& lattice() const { return lattice_; }

  // The weights for values at cells or nodes, computed when they are first asked for.
  MeshWeights& weights(MeshLocation location);

  // For users: sizes of mesh and lattice, and the error of resampling values at `most`.
  // by_positions: the nodes are positions without outlines.
  [[nodiscard]] std::vector<std::string> notes(const std::string& convention, MeshLocation most,
                                               bool by_positions);

 private:
  std::unique_ptr<Mesh> mesh_;  // the weights refer to it
  MeshLattice lattice_;
  CellsOfSamples cells_;
  std::array<std::optional<MeshWeights>, 2> weights_;
};

}  // namespace windsplat::data::cf
