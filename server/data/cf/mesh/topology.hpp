// Which variables of a file describe a mesh, in any of the known conventions, and the mesh they
// hold.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/mesh/mesh.hpp"

namespace windsplat::data::cf {

// Variables are ids of the file, -1 where absent; pairs are of longitude and latitude, or x and y.
struct Topology {
  std::string convention;  // for notes: "UGRID", "MPAS", ...
  int cells = -1;          // dimensions
  int nodes = -1;          // -1: no data lie at nodes
  int edges = -1;
  // Cells by the numbers of their nodes, ...
  int connectivity = -1;
  int degrees = -1;  // the number of corners of each cell; -1: padding tells
  double start_index = 0;
  bool start_is_assumed = false;  // the file does not give it
  std::array<int, 2> node_positions{-1, -1};
  // used where the longitudes are all equal, as in models of a plane
  std::array<int, 2> plane_positions{-1, -1};
  // ... or by positions of their corners
  std::array<int, 2> corner_positions{-1, -1};
  // ... or, without either, by neighbourhood of the nodes: there are no cells with data.
  bool by_neighbours = false;
  bool on_sphere = false;   // node_positions or corner_positions are angles
  bool is_radian = false;   // without units they are in radians
  std::vector<int> others;  // further variables that describe the mesh
};

// Known are UGRID 1.0 (2-D topologies), MPAS, FVCOM, FESOM, bounds of CF (ICON) and SCRIP. Without
// any of them, and without variables on a lattice: the longest list of at least centers_min
// positions. Empty if there is none.
std::optional<Topology> find_topology(const ArrayFile& file);

// Variables that hold the mesh itself.
std::vector<int> variables_of(const Topology& topology);

// For files that are joined before their mesh is read: up to three dimensions that list cells,
// nodes or edges, in place of axes, and the time of the variables on them. Empty if there are no
// such variables. The choice has no variables.
std::optional<GridChoice> grid_of_lists(const ArrayFile& file);

// Reads and checks a mesh. Numbers of nodes without a start index count from 0 (UGRID 1.0) unless
// they can only count from 1, which a note says. Errors: bad_data, naming the variable and the
// cell: numbers of nodes that do not exist, or that may count from 0 or 1; cells of fewer than
// three corners or more than mesh_corners_max; positions that are missing or no latitudes.
Result<Mesh> read_mesh(const ArrayFile& file, const Topology& topology,
                       std::vector<std::string>& notes);
inline constexpr std::size_t mesh_corners_max = 64;

// Numbers of nodes, counted from 0, NaN where padding: `width` corners for each cell -> a mesh
// without positions. `name`: of the variable, for messages. Errors: bad_data.
Result<Mesh> mesh_of_indices(const std::vector<double>& indices, std::size_t width,
                             std::size_t nodes, const std::string& name);

// Positions of corners, `width` for each cell, NaN where padding -> a mesh whose equal corners are
// one node. tolerance: degrees. Errors: bad_data.
Result<Mesh> mesh_of_corners(const std::vector<double>& longitudes,
                             const std::vector<double>& latitudes, std::size_t width,
                             double tolerance, const std::string& name);

}  // namespace windsplat::data::cf
