// Variables on one grid -> the fields a view can name: vectors put together from their components,
// then every variable as a scalar.
#pragma once

#include <vector>

#include "server/data/cf/contents.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

struct FieldPlan {
  FieldInfo info;
  std::vector<int> variables;  // one a component, indices into FileContents::variables
};

// variables: those on the chosen grid. vertical: the kind of its z axis (a depth axis makes u and
// v a current). Components are found by our own mark, then by standard_name (eastward_, northward_,
// upward_...), then by usual names (u v w, ua va wap, ugrd vgrd, Ex Ey Ez, b_x b_y b_z, ...), and
// must have the same dimensions in whatever order, and the first two the same units.
std::vector<FieldPlan> find_fields(const FileContents& contents, const std::vector<int>& variables,
                                   AxisKind vertical);

}  // namespace windsplat::data::cf
