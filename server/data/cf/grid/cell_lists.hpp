// Dimensions that number cells, edges, nodes or stations in a list instead of along an axis.
#pragma once

#include <string>
#include <vector>

#include "server/data/cf/contents.hpp"

namespace windsplat::data::cf {

// One entry per dimension. Evidence: 1-D longitudes and 1-D latitudes on the same dimension; UGRID
// (version 1.0: cf_role, mesh); the usual names of models without either.
std::vector<bool> find_cell_lists(const FileContents& contents);

// Why a variable on a list without a mesh is not drawn.
std::string problem_of_list(const FileDimension& list);

// The 32 digits of the UUID of a horizontal grid, in lower case; empty if the text, such as
// "bbbd5a09-8554-9924-3c7a-4aa4c9861920", has none or consists of 0 or f only, which means unknown.
std::string known_grid_uuid(const std::string& text);

// Whether two lists belong to horizontal grids of different UUIDs; false if one is unknown.
bool are_of_different_grids(const FileDimension& a, const FileDimension& b);

// Longitudes (-1) or latitudes (1) by attributes, or in radians by name (lonCell); 0: neither.
int side_of(const FileVariable& variable);

}  // namespace windsplat::data::cf
