// What is drawn of a variable on the edges of a mesh.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/data/cf/contents.hpp"
#include "server/data/cf/edges/edges.hpp"
#include "server/data/cf/mesh/topology.hpp"

namespace windsplat::data::cf {

struct EdgeUse {
  std::string reason;      // why it is left out; empty if it is drawn
  bool is_normal = false;  // a component along the normals of the edges, of which vectors are made
  MissingNormal missing = MissingNormal::unknown;
};

// Scalars are drawn if nothing suggests that their sign or size depends on the direction of an
// edge: floating-point numbers with a unit that is no angle and no rate, whose names and
// descriptions speak of no flow. Normal components are velocities that MPAS, MPAS-Ocean and ICON
// name so, in files that give the normals and have no vector at the cells. In water a missing one
// is a wall.
// contents: of the file; cells: its dimensions that list the cells.
EdgeUse use_of_edges(const FileVariable& variable, const FileContents& contents,
                     const std::vector<int>& cells, const Topology& topology,
                     const EdgeTables& tables);

// The components of the vectors at the cells, along east and north or x and y: named after the
// normal component, with standard names of winds or of currents.
std::array<FileVariable, 2> components_of_normal(const FileVariable& normal,
                                                 const FileContents& contents, bool on_sphere);

// Says which variables on edges are drawn, and how.
class EdgeNotes {
 public:
  void add(const std::string& name, const EdgeUse& use);
  void tell(std::vector<std::string>& notes) const;

 private:
  std::string means_;
  std::string normals_;
  std::string walls_;
};

}  // namespace windsplat::data::cf
