// Values on the edges of a mesh -> values at its cells.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/mesh/mesh.hpp"
#include "server/data/cf/mesh/topology.hpp"

namespace windsplat::data::cf {

// What a file tells of the edges: variables, -1 where absent. Cells and edges are joined by the
// nodes of each edge (UGRID, MPAS) or by the edges of each cell (ICON).
struct EdgeTables {
  int nodes = -1;
  int of_cells = -1;
  std::array<int, 2> middles{-1, -1};  // longitudes and latitudes; read beside of_cells alone
  // The direction in which a normal component is positive: its angle from the east, in radians
  // unless its unit is degrees (MPAS), or its parts along east and north (ICON).
  int angle = -1;
  std::array<int, 2> normals{-1, -1};

  [[nodiscard]] bool are_known() const { return nodes >= 0 || of_cells >= 0; }
  [[nodiscard]] bool have_normals() const { return angle >= 0 || normals[0] >= 0; }
};
EdgeTables find_edge_tables(const ArrayFile& file, const Topology& topology);

inline constexpr std::uint32_t no_mesh_edge = std::numeric_limits<std::uint32_t>::max();

// Edges and the cells beside them. Directions and positions are those of space: on the sphere unit
// vectors, elsewhere x, y and 0.
struct MeshEdges {
  using Vector = std::array<double, 3>;
  std::size_t count = 0;
  // Parallel to Mesh::corners: the edge from that corner to the next; no_mesh_edge where the file
  // has none. Not in_order: the edges of each cell in any order.
  std::vector<std::uint32_t> of_sides;
  bool in_order = true;
  std::vector<Vector> middles;
  std::vector<Vector> normals;  // of length 1; empty if they are not known
};

// Errors: bad_data, naming the variable: numbers that do not exist; angles beyond a circle; edges
// of which most are no sides of cells.
Result<MeshEdges> read_edges(const ArrayFile& file, const EdgeTables& tables,
                             const Topology& topology, const Mesh& mesh);

// The position in space of a longitude and latitude in degrees, or of x and y.
MeshEdges::Vector in_space(const PlanePoint& place, bool on_sphere);

// East and north at a position in space, or x and y.
std::array<MeshEdges::Vector, 2> axes_at(const MeshEdges::Vector& place, bool on_sphere);

enum class EdgePart { mean, east, north };

// What a missing component along the normal of an edge says.
enum class MissingNormal {
  unknown,  // nothing
  wall,     // no flow through the edge, as at the coasts and the bottom of an ocean
};

// Weights of the edges of each cell.
//  - Scalars: the mean of the values at the middles of the sides, weighted by the areas of the
//    triangles between the centroid and the sides, which makes linear functions exact at the
//    centroid. Missing values are left out.
//  - Vectors (east and north, or x and y) from normal components: the vector whose components along
//    the normals are nearest to the values in the least squares with the same weights. Where the
//    sides are perpendicular to the ways from the centroid to their middles, this is Perot's
//    formula (Conservation properties of unstructured staggered mesh schemes, J. Comput. Phys. 159,
//    2000). Constant vectors are exact; the error is of second order in the cell size in cells that
//    are symmetric, otherwise of first order. Triangles, in which that error alternates, take a
//    linear function by least squares from their sides and those of their neighbours, so that
//    linear fields are exact, where these determine it. Where any of these edges is missing, the
//    constant vector is fitted to the cell's own sides without those that are missing, or with 0
//    there if they are walls; cells whose sides do not determine it are masked.
// A cell all of whose sides are missing is masked.
class EdgeWeights {
 public:
  EdgeWeights(const Mesh& mesh, const MeshEdges& edges);

  // values: one per edge, NaN where missing; out: one per cell. East and north need normals.
  void gather(EdgePart part, MissingNormal missing, const float* values, float* out) const;

 private:
  struct Maker;

  void gather_means(const float* values, float* out) const;

  std::vector<std::uint32_t> first_;  // of each cell in `edges_`, and the end of the last
  std::vector<std::uint8_t> sides_;   // how many of a cell's edges are its own, which come first
  std::vector<std::uint32_t> edges_;
  std::vector<float> mean_;  // of the own edges alone; 0 for others
  std::vector<float> east_;  // empty without normals
  std::vector<float> north_;
  // of the own edges alone, cell after cell, along the axes at the cell; empty without normals
  std::vector<std::array<float, 2>> normals_;
};

// The values at the cells of one file's variables on edges. Tables are read, and weights computed,
// when they are first needed.
class EdgeValues {
 public:
  EdgeValues(Topology topology, const EdgeTables& tables)
      : topology_(std::move(topology)), tables_(tables) {}

  // values: one per edge; the result has one per cell, valid until the next call. Errors: those of
  // read_edges().
  Result<const float*> at_cells(const ArrayFile& file, const Mesh& mesh, EdgePart part,
                                MissingNormal missing, const float* values);

 private:
  Topology topology_;
  EdgeTables tables_;
  std::optional<EdgeWeights> weights_;
  std::vector<float> cells_;
};

}  // namespace windsplat::data::cf
