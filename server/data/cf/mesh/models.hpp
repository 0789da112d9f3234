// What models on unstructured meshes leave to their documentation: names of velocities and levels.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/mesh/topology.hpp"

namespace windsplat::data::cf {

// Sets standard names of the velocities and heights of MPAS, ICON and FVCOM, where there are none.
void name_mesh_variables(FileContents& contents, const std::string& convention);

// Whether a 1-D variable has the name of a position, size or number of a cell, edge or vertex of a
// model, which need not have units: latCell, areaCell of MPAS.
bool describes_mesh_of(std::string_view convention, const std::string& name);

// A vertical coordinate that a model describes otherwise.
struct MeshLevels {
  int dimension = -1;
  FileVariable variable;  // without dimensions
  std::vector<double> values;
};

// FVCOM: the mean of siglay(siglay, node). MPAS-Ocean, whose levels are numbered downward: their
// depths by refBottomDepth, or their numbers. Errors: bad_data.
Result<std::vector<MeshLevels>> levels_of_mesh(const ArrayFile& file, const Topology& topology);

// height = zeta + siglay (h + zeta), in metres above the datum of zeta (FVCOM user manual).
// Variables of the file; all are absent (-1) unless siglay(siglay, node), h(node) and zeta are
// given.
struct SigmaHeights {
  int sigma = -1;
  int depth = -1;
  int surface = -1;
};
SigmaHeights sigma_heights_of(const FileContents& contents, const Topology& topology);

}  // namespace windsplat::data::cf
