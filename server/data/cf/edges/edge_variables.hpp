// What is drawn of a variable on the edges of a mesh.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/data/cf/array_file.hpp"
#include "server/data/cf/contents.hpp"
#include "server/data/cf/edges/edges.hpp"
#include "server/data/cf/mesh/mesh.hpp"
#include "server/data/cf/mesh/topology.hpp"

namespace windsplat::data::cf {

struct EdgeUse {
  std::string reason;      // why it is left out; empty if it is drawn
  bool is_normal = false;  // a component along the normals of the edges, of which vectors are made
  MissingNormal missing = MissingNormal::unknown;
};

// Dimensions of a file that list the cells and the edges of its mesh.
struct ListsOfMesh {
  std::vector<int> cells;
  std::vector<int> edges;
};

// Scalars are drawn if their names, descriptions or units say that they are temperatures, salinity,
// depths, thicknesses, heights, pressures, densities, humidity, mixing ratios, fractions,
// concentrations or tracers, and none that they are a rate, an angle or a flow: others may be
// components, whose sign depends on the direction of the edge. Normal components are velocities
// that MPAS, MPAS-Ocean and ICON name so, in files that give the normals and have no vector of the
// same times and levels at the cells. In water a missing one is a wall. contents: of the file.
EdgeUse use_of_edges(const FileVariable& variable, const FileContents& contents,
                     const ListsOfMesh& lists, const Topology& topology, const EdgeTables& tables);

// The components of the vectors at the cells, along east and north or x and y: named after the
// normal component, with standard names of winds or of currents.
std::array<FileVariable, 2> components_of_normal(const FileVariable& normal,
                                                 const FileContents& contents, bool on_sphere);

// Says which variables on edges are drawn, and how.
class EdgeNotes {
 public:
  // What is wrong with the tables of edges; empty if nothing is. They are read for it at the first
  // call, so that a fault leaves out the values on edges when the file is opened, and nothing else.
  // Directions that cannot be read leave out the components along the normals alone; they are then
  // removed from the tables.
  const std::string& fault_of_tables(const ArrayFile& file, EdgeTables& tables,
                                     const Topology& topology, const Mesh& mesh, bool is_normal);
  void add(const std::string& name, const EdgeUse& use);
  void tell(std::vector<std::string>& notes) const;

 private:
  std::string means_;
  std::string normals_;
  std::string walls_;
  std::optional<std::string> fault_;
  std::string normals_fault_;
};

}  // namespace windsplat::data::cf
